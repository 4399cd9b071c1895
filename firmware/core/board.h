// The one state of the firmware, and the three things that happen to it: start, a byte, a step.
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
    uint32_t causes;   // there now
    bool greeted;      // a HELLO of our major came since the reset
    float asked_c;
    uint16_t ttl_ms;
    uint16_t returning_ms;
    uint16_t cut_out_ms;  // for how long it was open while driving
    uint8_t open_ms;      // for how long it was open, at most CUT_OUT_MS
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
    uint16_t bad_frames;
    uint16_t refused;
};

void start(Board& board);
void receive(Board& board, uint8_t byte);

// One control step, every STEP_MS, on the sums of 16 conversions of each thermistor.
void step(Board& board, const uint16_t sums[PLACES]);

// What messages ask for.
Answer ask(Board& board, int32_t setpoint_mc, uint16_t ttl_ms);
void rest(Board& board);
void open_bridge(Board& board);
Answer clear(Board& board, uint8_t fault);

}  // namespace plate
