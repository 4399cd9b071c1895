// Tests whether both plate thermistors work, by a small pulse of current to which a working bead must respond.
//
// Two beads that froze at the same value agree with each other, and a host that keeps the current small never
// produces enough heat for plausibility.h to judge. So every PULSE_EVERY_MS of driving the current is held,
// raised by PULSE_A for PULSE_HALF ticks of 100 ms, then lowered by the same amount for the same time. Its mean
// is zero, so the plate returns to its temperature. Meanwhile a working plate moves by 0.13 degC (computed, with
// and without a palm) and the skin by less than 0.1. A steady drift cancels, because the middle is compared
// with the mean of both ends. No pulse is needed while both beads move fast.
//
// A bead that lags responds later and less: after 1 s of lag by 0.03 degC. So both moments come later with its lag,
// when its response is largest, and the loop follows again from the end of the pulse on.
#pragma once
#include <stdint.h>

#include "sensors.h"

namespace plate {

struct Pulse {
    uint16_t quiet_ms;  // driving time since the last answer
    uint8_t ticks;      // position in the pulse and its answer, 0 when there is none
    uint8_t unanswered; // pulses in a row
    uint8_t broken_off; // pulses cancelled by a new goal since the last answer
    float goal_c;       // goal at the start of the pulse
    float from_c[2], middle_c[2];
};

// Judges one driven step. Returns fault bits. `grown` is the result of take_readings; `has_room`: the current may
// be raised and lowered by PULSE_A within its limits.
uint32_t watch_beads(Pulse& pulse, const Sensors& sensors, bool grown, bool has_room, float goal_c);

// Returns the current that the pulse adds to the held current: PULSE_A, -PULSE_A, or zero.
float pulse_a(const Pulse& pulse);

}  // namespace plate
