// The functions that a board supplies. Everything else in core/ is independent of the chip.
#pragma once
#include <stdint.h>

#include "session.h"

namespace plate {

uint32_t hal_uptime_ms();
uint8_t hal_reset_cause();                           // ResetCause bits 0-3 as reported by the chip
void hal_drive(int16_t counts);                      // of FULL_SCALE_COUNTS, > 0 heats; 0 opens the bridge
void hal_light(bool on);                             // status light
void hal_send(const uint8_t* bytes, uint8_t count);  // sends all bytes or none, never waits
bool hal_cut_out_is_open();                          // proved by its break contact; a broken wire proves nothing
void hal_permit_cut_out(bool permitted);             // its relay lets go without; closing it takes its button as well
PersistentState& hal_persistent_state();             // survives a reset but not a power cut; not cleared at start

// Memory that survives a power cut, 0xFF in a new chip. Writing takes 15 ms and is only asked for with the bridge off.
enum : uint8_t { PARAMETER_BYTES = 4 };
void hal_read_parameters(uint8_t* bytes);
void hal_write_parameters(const uint8_t* bytes);

void hal_feed_watchdog();

}  // namespace plate
