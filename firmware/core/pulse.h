// Are both plate thermistors alive? A small test pulse of current, which a living bead must answer.
//
// Two beads that froze alike agree with each other, and a host that keeps the current small never
// gives plausibility.h enough heat to judge. So every PULSE_EVERY_MS of driving the current is held,
// raised by PULSE_A for PULSE_HALF ticks of 100 ms and lowered by as much for as many. The mean is
// nothing, so the plate ends where it was; in between a sound plate moves by 0.13 degC (computed, with a
// palm and without) and the skin by less than a tenth. What drifts evenly cancels: the middle is compared
// with the mean of both ends. A plate whose beads both move fast needs no pulse.
#pragma once
#include <stdint.h>

#include "sensors.h"

namespace plate {

struct Pulse {
    uint16_t quiet_ms;  // driven since the last answer
    uint8_t ticks;      // into the pulse, 0 when there is none
    uint8_t unanswered; // pulses in a row
    uint8_t broken_off; // by a new goal, since the last answer
    float goal_c;       // when it began
    float from_c[2], middle_c[2];
};

// One driven step. Returns bits of faults. `grown` as of take_readings; `has_room` says that the current may
// be raised and lowered by PULSE_A within its limits.
uint32_t watch_beads(Pulse& pulse, const Sensors& sensors, bool grown, bool has_room, float goal_c);

// What the pulse adds to the current that was held when it began: PULSE_A, less as much, or nothing.
float pulse_a(const Pulse& pulse);

}  // namespace plate
