#include "plausibility.h"

#include <math.h>

#include "protocol.h"

namespace plate {
namespace {

const float KELVIN = 273.15f;
// Currents that count as hard driving: 0.6 of the limits of a small plate, less for a smaller one.
const float HARD_HEAT_A = HEAT_LIMIT_MA < 750 ? 0.6f * HEAT_LIMIT_A : 0.45f;
const float HARD_COOL_A = COOL_LIMIT_MA < 2000 ? 0.6f * COOL_LIMIT_A : 1.2f;

struct Drive {
    float current_a, error_c, power_w;  // means of PROGRESS_MS
    int8_t push;                        // direction in which they must move the plate
};

// Returns 1 or -1 when this power must warm or cool the plate, else 0.
int8_t push_of(float current_a, float power_w) {
    if (current_a >= HARD_HEAT_A && power_w >= PUSH_HEAT_W) return 1;
    if (current_a <= -HARD_COOL_A && power_w <= -PUSH_COOL_W) return -1;
    return 0;
}

bool runs_backwards(const Plausibility& state, float along_c, float late_c) {
    if (state.pushing > 0) return along_c <= -BACKWARDS_HEAT_C && late_c <= -BACKWARDS_HEAT_LATE_C;
    return along_c <= -BACKWARDS_COOL_C && late_c <= -BACKWARDS_COOL_LATE_C;
}

// A loop that holds the plate against a touch reduces its current every second; a loop without effect does not.
bool eases(const Plausibility& state) {
    return fabsf(state.past_a[0]) < EASED * fabsf(state.past_a[WINDOW]);
}

bool is_held(float current_a, float error_c) {
    const float limit_a = current_a > 0.0f ? HEAT_LIMIT_A : COOL_LIMIT_A;
    return fabsf(error_c) < HELD_C && fabsf(current_a) < 0.97f * limit_a;
}

bool stands_still(const Plausibility& state, const Sensors& sensors, const Drive& drive) {
    return !is_held(drive.current_a, drive.error_c) && !eases(state) &&
           drive.power_w * state.pushing >= STILL_HEAT_W && plate_span_c(sensors) < STILL_C;
}

// A plate that moves, but not in the driven direction, may have been touched: a fault needs a certain energy.
bool has_stalled(Plausibility& state, float along_c, float power_w) {
    if (along_c >= ALONG_C || eases(state)) {
        state.stalled_j = 0.0f;
        return false;
    }
    const float weight = along_c <= -AWAY_C ? 2.0f : 1.0f;
    state.stalled_j += weight * power_w * state.pushing * (PROGRESS_MS * 0.001f);
    return state.stalled_j >= (state.pushing > 0 ? STALLED_HEAT_J : STALLED_COOL_J);
}

// A plate that followed is wired correctly: when it then seems to move backwards, its thermistors came off.
uint32_t backwards_fault(const Plausibility& state) {
    return bit(state.followed ? RUNAWAY : WIRED_BACKWARDS);
}

uint32_t judge_window(Plausibility& state, const Sensors& sensors, const Drive& drive) {
    const float along_c = state.pushing * plate_change_c(sensors, WINDOW, 0);
    const float late_c = state.pushing * plate_change_c(sensors, WINDOW / 2, 0);
    if (along_c >= FOLLOWED_C) state.followed = true;
    if (runs_backwards(state, along_c, late_c)) return backwards_fault(state);
    if (stands_still(state, sensors, drive)) return bit(RUNAWAY);
    if (!has_stalled(state, along_c, drive.power_w)) return 0;
    return along_c <= -AWAY_C ? backwards_fault(state) : bit(RUNAWAY);
}

void remember_current(Plausibility& state, float current_a) {
    for (uint8_t i = WINDOW; i > 0; i--) state.past_a[i] = state.past_a[i - 1];
    state.past_a[0] = current_a;
}

uint32_t judge_progress(Plausibility& state, const Sensors& sensors, const Drive& drive) {
    const int8_t push = drive.push;
    if (push != state.pushing) {
        state.pushed = 0;
        state.stalled_j = 0.0f;
    }
    state.pushing = push;
    remember_current(state, drive.current_a);
    if (push == 0) return 0;
    if (state.pushed <= WINDOW) state.pushed++;
    const bool is_full = state.pushed > WINDOW && sensors.past_known > WINDOW;
    return is_full ? judge_window(state, sensors, drive) : 0;
}

// Judges bursts too short for a window: once interrupted, their energy adds up until the plate follows.
uint32_t judge_burst(Plausibility& state, float plate, const Drive& drive) {
    const int8_t push = drive.push;
    if (state.pushed > WINDOW) state.burst_j = 0.0f;
    if (state.burst_j == 0.0f) state.is_broken = false;
    if (push == 0 || state.pushed > WINDOW || is_held(drive.current_a, drive.error_c)) return 0;
    const float along_c = push * (plate - state.burst_from_c);
    if (push != state.bursting || along_c >= ALONG_C) state.burst_j = 0.0f;
    if (state.burst_j == 0.0f || along_c < 0.0f) state.burst_from_c = plate;
    state.bursting = push;
    state.burst_j += drive.power_w * push * (state.driven_steps * STEP_S);
    const bool is_spent = state.burst_j >= (push > 0 ? STALLED_HEAT_J : STALLED_COOL_J);
    return is_spent && state.is_broken ? bit(RUNAWAY) : 0;
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

// More cooling current and a warmer plate in successive seconds: reduce the current, finally raise a fault.
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

// Detects a sensor that came off the sink, which could then overheat unnoticed.
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

void pause_judging(Plausibility& state) {
    state.pushing = 0;
    state.pushed = 0;
    state.is_broken = true;
    state.warming_seconds = 0;
    state.second_ms = 0;
    state.open_ms += STEP_MS;
    if (state.open_ms >= FORGET_MS) start_judging(state);
}

namespace {

// Both the mean current of PROGRESS_MS, since the readings are means too, and the newest current must push. A
// ripple that the loop follows, such as mains hum, would look like a different current if it were only sampled.
Drive drive_of(const Plausibility& state, float plate, float sink, float current_a, float error_c) {
    const float mean_a = state.driven_a / state.driven_steps, mean_w = plate_power_w(mean_a, plate, sink);
    const int8_t push = push_of(mean_a, mean_w);
    const bool still = push_of(current_a, plate_power_w(current_a, plate, sink)) == push;
    return {mean_a, error_c, mean_w, still ? push : (int8_t)0};
}

uint32_t judge_growth(Plausibility& state, const Sensors& sensors, float current_a, float error_c) {
    const float plate = plate_c(sensors);
    const Drive drive = drive_of(state, plate, sensors.now[SINK].c, current_a, error_c);
    const uint32_t faults = judge_progress(state, sensors, drive) | judge_burst(state, plate, drive);
    state.driven_a = 0.0f;
    state.driven_steps = 0;
    return faults;
}

}  // namespace

uint32_t judge(Plausibility& state, const Sensors& sensors, bool grown, float current_a, float error_c) {
    if (!plate_is_known(sensors) || !sensors.now[SINK].known) return 0;
    const float plate = plate_c(sensors), sink = sensors.now[SINK].c;
    state.open_ms = 0;
    state.driven_a += current_a;
    state.driven_steps++;
    return (grown ? judge_growth(state, sensors, current_a, error_c) : 0) |
           judge_sign(state, plate, current_a, error_c) |
           judge_sink(state, sink_power_w(current_a, plate, sink), sink);
}

}  // namespace plate
