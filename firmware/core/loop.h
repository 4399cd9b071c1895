// The control loop: PI on the estimated face, in amperes, with a feed-forward of fast cooling.
#pragma once
#include <stdint.h>

namespace plate {

struct Loop {
    float goal_c;      // the setpoint after limits
    float target_c;    // the temperature that the plate follows: the goal after slew
    float integral_a;
    float current_a;   // applied, positive heats
    uint8_t falling;   // steps for which the target still counts as falling fast
    float held_a;      // mean current before a test pulse
    float owed;        // remainder of rounding in counts, carried over to a later step
    int16_t counts;
    int8_t saturated;  // 1 at the heating limit, -1 at the cooling limit, 0 between
    uint8_t limited;   // Limit bits of this step
};

void start_loop(Loop& loop, float plate_c);
void stop_loop(Loop& loop);

// Returns the setpoint after the limits of the sink and of the session's heating time.
float limited_setpoint(Loop& loop, float setpoint_c, float sink_c, bool heat_is_spent);

// Inputs of a step: temperatures in degC; the cooling limit and the current of a test pulse in A; whether the lag of
// the beads is known.
struct Course {
    float goal_c, plate_c, sink_c, cool_ceiling_a, pulse_a;
    bool is_told;
};

// Controls one step towards the goal. Stores the output in loop.counts.
void follow(Loop& loop, const Course& course);

// Returns whether a test pulse fits between the current limits.
bool has_room(const Loop& loop, float sink_c, float cool_ceiling_a);

}  // namespace plate
