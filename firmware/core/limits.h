// Every limit of the plate, with its unit and source.
// Limits in #ifndef may be set at build time: the driver's scale and the board's number for another board, and
// three limits for experiments on their effect. The others must not be changed.
// -DONE_RESISTOR is for the plate of one resistor, see ../ONE_RESISTOR.md.
#pragma once
#include <stdint.h>

#ifdef ONE_RESISTOR
#define FULL_SCALE_MA 720  // 5 V behind 7 ohm
#endif
#ifndef FULL_SCALE_MA
#define FULL_SCALE_MA 3000  // module current at full duty
#endif
#ifndef HEAT_LIMIT_MA  // what the resistors let pass
#define HEAT_LIMIT_MA (FULL_SCALE_MA < 1800 ? FULL_SCALE_MA : 1800)
#endif
#ifndef COOL_LIMIT_MA
#define COOL_LIMIT_MA FULL_SCALE_MA  // what the resistors let pass; the driver's full scale
#endif
#ifndef RUNAWAY_WINDOW_MS
#define RUNAWAY_WINDOW_MS 1000  // with 4 s, as in 3D printers, a plate reaches 61 degC
#endif
#ifndef BOARD_ID
#define BOARD_ID 0
#endif

namespace plate {

const uint16_t STEP_MS = 20;
const float STEP_S = STEP_MS * 0.001f;
const uint8_t TELEMETRY_HZ = 20;
const uint8_t BLINK_MS = 100;  // on, then off

// Setpoints
const float NEUTRAL_C = 32.0f;
const int32_t SETPOINT_LOW_MC = 18000, SETPOINT_HIGH_MC = 40000;
const float SETPOINT_LOW_C = 18.0f, SETPOINT_HIGH_C = 40.0f;
// People distinguish materials by the initial rate of change of the skin; the current is what limits it.
const uint16_t SLEW_COOL_MC_S = 12000, SLEW_HEAT_MC_S = 12000;
const float SLEW_COOL_C_STEP = SLEW_COOL_MC_S * 0.001f * STEP_S, SLEW_HEAT_C_STEP = SLEW_HEAT_MC_S * 0.001f * STEP_S;
const uint16_t MAX_TTL_MS = 1000;
const uint16_t LONGEST_RETURN_MS = 10000;
const float LEAD_C = 0.4f;  // largest lead of the target over a plate at its current limit
const float ARRIVED_C = 0.3f;

// Output: current = counts / FULL_SCALE_COUNTS * FULL_SCALE_MA, by a filtered or current-controlled driver
const int16_t FULL_SCALE_COUNTS = 512;
const float COUNTS_PER_A = FULL_SCALE_COUNTS * 1000.0f / FULL_SCALE_MA;
const int16_t HEAT_CAP_COUNTS = (int32_t)HEAT_LIMIT_MA * FULL_SCALE_COUNTS / FULL_SCALE_MA;
const int16_t COOL_CAP_COUNTS = (int32_t)COOL_LIMIT_MA * FULL_SCALE_COUNTS / FULL_SCALE_MA;
const float HEAT_LIMIT_A = HEAT_LIMIT_MA * 0.001f, COOL_LIMIT_A = COOL_LIMIT_MA * 0.001f;

// Temperatures at which the bridge opens
const float TRIP_HIGH_C = 43.0f;
const float TRIP_LOW_C = 13.0f;
// Mean estimates of the face that trip while the cut-out is closed: between the setpoints and the skin's limits, so that
// the relay opens a shorted bridge before the skin reaches 43 or 15 degC, the hot one also behind beads of a wrong type.
const float FACE_TRIP_HIGH_C = 41.0f, FACE_TRIP_LOW_C = 16.5f;
const uint8_t FACE_TRIP_MS = 60;
// The cut-out's bead trips there as well while both of the plate stand still: a bridge may be shorted behind frozen ones.
const float CUT_OUT_LEAD_S = 0.2f;
// With the bridge open a sink heats the plate through the module. From 44 degC, with its fan dead in a room of 35, a
// sink of 500 J/K warms the skin to 41.7 with 1.2 CEM43 in 15 min; from 46 it would be 43.2 with 7.6.
const float SINK_TRIP_C = 44.0f;
const float SINK_WARM_C = 38.0f;  // from here to the trip the cooling limit falls to zero; our choice

// Thermistors: 10 kohm, beta 3950, to ground; 10 kohm to AVCC. A reading is a sum of 16 conversions of 10 bits.
const float NTC_BETA_K = 3950.0f;
const float CUT_OUT_BETA_K = 4267.0f;  // the cut-out's is 100 kohm, with 100 kohm to AVCC
const float READING_FULL_SCALE = 16384.0f;
const float SHORT_BELOW = 0.05f;  // of full scale: less than 530 ohm, more than 108 degC
const float OPEN_ABOVE = 0.95f;   // more than 190 kohm, less than -29 degC

// Lag of the plate's beads behind the face; see sensors.h
const uint16_t MAX_LAG_MS = 1000;
const uint16_t USUAL_LAG_MS = 100;  // until the board was told its own; the loop is slower then, see loop.cpp
const float FACE_FILTER_S = 0.06f;
const float MOST_AHEAD_C = 10.0f;  // a plate moves by less than 10 degC/s; our choice

// Sensor checks
const float DISAGREE_C = 1.5f;  // between plate thermistors; a beta of 3435 for 3950 shows from 37 degC
const uint16_t DISAGREE_MS = 300;
const float FROZEN_C = 0.15f;         // moved less than this in the window ...
const float FROZEN_OTHER_C = 1.0f;    // ... while the other one moved more than this
const float JUMP_STEP_C = 2.5f;       // in one step; a palm at 35 degC on a plate at 18 gives 0.7
const float JUMP_SINK_STEP_C = 1.5f;  // a sink of 10 J/K with 15 W moves 0.03
const uint8_t PLAUSIBLE_AGAIN_STEPS = 50;  // 1 s after the last plausible reading the other thermistor decides
const uint8_t FOLLOWS_MS = 100;  // faults that begin within this time of a bad wire or a jump follow from it

const uint8_t STRANGE_MS = 60;    // of the cut-out's bead, away from both of the plate
const float STRAY_C = 0.5f;  // a plate bead further than this from the cut-out's than the other strays alone

// The cut-out
const uint16_t CUT_OUT_MS = 100;    // until an open cut-out counts; a relay bounces for less than 10
const uint16_t WITHHELD_MS = 200;   // after each cause of a fault and each reset; a relay lets go within 20 ms
const uint8_t PULLED_IN_MS = 60;    // from the start button to the proof that the relay lets go
const uint16_t PROOF_LASTS_MS = 1000;  // until the button must have closed the proved relay again

// Repeated clearing of the same fault would disable a guard, so the third time needs a minute without clearing.
const uint16_t CLEARED_MS = 60000;

// Test pulse for thermistors that froze at the same value; see pulse.h
const uint16_t PULSE_EVERY_MS = 10000;
const float PULSE_A = 0.1f;
const uint8_t PULSE_HALF = 4;           // ticks of PROGRESS_MS up, then down
const float PULSE_ANSWER_C = 0.04f;     // a working bead moves by 0.13, noise is 0.006
const float PULSE_ANSWER_LATE_C = 0.01f;  // of a bead that lags: 0.02 to 0.14, by lag and face
const float PULSE_LATE_PER_S = 5.0f, PULSE_LATEST = 3.0f;  // ticks by which the answer is later, for each s of lag
const uint8_t PULSES_UNANSWERED = 3;    // an arriving hand may hide one or two
const uint16_t PULSE_AGAIN_MS = 1000;   // after an unanswered one: a touch has settled by then
const float ALIVE_C = 0.5f;             // in a window: a bead that moves this fast is working
const uint8_t PULSES_BROKEN_OFF = 5;

// Thermal dose and heat of a session
const float DOSE_LIMIT_CEM43 = 2.0f;
const float HEAT_LIMIT_S = 900.0f;
const float REST_S = 900.0f;       // time without heat after which a new session begins; our choice
const float HEAT_ABOVE_C = 32.2f;  // a target above this is heat

// Parameters of the module (31 couples, 8 A, 3.8 V) for the guards
const float SEEBECK_V_K = 0.01267f;
const float RESISTANCE_OHM = 0.367f;
const float CONDUCTANCE_W_K = 0.173f;

// Runaway: this much heat into or out of the plate must move its reading. The thresholds allow for a
// module that pumps 20 % less than its type, the energies for a cold hand that has just arrived.
const uint16_t PROGRESS_MS = 100;
const uint8_t WINDOW = RUNAWAY_WINDOW_MS / PROGRESS_MS;
const float PUSH_HEAT_W = 1.0f, PUSH_COOL_W = 2.5f;  // smaller powers are not judged
const float STILL_HEAT_W = 1.7f;                     // threshold for a plate that does not move
const float STILL_C = 0.05f;                         // in a window: twice the noise of a working board
const float HELD_C = 0.3f;                           // this close to its goal, below full drive, a plate may stand still
const float ALONG_C = 0.2f;                          // in a window: the plate follows
const float FOLLOWED_C = 0.4f;                       // in a window: its wires are the right way round
const float STALLED_HEAT_J = 7.0f, STALLED_COOL_J = 15.0f;  // energy spent on a plate that does not follow
const uint16_t FORGET_MS = 5000;  // with the bridge open, a touch is over by then; our choice
const float AWAY_C = 0.8f;                           // in a window: more than the drift of a plate without current
const float EASED = 0.98f;                           // ratio of a current that falls as a touch settles
// Movement in the wrong direction in a window, and in its second half, when a touch has settled.
const float BACKWARDS_HEAT_C = 2.0f, BACKWARDS_HEAT_LATE_C = 0.8f;
const float BACKWARDS_COOL_C = 4.0f, BACKWARDS_COOL_LATE_C = 1.5f;

// Reversed cooling: the plate warms in successive seconds while it is cooled at least as hard as before
const uint16_t REVERSED_MS = 1000;
const uint8_t REVERSED_SECONDS = 4;
const float REVERSED_RISE_C = 0.08f;
const float REVERSED_FROM_A = 0.5f;
const float REVERSED_BACK_OFF = 0.75f;
const uint8_t REVERSED_STRIKES = 3;

// A sink sensor that does not move while the sink takes this much more heat than before does not read the sink
const float SINK_BLIND_J = 100.0f;  // a sink of 500 J/K would have moved by SINK_MOVED_C
const float SINK_MOVED_C = 0.2f;
const float SINK_MEMORY_S = 120.0f;

}  // namespace plate
