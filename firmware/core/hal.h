// What a board supplies. Everything else in core/ knows no chip.
#pragma once
#include <stdint.h>

#include "session.h"

namespace plate {

uint32_t hal_uptime_ms();
uint8_t hal_reset_cause();                           // ResetCause bits 0-3 as the chip gives them
void hal_drive(int16_t counts);                      // of FULL_SCALE_COUNTS, > 0 heats; 0 opens the bridge
void hal_light(bool on);                             // for a person to see
void hal_send(const uint8_t* bytes, uint8_t count);  // whole or not at all, never waits
bool hal_cut_out_is_open();                          // as its sense contact says; a broken wire is open
Keepsake& hal_keepsake();                            // survives a reset, not a power cut; not cleared at start
void hal_feed_watchdog();

}  // namespace plate
