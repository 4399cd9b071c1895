// The control loop: PI on the plate, in amperes, with separate gains for heating and cooling.
#pragma once
#include <stdint.h>

namespace plate {

struct Loop {
    float goal_c;      // the setpoint after limits
    float target_c;    // what the plate follows now: the goal after slew
    float integral_a;
    float current_a;   // applied, positive heats
    float slope_c_s;   // of the target, a short mean
    float held_a;      // what flowed before a test pulse began
    float owed;        // counts that rounding kept back, given in a later step
    int16_t counts;
    int8_t saturated;  // 1 at the heating limit, -1 at the cooling limit, 0 between
    uint8_t limited;   // Limit bits of this step
};

void start_loop(Loop& loop, float plate_c);
void stop_loop(Loop& loop);

// What the target may become for a setpoint, given the sink and whether the session's heat is spent.
float limited_setpoint(Loop& loop, float setpoint_c, float sink_c, bool heat_is_spent);

// What a step goes by: temperatures in degC, the most that may cool and what a test pulse adds in A.
struct Course {
    float goal_c, plate_c, sink_c, cool_ceiling_a, pulse_a;
};

// One step towards the goal. Leaves the output in loop.counts.
void follow(Loop& loop, const Course& course);

// Whether a test pulse fits between the limits of the current.
bool has_room(const Loop& loop, float sink_c, float cool_ceiling_a);

}  // namespace plate
