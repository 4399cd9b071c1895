// Feeds any payloads with a valid CRC and any converter sums: [type, size, payload, steps, sums], repeated.
#include <cstddef>

#include "fuzz.h"

namespace {

struct Input {
    const uint8_t* at;
    size_t left;

    uint8_t u8() {
        if (!left) return 0;
        left--;
        return *at++;
    }
    uint16_t u16() { return (uint16_t)(u8() | u8() << 8); }
};

void take_message(plate::Board& board, Input& input) {
    const uint8_t type = input.u8(), size = input.u8() % (plate::MAX_PAYLOAD + 1);
    std::vector<uint8_t> payload;
    for (uint8_t i = 0; i < size; i++) payload.push_back(input.u8());
    for (uint8_t byte : frame_of(type, input.u8(), payload)) plate::receive(board, byte);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* bytes, size_t count) {
    static plate::Board board;
    be_new(board);
    Input input{bytes, count};
    while (input.left) {
        take_message(board, input);
        must_hold(board);
        uint16_t sums[plate::PLACES];
        for (uint16_t& sum : sums) sum = input.u16();
        for (uint8_t steps = input.u8() % 16; steps; steps--) {
            plate::step(board, sums);
            must_hold(board);
        }
    }
    return 0;
}
