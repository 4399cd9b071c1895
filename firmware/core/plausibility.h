// Does the plate do what its current should make it do? Faults that need current and readings together.
//
// Heat into the plate, from current I, plate and sink in kelvin:  P = S I Tp + I^2 R / 2 + K (Ts - Tp).
// The figures are of one kind of module, so only large contradictions count: a whole window of heat that
// leaves no trace, or a plate that goes the other way. A hand takes heat too, but never keeps a plate
// still: when it arrives the plate jumps, and afterwards it takes less every second.
#pragma once
#include <stdint.h>

#include "sensors.h"

namespace plate {

struct Plausibility {
    float driven_a;          // currents of the driven steps since the past of the readings grew, summed
    uint8_t driven_steps;
    int8_t pushing;          // 1 heating, -1 cooling hard enough to judge, 0 neither
    uint8_t pushed;          // for how many PROGRESS_MS
    float stalled_j;         // spent since the plate last followed
    int8_t bursting;         // the push of the short bursts that no window judges
    float burst_j;           // spent in them since the plate last followed
    float burst_from_c;
    bool is_broken;          // the bridge opened between them
    uint16_t open_ms;        // since the bridge opened
    float past_a[WINDOW + 1];  // current, one per PROGRESS_MS, newest first
    uint16_t second_ms;      // of the second that is watched for a turned sign
    float second_from_c;
    float second_from_a;
    uint8_t warming_seconds;
    uint8_t strikes;
    float cool_ceiling_a;    // what is left of the cooling current
    float sink_usual_w;      // heat into the sink, slow mean
    float sink_surplus_j;    // beyond the usual, since the sink last moved
    float sink_from_c;
};

void start_judging(Plausibility& state);

// One step with the bridge open. What was seen is kept for FORGET_MS, so that a host which switches off
// and on again and again is judged too; only the windows, which need an unbroken drive, begin anew.
void pause_judging(Plausibility& state);

// Judges one step. `grown` says that the past of the readings grew by one; `current_a` flowed since the
// last step, positive heating; `error_c` is goal minus plate. Returns bits of faults.
uint32_t judge(Plausibility& state, const Sensors& sensors, bool grown, float current_a, float error_c);

float plate_power_w(float current_a, float plate_c, float sink_c);
float sink_power_w(float current_a, float plate_c, float sink_c);

}  // namespace plate
