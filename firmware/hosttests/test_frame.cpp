#include <doctest/doctest.h>

#include <cstring>
#include <random>

#include "bench.h"

using namespace plate;

namespace {

int frames_in(Decoder& decoder, const std::vector<uint8_t>& bytes) {
    int frames = 0;
    for (uint8_t byte : bytes) frames += decode_byte(decoder, byte) == Received::frame;
    return frames;
}

}  // namespace

TEST_CASE("every length and many runs of zeros survive a round trip") {
    std::mt19937 chance(1);
    for (uint8_t count = 2; count <= MAX_RAW - 2; count++) {
        for (int round = 0; round < 100; round++) {
            uint8_t content[MAX_RAW], wire[MAX_WIRE];
            for (uint8_t i = 0; i < count; i++) content[i] = chance() % 3 ? 0 : (uint8_t)chance();
            const uint8_t written = encode_frame(content, count, wire);
            REQUIRE(written <= MAX_WIRE);
            REQUIRE(std::memchr(wire, 0, written) == wire + written - 1);
            Decoder decoder{};
            REQUIRE(frames_in(decoder, {wire, wire + written}) == 1);
            REQUIRE(decoder.count == count);
            REQUIRE(std::memcmp(decoder.bytes, content, count) == 0);
        }
    }
}

TEST_CASE("content that is too long is not encoded") {
    uint8_t content[MAX_RAW] = {}, wire[MAX_WIRE];
    CHECK(encode_frame(content, MAX_RAW - 1, wire) == 0);
}

TEST_CASE("no frame with one bit wrong passes, and the next frame does") {
    const auto good = frame_of(SETPOINT, 7, {0x18, 0x92, 0, 0, 0xF4, 1});
    for (size_t at = 0; at < good.size(); at++) {
        for (int wrong = 0; wrong < 8; wrong++) {
            auto bytes = good;
            bytes[at] ^= (uint8_t)(1 << wrong);
            Decoder decoder{};
            CHECK(frames_in(decoder, bytes) == 0);
            frames_in(decoder, {0});
            CHECK(frames_in(decoder, good) == 1);
        }
    }
}

TEST_CASE("a frame truncated at any length is garbage, and the next one passes") {
    const auto good = frame_of(SETPOINT, 7, {0x18, 0x92, 0, 0, 0xF4, 1});
    for (size_t kept = 1; kept + 1 < good.size(); kept++) {
        Decoder decoder{};
        CHECK(frames_in(decoder, {good.begin(), good.begin() + (long)kept}) == 0);
        CHECK(decode_byte(decoder, 0) == Received::garbage);
        CHECK(frames_in(decoder, good) == 1);
    }
}

TEST_CASE("an endless frame is dropped whole") {
    Decoder decoder{};
    CHECK(frames_in(decoder, std::vector<uint8_t>(5000, 0x55)) == 0);
    CHECK(decode_byte(decoder, 0) == Received::garbage);
    CHECK(frames_in(decoder, frame_of(OFF, 1, {})) == 1);
}

TEST_CASE("a frame without type and seq is garbage though its CRC is right") {
    uint8_t content[1] = {OFF}, wire[MAX_WIRE];
    const uint8_t written = encode_frame(content, 1, wire);
    Decoder decoder{};
    CHECK(frames_in(decoder, {wire, wire + written}) == 0);
}
