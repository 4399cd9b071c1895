#include "plausibility.h"

#include <math.h>

#include "protocol.h"

namespace plate {
namespace {

const float KELVIN = 273.15f;
const float HARD = 0.6f;  // of the limit: driven hard

// 1 or -1 when this much heat must move the plate that way, else 0.
int8_t push_of(float current_a, float plate_c, float sink_c) {
    const float power_w = plate_power_w(current_a, plate_c, sink_c);
    if (current_a >= HARD * HEAT_LIMIT_A && power_w >= PUSH_HEAT_W) return 1;
    if (current_a <= -HARD * COOL_LIMIT_A && power_w <= -PUSH_COOL_W) return -1;
    return 0;
}

uint32_t judge_window(const Plausibility& state, const Sensors& sensors) {
    if (state.pushed < WINDOW || sensors.past_known <= WINDOW) return 0;
    const float along_c = state.pushing * plate_change_c(sensors, WINDOW, 0);
    const float late_c = state.pushing * plate_change_c(sensors, WINDOW / 2, 0);
    if (along_c <= -BACKWARDS_C && late_c <= -BACKWARDS_LATE_C) return bit(WIRED_BACKWARDS);
    return fabsf(along_c) < RUNAWAY_C ? bit(RUNAWAY) : 0;
}

uint32_t judge_progress(Plausibility& state, const Sensors& sensors, bool grown, int8_t push) {
    if (push != state.pushing) state.pushed = 0;
    state.pushing = push;
    if (!grown || push == 0) return 0;
    if (state.pushed < WINDOW) state.pushed++;
    return judge_window(state, sensors);
}

void begin_second(Plausibility& state, float plate, float current_a) {
    state.second_ms = 0;
    state.second_from_c = plate;
    state.second_from_a = current_a;
}

uint32_t strike(Plausibility& state, float current_a) {
    state.warming_seconds = 0;
    state.cool_ceiling_a = REVERSED_BACK_OFF * -current_a;
    return ++state.strikes >= REVERSED_STRIKES ? bit(COOLING_REVERSED) : 0;
}

// More cooling current and a warmer plate, second after second: back off, in the end give up.
uint32_t judge_sign(Plausibility& state, float plate, float current_a, float error_c) {
    state.second_ms += STEP_MS;
    if (state.second_ms < REVERSED_MS) return 0;
    const bool as_hard = current_a <= -REVERSED_FROM_A && current_a <= state.second_from_a + 0.02f;
    const bool warmed = plate - state.second_from_c >= REVERSED_RISE_C;
    begin_second(state, plate, current_a);
    if (!as_hard || !warmed || error_c > 0.0f)
        state.warming_seconds = 0;
    else if (++state.warming_seconds >= REVERSED_SECONDS)
        return strike(state, current_a);
    return 0;
}

// A sensor that does not see the sink lets it grow hot unseen.
uint32_t judge_sink(Plausibility& state, float power_w, float sink) {
    const float surplus_w = power_w - state.sink_usual_w;
    state.sink_usual_w += surplus_w * (STEP_S / SINK_MEMORY_S);
    state.sink_surplus_j += surplus_w * STEP_S;
    if (fabsf(sink - state.sink_from_c) >= SINK_MOVED_C) {
        state.sink_from_c = sink;
        state.sink_surplus_j = 0.0f;
    }
    if (fabsf(state.sink_surplus_j) < SINK_BLIND_J) return 0;
    state.sink_surplus_j = 0.0f;
    return bit(SINK_IMPLAUSIBLE);
}

}  // namespace

float plate_power_w(float current_a, float plate_c, float sink_c) {
    return current_a * (SEEBECK_V_K * (plate_c + KELVIN) + 0.5f * current_a * RESISTANCE_OHM) +
           CONDUCTANCE_W_K * (sink_c - plate_c);
}

float sink_power_w(float current_a, float plate_c, float sink_c) {
    return current_a * (0.5f * current_a * RESISTANCE_OHM - SEEBECK_V_K * (sink_c + KELVIN)) +
           CONDUCTANCE_W_K * (plate_c - sink_c);
}

void start_judging(Plausibility& state) {
    state = Plausibility();
    state.cool_ceiling_a = COOL_LIMIT_A;
}

uint32_t judge(Plausibility& state, const Sensors& sensors, bool grown, float current_a, float error_c) {
    if (!plate_is_known(sensors) || !sensors.now[SINK].known) return 0;
    const float plate = plate_c(sensors), sink = sensors.now[SINK].c;
    return judge_progress(state, sensors, grown, push_of(current_a, plate, sink)) |
           judge_sign(state, plate, current_a, error_c) |
           judge_sink(state, sink_power_w(current_a, plate, sink), sink);
}

}  // namespace plate
