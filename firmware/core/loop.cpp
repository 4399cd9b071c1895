#include "loop.h"

#include <math.h>

#include "limits.h"
#include "protocol.h"

namespace plate {
namespace {

// In A/K and A/(K s): the phase margin is at least 45 degrees with faces from 0.6 J/K up, beads that lag by 0 to 1 s,
// and with and without a palm. Most of a touch comes from the feed-forward, so low gains cost little.
const float GAIN_P = 1.0f, GAIN_I = 1.2f;
const float UNTOLD_GAIN_P = 0.5f, UNTOLD_GAIN_I = 0.2f;  // 35 degrees with USUAL_LAG_MS and any lag up to MAX_LAG_MS

// A for each degC/s, as a light face of 0.6 J/K needs, since an ampere moves 3.86 W: more would drive it past its goal.
const float FORWARD_A_S_K = 0.16f;
// Only a real fall: a host that moves its setpoint in small steps must not make the current jump with each of them. A
// host at the fastest slew sends 0.48 degC every 40 ms, so a fall lasts until the setpoint stays close for that long.
const float FALL_C = 0.25f;
const uint8_t FALL_STEPS = 3;
const float HELD_SHARE = 0.1f;  // of a step: the mean of the last 0.2 s, without the readings' noise

float clamp(float value, float low, float high) {
    return fminf(fmaxf(value, low), high);
}

// Returns the position of the sink between the warm limit and the trip, 0 to 1.
float sink_share(float sink_c) {
    return clamp((sink_c - SINK_WARM_C) / (SINK_TRIP_C - SINK_WARM_C), 0.0f, 1.0f);
}

// A target that the current cannot reach waits for the plate instead of moving ahead of it.
bool must_wait(const Loop& loop, float goal_c, float plate_c) {
    const int8_t side = loop.saturated;
    return side * (goal_c - loop.target_c) > 0.0f && side * (loop.target_c - plate_c) > LEAD_C;
}

// Moves the target by one step. Returns the current that cooling the face itself at this rate requires, also while
// the target waits. Without this feed-forward the loop would first have to lag, by a tenth of a second per cooling.
float slew(Loop& loop, float goal_c, float plate_c) {
    const float away_c = goal_c - loop.target_c, step_c = clamp(away_c, -SLEW_COOL_C_STEP, SLEW_HEAT_C_STEP);
    if (away_c < -FALL_C) loop.falling = FALL_STEPS;
    else if (loop.falling) loop.falling--;
    const float forward_a = loop.falling ? fminf(step_c, 0.0f) / STEP_S * FORWARD_A_S_K : 0.0f;
    if (must_wait(loop, goal_c, plate_c)) {
        loop.limited |= LIMIT_CURRENT;
        return forward_a;
    }
    if (step_c != away_c) loop.limited |= LIMIT_SLEW;
    loop.target_c = step_c == away_c ? goal_c : loop.target_c + step_c;
    return forward_a;
}

// Stops the integral while the output is saturated and more of it would have no effect.
float wanted_current(Loop& loop, const Course& course, float forward_a, float most_cool_a) {
    const float error_c = loop.target_c - course.plate_c;
    const float wanted_a = (course.is_told ? GAIN_P : UNTOLD_GAIN_P) * error_c + loop.integral_a + forward_a;
    const float given_a = clamp(wanted_a, -most_cool_a, HEAT_LIMIT_A);
    loop.saturated = given_a < wanted_a ? 1 : (given_a > wanted_a ? -1 : 0);
    if (loop.saturated) loop.limited |= LIMIT_CURRENT;
    if (!loop.saturated || (error_c > 0.0f) != (wanted_a > 0.0f))
        loop.integral_a += (course.is_told ? GAIN_I : UNTOLD_GAIN_I) * error_c * STEP_S;
    return given_a;
}

// Rounds to whole counts and carries the remainder over to the next step, so that the mean is finer than a count.
int16_t dithered(Loop& loop, float current_a) {
    const float exact = current_a * COUNTS_PER_A + loop.owed;
    const float whole = clamp(floorf(exact + 0.5f), -COOL_CAP_COUNTS, HEAT_CAP_COUNTS);
    loop.owed = clamp(exact - whole, -1.0f, 1.0f);
    return (int16_t)whole;
}

float ceiling_of(float sink_c, float cool_ceiling_a) {
    return fminf(cool_ceiling_a, COOL_LIMIT_A * (1.0f - sink_share(sink_c)));
}

// Suspends the loop during a test pulse, because it would work against the pulse.
float pulsed_current(Loop& loop, const Course& course, float forward_a, float ceiling_a) {
    if (course.pulse_a != 0.0f) return clamp(loop.held_a + course.pulse_a, -ceiling_a, HEAT_LIMIT_A);
    const float wanted_a = wanted_current(loop, course, forward_a, ceiling_a);
    loop.held_a += HELD_SHARE * (wanted_a - loop.held_a);
    return wanted_a;
}

}  // namespace

void start_loop(Loop& loop, float plate_c) {
    loop = Loop();
    loop.goal_c = loop.target_c = clamp(plate_c, SETPOINT_LOW_C, SETPOINT_HIGH_C);
}

void stop_loop(Loop& loop) {
    loop = Loop();
}

float limited_setpoint(Loop& loop, float setpoint_c, float sink_c, bool heat_is_spent) {
    if (heat_is_spent && setpoint_c > NEUTRAL_C) {
        loop.limited |= LIMIT_DOSE;
        setpoint_c = NEUTRAL_C;
    }
    const float coldest_c = SETPOINT_LOW_C + (NEUTRAL_C - SETPOINT_LOW_C) * sink_share(sink_c);
    if (setpoint_c >= coldest_c) return setpoint_c;
    loop.limited |= LIMIT_SINK;
    return coldest_c;
}

bool has_room(const Loop& loop, float sink_c, float cool_ceiling_a) {
    return loop.current_a + PULSE_A <= HEAT_LIMIT_A && loop.current_a - PULSE_A >= -ceiling_of(sink_c, cool_ceiling_a);
}

void follow(Loop& loop, const Course& course) {
    loop.goal_c = course.goal_c;
    const float forward_a = slew(loop, course.goal_c, course.plate_c);
    const float ceiling_a = ceiling_of(course.sink_c, course.cool_ceiling_a);
    const float wanted_a = pulsed_current(loop, course, forward_a, ceiling_a);
    loop.counts = dithered(loop, wanted_a);
    if ((loop.limited & LIMIT_CURRENT) && wanted_a < 0.0f && ceiling_a < COOL_LIMIT_A)
        loop.limited |= LIMIT_SINK;
    loop.current_a = loop.counts / COUNTS_PER_A;
}

}  // namespace plate
