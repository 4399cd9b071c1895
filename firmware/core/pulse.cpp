#include "pulse.h"

#include <math.h>

#include "limits.h"
#include "protocol.h"

namespace plate {
namespace {

// A pulse waits until the plate has reached its goal, but only for a limited time: a host could keep it away.
bool may_begin(const Pulse& pulse, const Sensors& sensors, float goal_c) {
    const bool arrived = fabsf(goal_c - plate_c(sensors)) < HELD_C;
    return pulse.quiet_ms >= (arrived ? PULSE_EVERY_MS : 2 * PULSE_EVERY_MS);
}

void remember(float* readings_c, const Sensors& sensors) {
    for (uint8_t which = 0; which < 2; which++) readings_c[which] = sensors.past_c[which][0];
}

// Both beads moved fast, as in a touch, so no pulse is needed. Drift is slower.
bool are_alive(const Sensors& sensors) {
    if (sensors.past_known <= WINDOW) return false;
    for (uint8_t which = 0; which < 2; which++)
        if (fabsf(sensors.past_c[which][0] - sensors.past_c[which][WINDOW]) < ALIVE_C) return false;
    return true;
}

// Returns by how many ticks the answer of a bead comes later than that of the face.
uint8_t late_ticks(const Sensors& sensors) {
    return (uint8_t)fminf(sensors.lag_s * PULSE_LATE_PER_S + 0.75f, PULSE_LATEST);
}

uint32_t judge_answer(Pulse& pulse, const Sensors& sensors) {
    const float answer_c = sensors.lag_s > 0.0f ? PULSE_ANSWER_LATE_C : PULSE_ANSWER_C;
    bool answered = true;
    for (uint8_t which = 0; which < 2; which++) {
        const float ends_c = 0.5f * (pulse.from_c[which] + sensors.past_c[which][0]);
        if (pulse.middle_c[which] - ends_c < answer_c) answered = false;
    }
    pulse.ticks = 0;
    if (answered) {
        pulse = Pulse();
        return 0;
    }
    pulse.quiet_ms = PULSE_EVERY_MS - PULSE_AGAIN_MS;
    return ++pulse.unanswered >= PULSES_UNANSWERED ? bit(PLATE_FROZEN) : 0;
}

// A new goal cancels a pulse, so that a touch is not delayed, unless this has happened too often.
bool breaks_off(Pulse& pulse, float goal_c) {
    if (fabsf(goal_c - pulse.goal_c) < HELD_C || pulse.broken_off >= PULSES_BROKEN_OFF) return false;
    pulse.ticks = 0;
    pulse.broken_off++;
    return true;
}

uint32_t tick(Pulse& pulse, const Sensors& sensors) {
    pulse.ticks++;
    const uint8_t half = PULSE_HALF + late_ticks(sensors);
    if (pulse.ticks == 1 + half) remember(pulse.middle_c, sensors);
    return pulse.ticks > 2 * half ? judge_answer(pulse, sensors) : 0;
}

}  // namespace

uint32_t watch_beads(Pulse& pulse, const Sensors& sensors, bool grown, bool has_room, float goal_c) {
    if (pulse.quiet_ms < 2 * PULSE_EVERY_MS) pulse.quiet_ms += STEP_MS;
    if (!grown) return 0;
    if (are_alive(sensors)) {
        pulse = Pulse();
        return 0;
    }
    if (pulse.ticks) return breaks_off(pulse, goal_c) ? 0 : tick(pulse, sensors);
    if (!has_room || !may_begin(pulse, sensors, goal_c)) return 0;
    pulse.ticks = 1;
    pulse.goal_c = goal_c;
    remember(pulse.from_c, sensors);
    return 0;
}

float pulse_a(const Pulse& pulse) {
    if (!pulse.ticks) return 0.0f;
    if (pulse.ticks > 2 * PULSE_HALF) return 0.0f;
    return pulse.ticks <= PULSE_HALF ? PULSE_A : -PULSE_A;
}

}  // namespace plate
