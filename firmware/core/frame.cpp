#include "frame.h"

namespace plate {
namespace {

const uint8_t SMALLEST = 2 + 2;  // type, seq, CRC

void restart(Decoder& decoder) {
    decoder.count = 0;
    decoder.too_long = false;
    decoder.complete = false;
}

// Decodes COBS in place. Returns the length, 0 for invalid COBS.
uint8_t unstuff(uint8_t* bytes, uint8_t count) {
    uint8_t read = 0, written = 0;
    while (read < count) {
        const uint8_t code = bytes[read++];
        if (code - 1 > count - read) return 0;
        for (uint8_t i = 1; i < code; i++) bytes[written++] = bytes[read++];
        if (read < count) bytes[written++] = 0;
    }
    return written;
}

Received finish(Decoder& decoder) {
    const uint8_t count = unstuff(decoder.bytes, decoder.count);
    if (count < SMALLEST) return Received::garbage;
    const uint8_t content = count - 2;
    const uint16_t sent = decoder.bytes[content] | (uint16_t)decoder.bytes[content + 1] << 8;
    if (crc16(decoder.bytes, content) != sent) return Received::garbage;
    decoder.count = content;
    return Received::frame;
}

}  // namespace

uint16_t crc16(const uint8_t* bytes, uint8_t count) {
    uint16_t crc = 0xFFFF;
    while (count--) {
        crc ^= (uint16_t)*bytes++ << 8;
        for (uint8_t bit = 0; bit < 8; bit++)
            crc = crc & 0x8000 ? (uint16_t)(crc << 1) ^ 0x1021 : (uint16_t)(crc << 1);
    }
    return crc;
}

uint8_t encode_frame(const uint8_t* content, uint8_t count, uint8_t* wire) {
    if (count > MAX_RAW - 2) return 0;
    const uint16_t crc = crc16(content, count);
    uint8_t code_at = 0, written = 1, code = 1;
    for (uint8_t i = 0; i < count + 2; i++) {
        const uint8_t byte = i < count ? content[i] : (uint8_t)(i == count ? crc : crc >> 8);
        if (byte) {
            wire[written++] = byte;
            code++;
            continue;
        }
        wire[code_at] = code;
        code_at = written++;
        code = 1;
    }
    wire[code_at] = code;
    wire[written++] = 0;
    return written;
}

Received decode_byte(Decoder& decoder, uint8_t byte) {
    if (decoder.complete) restart(decoder);
    if (byte) {
        if (decoder.count < MAX_WIRE - 1)
            decoder.bytes[decoder.count++] = byte;
        else
            decoder.too_long = true;
        return Received::nothing;
    }
    decoder.complete = true;
    if (decoder.too_long) return Received::garbage;
    return decoder.count ? finish(decoder) : Received::nothing;
}

}  // namespace plate
