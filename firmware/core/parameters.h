// The parameters of a built plate, kept in memory that survives a power cut. Today there is one: the lag of its beads.
#pragma once
#include <stdint.h>

namespace plate {

const uint16_t LAG_UNKNOWN_MS = 0xFFFF;

// Returns the lag that was saved, LAG_UNKNOWN_MS when there is none or the record is damaged.
uint16_t saved_lag_ms();

void save_lag(uint16_t lag_ms);

}  // namespace plate
