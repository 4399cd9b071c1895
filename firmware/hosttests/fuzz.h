// Checks the invariants that must hold after every byte and every step.
#pragma once
#include "bench.h"

inline void must_hold(const plate::Board& board) {
    using namespace plate;
    const bool driving = board.state == State::holding || board.state == State::returning;
    const bool sound = bench.counts <= HEAT_CAP_COUNTS && bench.counts >= -COOL_CAP_COUNTS &&
                       (driving || bench.counts == 0) && (board.hello_received || !driving) &&
                       (!board.faults || board.state == State::faulted) && board.ttl_ms <= MAX_TTL_MS;
    if (!sound) __builtin_trap();
}

inline void be_new(plate::Board& board) {
    bench = Bench();
    plate::start(board);
}
