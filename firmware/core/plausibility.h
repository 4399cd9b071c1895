// Compares the plate's behaviour with its current, and raises the faults that need current and readings together.
//
// Heat into the plate, from current I, plate and sink in kelvin:  P = S I Tp + I^2 R / 2 + K (Ts - Tp).
// The parameters are those of one type of module, so only large contradictions count: a whole window of heat
// without effect, or a plate that moves in the wrong direction. A hand takes heat too, but never holds a plate
// still: its arrival moves the plate quickly, and afterwards it takes less heat every second.
#pragma once
#include <stdint.h>

#include "sensors.h"

namespace plate {

struct Plausibility {
    float driven_a;          // sum of the currents in driven steps since the history last grew
    uint8_t driven_steps;
    int8_t pushing;          // 1 heating, -1 cooling hard enough to judge, 0 neither
    uint8_t pushed;          // duration of the push in PROGRESS_MS
    float stalled_j;         // energy spent since the plate last followed
    int8_t bursting;         // direction of the bursts that are too short for a window
    float burst_j;           // energy spent in bursts since the plate last followed
    float burst_from_c;
    bool followed;           // the plate once moved as it was driven, so its wires are the right way round
    bool is_broken;          // the bridge opened between bursts
    uint16_t open_ms;        // since the bridge opened
    float past_a[WINDOW + 1];  // current, one per PROGRESS_MS, newest first
    uint16_t second_ms;      // position in the second that is watched for reversed cooling
    float second_from_c;
    float second_from_a;
    uint8_t warming_seconds;
    uint8_t strikes;
    float cool_ceiling_a;    // remaining limit of the cooling current
    float sink_usual_w;      // heat into the sink, slow mean
    float sink_surplus_j;    // heat beyond the usual since the sink's reading last moved
    float sink_from_c;
};

void start_judging(Plausibility& state);

// Judges one step with the bridge open. The state lasts for FORGET_MS, so that a host that switches off and on
// repeatedly is judged too; only the windows, which need uninterrupted driving, restart.
void pause_judging(Plausibility& state);

// Judges one step. `grown`: a mean was added to the history of readings; `current_a` flowed since the
// last step, positive when heating; `error_c` is goal minus plate. Returns fault bits.
uint32_t judge(Plausibility& state, const Sensors& sensors, bool grown, float current_a, float error_c);

float plate_power_w(float current_a, float plate_c, float sink_c);
float sink_power_w(float current_a, float plate_c, float sink_c);

}  // namespace plate
