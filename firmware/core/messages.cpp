#include "messages.h"

#include <math.h>

#include "hal.h"

namespace plate {
namespace {

struct Writer {
    uint8_t bytes[MAX_RAW];
    uint8_t count;

    Writer(Message type, uint8_t seq) : count(0) {
        u8(type);
        u8(seq);
    }
    void u8(uint8_t value) { bytes[count++] = value; }
    void u16(uint16_t value) {
        u8((uint8_t)value);
        u8((uint8_t)(value >> 8));
    }
    void u32(uint32_t value) {
        u16((uint16_t)value);
        u16((uint16_t)(value >> 16));
    }
    void send() const {
        uint8_t wire[1 + MAX_WIRE] = {0};  // the first zero ends a frame that noise may have started
        hal_send(wire, 1 + encode_frame(bytes, count, wire + 1));
    }
};

int32_t milli(float value) {
    return (int32_t)floorf(value * 1000.0f + 0.5f);
}

uint32_t reading_mc(const Reading& reading) {
    return (uint32_t)(reading.known ? milli(reading.c) : NO_READING);
}

uint16_t to_u16(float value) {
    return value < 65535.0f ? (uint16_t)value : 65535;
}

void count_up(uint16_t& counter) {
    if (counter != 65535) counter++;
}

void send_hello(const Board& board, uint8_t seq) {
    Writer out(HELLO_REPLY, seq);
    out.u8(PROTOCOL_MAJOR);
    out.u8(PROTOCOL_MINOR);
    out.u8(FIRMWARE_MAJOR);
    out.u8(FIRMWARE_MINOR);
    out.u8(FIRMWARE_PATCH);
    out.u32(BOARD_ID);
    out.u32((uint32_t)SETPOINT_LOW_MC);
    out.u32((uint32_t)SETPOINT_HIGH_MC);
    out.u16(SLEW_COOL_MC_S);
    out.u16(MAX_TTL_MS);
    out.u16(HEAT_LIMIT_MA);
    out.u16(COOL_LIMIT_MA);
    out.u16((uint16_t)((int32_t)HEAT_CAP_COUNTS * 1000 / FULL_SCALE_COUNTS));
    out.u16((uint16_t)((int32_t)COOL_CAP_COUNTS * 1000 / FULL_SCALE_COUNTS));
    out.u8(TELEMETRY_HZ);
    out.u8(board.reset_cause);
    out.send();
}

void send_beads(const Board& board, uint8_t seq) {
    Writer out(BEADS, seq);
    out.u16(board.lag_ms);
    out.send();
}

void send_ack(Board& board, uint8_t type, uint8_t seq, Answer answer) {
    Writer out(ACK, board.seq++);
    out.u8(type);
    out.u8(seq);
    out.u8(answer);
    out.send();
}

uint16_t u16_at(const uint8_t* bytes) {
    return bytes[0] | (uint16_t)bytes[1] << 8;
}

int32_t i32_at(const uint8_t* bytes) {
    return (int32_t)(u16_at(bytes) | (uint32_t)u16_at(bytes + 2) << 16);
}

// Returns the payload size of a message from the host, -1 for an unknown type.
int8_t size_of(uint8_t type) {
    switch (type) {
        case HELLO: return HELLO_BYTES;
        case SETPOINT: return SETPOINT_BYTES;
        case OFF: return 0;
        case REST: return 0;
        case CLEAR: return CLEAR_BYTES;
        case LAG: return LAG_BYTES;
        default: return -1;
    }
}

Answer answer_hello(Board& board, uint8_t seq, uint8_t major) {
    board.hello_received = major == PROTOCOL_MAJOR;
    if (!board.hello_received) open_bridge(board);
    send_hello(board, seq);
    send_beads(board, seq);
    return board.hello_received ? OK : VERSION;
}

Answer obey(Board& board, uint8_t type, uint8_t seq, const uint8_t* payload) {
    switch (type) {
        case HELLO: return answer_hello(board, seq, payload[0]);
        case SETPOINT: return ask(board, i32_at(payload), u16_at(payload + 4));
        case OFF: open_bridge(board); return OK;
        case REST: rest(board); return OK;
        case CLEAR: return clear(board, payload[0]);
        case LAG: return keep_lag(board, u16_at(payload));
        default: return UNKNOWN;
    }
}

}  // namespace

void answer_frame(Board& board) {
    const uint8_t type = board.decoder.bytes[0], seq = board.decoder.bytes[1];
    const int8_t size = size_of(type);
    Answer answer = UNKNOWN;
    if (size >= 0) {
        const bool fits = board.decoder.count == 2 + size;
        answer = fits ? obey(board, type, seq, board.decoder.bytes + 2) : LENGTH;
    }
    if (answer != OK) count_up(board.refused);
    send_ack(board, type, seq, answer);
}

void send_telemetry(Board& board) {
    const bool driving = board.state == State::holding || board.state == State::returning;
    Writer out(TELEMETRY, board.seq++);
    out.u32(hal_uptime_ms());
    out.u8((uint8_t)board.state);
    out.u32(board.faults);
    for (uint8_t place = 0; place <= SINK; place++) out.u32(reading_mc(board.sensors.now[place]));
    out.u32((uint32_t)(driving ? milli(board.loop.target_c) : NO_READING));
    out.u16((uint16_t)(int16_t)((int32_t)board.loop.counts * 1000 / FULL_SCALE_COUNTS));
    out.u8(board.loop.limited);
    out.u16(board.bad_frames);
    out.u16(board.refused);
    out.u16(to_u16(board.session.dose_cem43 * 1000.0f));
    out.u16(to_u16(board.session.heated_s));
    out.u8(board.reset_cause);
    out.send();
}

void receive(Board& board, uint8_t byte) {
    switch (decode_byte(board.decoder, byte)) {
        case Received::frame: answer_frame(board); break;
        case Received::garbage: count_up(board.bad_frames); break;
        case Received::nothing: break;
    }
}

}  // namespace plate
