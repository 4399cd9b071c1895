// The complete state of the firmware, and the three events that change it: start, a byte, a control step.
#pragma once
#include <stdint.h>

#include "frame.h"
#include "loop.h"
#include "plausibility.h"
#include "pulse.h"
#include "sensors.h"
#include "session.h"

namespace plate {

struct Board {
    State state;
    uint32_t faults;   // latched
    uint32_t causes;   // faults whose cause is present
    uint16_t signals;  // those of them that are bad wires and jumps
    uint8_t signal_ms;  // since those changed, at most FOLLOWS_MS
    bool hello_received;  // a HELLO of this major version arrived since the reset
    float setpoint_c;
    uint16_t ttl_ms;
    uint16_t returning_ms;
    uint16_t cut_out_ms;   // time that the cut-out has been open while driving
    uint16_t withheld_ms;  // until its relay is permitted again
    uint8_t pulled_in_ms;  // time that it has been closed without a proof
    uint16_t proved_ms;    // time for which an open relay that let go when asked may close; 0 without a proof
    bool is_asked;         // to let go, as its proof
    uint8_t beyond_ms;     // time that the face has been beyond its trips
    Sensors sensors;
    Plausibility plausibility;
    Pulse pulse;
    Loop loop;
    Session session;
    Memory memory;
    Decoder decoder;
    uint8_t reset_cause;
    uint8_t seq;
    uint8_t telemetry_ms;
    uint16_t lag_ms;      // of the plate's beads as saved, LAG_UNKNOWN_MS until then
    uint16_t bad_frames;
    uint16_t refused;
};

void start(Board& board);
void receive(Board& board, uint8_t byte);

// One control step, every STEP_MS, on the sums of 16 conversions of each thermistor.
void step(Board& board, const uint16_t sums[PLACES]);

// The actions of messages.
Answer ask(Board& board, int32_t setpoint_mc, uint16_t ttl_ms);
void rest(Board& board);
void open_bridge(Board& board);
Answer clear(Board& board, uint8_t fault);
Answer keep_lag(Board& board, uint16_t lag_ms);

}  // namespace plate
