// Encodes and decodes COBS frames with a CRC-16, independent of their content.
#pragma once
#include <stdint.h>

#include "protocol.h"

namespace plate {

uint16_t crc16(const uint8_t* bytes, uint8_t count);

// Encodes content, its CRC and the final zero as one frame; at most MAX_RAW - 2 bytes of content.
// `wire` must hold MAX_WIRE bytes. Returns the number of bytes written, 0 when the content is too long.
uint8_t encode_frame(const uint8_t* content, uint8_t count, uint8_t* wire);

enum class Received : uint8_t { nothing, frame, garbage };

struct Decoder {
    uint8_t bytes[MAX_WIRE];
    uint8_t count;  // bytes received so far; after a frame: length of its content without CRC
    bool too_long;
    bool complete;
};

// Decodes one received byte. After `frame` the content is in bytes[0..count) until the next call.
Received decode_byte(Decoder& decoder, uint8_t byte);

}  // namespace plate
