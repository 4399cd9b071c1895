// Feeds any bytes to the line, with a control step of a working board after every 32.
#include <cstddef>

#include "fuzz.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* bytes, size_t count) {
    static plate::Board board;
    be_new(board);
    const uint16_t sums[plate::PLACES] = {sum_at(30), sum_at(30), sum_at(25), sum_at(30, plate::CUT_OUT_BETA_K)};
    for (size_t i = 0; i < count; i++) {
        plate::receive(board, bytes[i]);
        if (i % 32 == 0) plate::step(board, sums);
        must_hold(board);
    }
    return 0;
}
