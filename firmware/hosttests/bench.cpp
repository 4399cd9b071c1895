#include "bench.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "parameters.h"

using namespace plate;

Bench bench;

const double PULSED_C_A_S = 3.25;  // a test pulse of 0.1 A and 0.4 s moves a working plate by 0.13 degC

namespace plate {
uint32_t hal_uptime_ms() {
    return bench.uptime_ms;
}
uint8_t hal_reset_cause() {
    return bench.reset_cause;
}
void hal_drive(int16_t counts) {
    bench.counts = counts;
}
void hal_light(bool on) {
    bench.light = on;
}
void hal_send(const uint8_t* bytes, uint8_t count) {
    bench.sent.insert(bench.sent.end(), bytes, bytes + count);
}
bool hal_cut_out_is_open() {
    return bench.cut_out_is_open;
}
void hal_permit_cut_out(bool permitted) {
    bench.cut_out_is_permitted = permitted;
}
PersistentState& hal_persistent_state() {
    return bench.persistent_state;
}
void hal_read_parameters(uint8_t* bytes) {
    std::memcpy(bytes, bench.parameters, PARAMETER_BYTES);
}
void hal_write_parameters(const uint8_t* bytes) {
    std::memcpy(bench.parameters, bytes, PARAMETER_BYTES);
}
void hal_feed_watchdog() {
    bench.fed++;
}
}  // namespace plate

namespace {

uint32_t read(const std::vector<uint8_t>& bytes, size_t& at, int size) {
    uint32_t value = 0;
    for (int i = 0; i < size; i++) value |= (uint32_t)bytes.at(at++) << (8 * i);
    return value;
}

Telemetry parsed(const std::vector<uint8_t>& content) {
    size_t at = 2;
    auto u8 = [&] { return (uint8_t)read(content, at, 1); };
    auto u16 = [&] { return (uint16_t)read(content, at, 2); };
    auto u32 = [&] { return read(content, at, 4); };
    Telemetry telemetry{};
    telemetry.uptime_ms = u32();
    telemetry.state = u8();
    telemetry.faults = u32();
    telemetry.plate_mc = (int32_t)u32();
    telemetry.plate2_mc = (int32_t)u32();
    telemetry.sink_mc = (int32_t)u32();
    telemetry.setpoint_mc = (int32_t)u32();
    telemetry.duty = (int16_t)u16();
    telemetry.limited = u8();
    telemetry.bad_frames = u16();
    telemetry.refused = u16();
    telemetry.dose_mcem43 = u16();
    telemetry.heated_s = u16();
    telemetry.reset_cause = u8();
    return telemetry;
}

}  // namespace

uint16_t sum_at(double celsius, double beta_k) {
    const double ratio = std::exp(beta_k * (1.0 / (celsius + 273.15) - 1.0 / 298.15));
    return (uint16_t)std::lround(READING_FULL_SCALE * ratio / (1.0 + ratio) - 8.0);
}

Rig::Rig(uint16_t lag_ms) {
    bench = Bench();
    std::memset(&bench.persistent_state, 0xA7, sizeof bench.persistent_state);  // uninitialised RAM
    save_lag(lag_ms);
    start(board);
    start_cut_out();
}

void Rig::start_cut_out() {
    for (bool is_open : {true, false, true, false}) {
        bench.cut_out_is_open = is_open;
        for (int i = 0; i < 20 && bench.cut_out_is_permitted != is_open; i++) step();
    }
}

void Rig::reset(uint8_t cause) {
    bench.reset_cause = cause;
    bench.counts = 0;
    start(board);
    bench.cut_out_is_permitted = false;
    start_cut_out();
}

void Rig::step(int steps) {
    while (steps--) {
        pulsed_c += pulse_a(board.pulse) * PULSED_C_A_S * STEP_S;
        step_on({sum_at(a_c + a_answers * pulsed_c), sum_at(b_c + b_answers * pulsed_c), sum_at(sink_c)});
    }
}

void Rig::step_on(std::initializer_list<uint16_t> sums) {
    uint16_t all[PLACES];
    std::copy(sums.begin(), sums.end(), all);
    all[CUT_OUT] = sum_at(b_c + cut_out_off_c, CUT_OUT_BETA_K);
    plate::step(board, all);
    bench.uptime_ms += STEP_MS;
}

int Rig::say(uint8_t type, std::vector<uint8_t> payload) {
    static uint8_t seq = 0;
    bench.sent.clear();
    for (uint8_t byte : frame_of(type, ++seq, payload)) receive(board, byte);
    for (const auto& content : take_frames())
        if (content[0] == ACK && content[2] == type && content[3] == seq) return content[4];
    return -1;
}

int Rig::hold(double celsius, uint16_t ttl_ms) {
    const auto mc = (uint32_t)std::lround(celsius * 1000.0);
    return say(SETPOINT, {(uint8_t)mc, (uint8_t)(mc >> 8), (uint8_t)(mc >> 16), (uint8_t)(mc >> 24),
                          (uint8_t)ttl_ms, (uint8_t)(ttl_ms >> 8)});
}

void Rig::hold_for(double celsius, int steps) {
    for (int i = 0; i < steps && !board.faults; i++) {
        if (i % 5 == 0) hold(celsius);
        step();
    }
}

void Rig::follow_for(double celsius, int steps) {
    for (int i = 0; i < steps && !board.faults; i++) {
        hold_for(celsius, 1);
        plate_at(board.loop.target_c);
    }
}

Telemetry Rig::telemetry() {
    bench.sent.clear();
    for (int i = 0; i < 4; i++) {
        step();
        for (const auto& content : take_frames())
            if (content[0] == TELEMETRY) return parsed(content);
    }
    throw "no telemetry";
}

std::vector<std::vector<uint8_t>> take_frames() {
    std::vector<std::vector<uint8_t>> frames;
    Decoder decoder{};
    for (uint8_t byte : bench.sent)
        if (decode_byte(decoder, byte) == Received::frame)
            frames.emplace_back(decoder.bytes, decoder.bytes + decoder.count);
    bench.sent.clear();
    return frames;
}

std::vector<uint8_t> frame_of(uint8_t type, uint8_t seq, const std::vector<uint8_t>& payload) {
    std::vector<uint8_t> content = {type, seq};
    content.insert(content.end(), payload.begin(), payload.end());
    uint8_t wire[MAX_WIRE];
    const uint8_t count = encode_frame(content.data(), (uint8_t)content.size(), wire);
    return {wire, wire + count};
}
