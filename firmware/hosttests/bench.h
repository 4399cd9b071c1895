// A test bench: the HAL in memory, and a plate whose three temperatures the test sets.
#pragma once
#include <initializer_list>
#include <vector>

#include "board.h"
#include "hal.h"

struct Bench {
    uint32_t uptime_ms = 0;
    uint8_t reset_cause = plate::RESET_POWER_ON;
    int16_t counts = 0;  // current output
    unsigned fed = 0;    // number of watchdog resets
    bool light = false;
    bool cut_out_is_open = false, cut_out_is_permitted = false;
    std::vector<uint8_t> sent;
    plate::PersistentState persistent_state;
    uint8_t parameters[plate::PARAMETER_BYTES] = {0xFF, 0xFF, 0xFF, 0xFF};  // as in a new chip
};
extern Bench bench;

// Returns the sum of 16 conversions of a working thermistor.
uint16_t sum_at(double celsius, double beta_k = plate::NTC_BETA_K);

struct Telemetry {
    uint32_t uptime_ms;
    uint8_t state;
    uint32_t faults;
    int32_t plate_mc, plate2_mc, sink_mc, setpoint_mc;
    int16_t duty;
    uint8_t limited;
    uint16_t bad_frames, refused, dose_mcem43, heated_s;
    uint8_t reset_cause;
};

struct Rig {
    plate::Board board;
    double a_c = 32.0, b_c = 32.0, sink_c = 25.0;
    double cut_out_off_c = 0.0;  // its thermistor reads so much more than the second of the plate

    double a_answers = 1.0, b_answers = 1.0;  // share of a test pulse that each thermistor reports
    double pulsed_c = 0.0;                    // movement of the plate by the pulse so far

    // Just switched on, plate at room temperature, cut-out started; `lag_ms` is the lag in its EEPROM.
    explicit Rig(uint16_t lag_ms = 0);
    void start_cut_out();          // its button: the relay closes, lets go when asked, closes again
    void reset(uint8_t cause);     // restarts the chip; persistent memory survives; starts the cut-out
    void step(int steps = 1);      // control steps of 20 ms
    void step_on(std::initializer_list<uint16_t> sums);  // of the plate and the sink
    void plate_at(double celsius) { a_c = b_c = celsius; }

    // Sends one frame and returns the code of its ACK, -1 without an ACK.
    int say(uint8_t type, std::vector<uint8_t> payload = {});
    int answer_hello() { return say(plate::HELLO, {plate::PROTOCOL_MAJOR, plate::PROTOCOL_MINOR}); }
    int hold(double celsius, uint16_t ttl_ms = 500);
    int clear(uint8_t fault) { return say(plate::CLEAR, {fault}); }
    void hold_for(double celsius, int steps);    // repeats the setpoint, like a host
    void follow_for(double celsius, int steps);  // the same, while the plate follows its target

    bool has(uint8_t fault) const { return board.faults & plate::bit(fault); }
    bool only(uint8_t fault) const { return board.faults == plate::bit(fault); }
    Telemetry telemetry();  // steps until one is sent
};

// Returns the contents of all sent frames, oldest first, and clears bench.sent.
std::vector<std::vector<uint8_t>> take_frames();
std::vector<uint8_t> frame_of(uint8_t type, uint8_t seq, const std::vector<uint8_t>& payload);
