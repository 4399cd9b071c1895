// The numbers of PROTOCOL.md: message types, sizes, answer codes, states, limit bits.
#pragma once
#include <stdint.h>

namespace plate {

enum : uint8_t { PROTOCOL_MAJOR = 1, PROTOCOL_MINOR = 3 };
enum : uint8_t { FIRMWARE_MAJOR = 1, FIRMWARE_MINOR = 6, FIRMWARE_PATCH = 0 };

enum : uint8_t {
    MAX_PAYLOAD = 48,
    MAX_RAW = 2 + MAX_PAYLOAD + 2,  // type, seq, payload, CRC
    MAX_WIRE = MAX_RAW + 2,         // COBS code byte and the final zero
};

enum Message : uint8_t {
    HELLO = 0x01,
    SETPOINT = 0x02,
    OFF = 0x03,
    REST = 0x04,
    CLEAR = 0x05,
    LAG = 0x06,
    HELLO_REPLY = 0x81,
    TELEMETRY = 0x82,
    ACK = 0x83,
    BEADS = 0x84,
};

enum : uint8_t {
    HELLO_BYTES = 2,
    SETPOINT_BYTES = 6,
    CLEAR_BYTES = 1,
    LAG_BYTES = 2,
    HELLO_REPLY_BYTES = 31,
    TELEMETRY_BYTES = 37,
    ACK_BYTES = 3,
    BEADS_BYTES = 2,
};

enum Answer : uint8_t {
    OK = 0,
    UNKNOWN = 1,
    LENGTH = 2,
    VERSION = 3,
    NEEDS_HELLO = 4,
    RANGE = 5,
    TTL = 6,
    FAULTED = 7,
    PERSISTS = 8,
    NOT_LATCHED = 9,
    LOCKED = 10,
    DRIVING = 11,
};

enum class State : uint8_t { off = 0, holding = 1, returning = 2, faulted = 3 };

enum Limit : uint8_t {
    LIMIT_SLEW = 1 << 1,
    LIMIT_CURRENT = 1 << 2,
    LIMIT_SINK = 1 << 3,
    LIMIT_DOSE = 1 << 4,
};

enum ResetCause : uint8_t {
    RESET_POWER_ON = 1 << 0,
    RESET_EXTERNAL = 1 << 1,
    RESET_BROWN_OUT = 1 << 2,
    RESET_WATCHDOG = 1 << 3,
    RESET_WHILE_DRIVING = 1 << 7,
};

const int32_t NO_READING = INT32_MIN;

// Fault numbers; fault n is bit n in telemetry. README.md explains each and its remedy.
enum Fault : uint8_t {
    PLATE_A_OPEN = 1,
    PLATE_A_SHORT = 2,
    PLATE_B_OPEN = 3,
    PLATE_B_SHORT = 4,
    SINK_OPEN = 5,
    SINK_SHORT = 6,
    PLATE_DISAGREES = 7,
    PLATE_FROZEN = 8,
    READING_JUMPS = 9,
    OVER_TEMPERATURE = 10,
    UNDER_TEMPERATURE = 11,
    SINK_HOT = 12,
    RUNAWAY = 13,
    WIRED_BACKWARDS = 14,
    COOLING_REVERSED = 15,
    DOSE_SPENT = 16,
    WATCHDOG = 17,
    BROWN_OUT = 18,
    RESTARTED_DRIVING = 19,
    SINK_IMPLAUSIBLE = 20,
    CUT_OUT_OPEN = 21,
    CUT_OUT_UNTESTED = 22,
    CUT_OUT_BEAD = 23,
    PLATE_A_STRAYS = 24,
    PLATE_B_STRAYS = 25,
    FAULTS_END = 26,
};

}  // namespace plate
