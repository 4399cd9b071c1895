// Reads the thermistors and raises the faults that their readings alone reveal.
//
// A bead under glue follows its face like a low-pass filter of first order: lag dT/dt = face - T. The lag is a
// parameter of the board, and T + lag dT/dt is an estimate of the face. Differentiation amplifies the noise of the
// converter, so the slope is a mean over FACE_FILTER_S, and the estimate leads by that time too. The loop follows the
// estimate. Trips and dose judge reading and estimate, whichever is worse. Frozen, disagreeing and runaway readings are
// judged as read: a frozen bead has no slope, and noise must not look like movement.
#pragma once
#include <stdint.h>

#include "limits.h"
#include "thermistor.h"

namespace plate {

enum Place : uint8_t { PLATE_A = 0, PLATE_B = 1, SINK = 2, CUT_OUT = 3, PLACES = 4 };

struct Sensors {
    Reading now[PLACES];
    Reading before[PLACES];            // one step earlier
    float lag_s;                       // of the plate's beads, 0 to MAX_LAG_MS
    float slope_c_s[PLACES];           // filtered; not of the sink
    float past_c[2][WINDOW + 1];       // plate readings, one per PROGRESS_MS, newest first
    uint8_t past_known;                // number of consecutive valid ones
    float summed_c[2];                 // sums of plate readings since the newest one
    uint16_t progress_ms;              // time since the newest one
    bool agree;                        // both plate readings are known and close
    uint16_t disagree_ms;
    float low_c, high_c;               // between these the cut-out's bead must read, see sensors.cpp
    uint16_t strange_ms;               // that it has not
    float plausible_c[2];              // newest plate readings that the plate can have had
    uint8_t implausible_steps[2];      // since then, at most PLAUSIBLE_AGAIN_STEPS
};

void start_sensors(Sensors& sensors);

// Takes the readings of one step. Returns true when a mean was added to the history.
bool take_readings(Sensors& sensors, const uint16_t sums[PLACES]);

// Returns the bits of the faults whose cause is present.
uint32_t sensor_faults(Sensors& sensors);

bool plate_is_known(const Sensors& sensors);
float plate_c(const Sensors& sensors);  // mean of both readings; this and the next three require a known plate
float face_c(const Sensors& sensors);   // mean of both estimates
float cut_out_face_c(const Sensors& sensors);  // by the cut-out's bead; NEUTRAL_C while a plate's moves
float plate_change_c(const Sensors& sensors, uint8_t from, uint8_t to);  // of the mean, indices into the past
float plate_span_c(const Sensors& sensors);  // range of the mean in the window

// Returns the hotter of the plausible readings, each for a second after its last one; at least NEUTRAL_C.
float hottest_plausible_c(const Sensors& sensors);

// Returns the trips of the plate that only implausible readings reach.
uint32_t implausible_trips(const Sensors& sensors);

inline uint32_t bit(uint8_t fault) {
    return (uint32_t)1 << fault;
}

}  // namespace plate
