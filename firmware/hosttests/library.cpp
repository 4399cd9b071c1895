// Exports the core as a shared library with one board, for measurements from Python:
//   g++ -std=gnu++14 -O2 -shared -fPIC -I../core library.cpp ../core/*.cpp -o core.so
#include <cmath>
#include <cstring>

#include "board.h"
#include "hal.h"

namespace {
plate::Board board;
plate::PersistentState persistent_state;
uint32_t uptime_ms;
int16_t driven;
bool permits;
uint8_t parameters[plate::PARAMETER_BYTES] = {0xFF, 0xFF, 0xFF, 0xFF};
}  // namespace

namespace plate {
uint32_t hal_uptime_ms() {
    return uptime_ms;
}
uint8_t hal_reset_cause() {
    return RESET_POWER_ON;
}
void hal_drive(int16_t counts) {
    driven = counts;
}
void hal_send(const uint8_t*, uint8_t) {}
bool hal_cut_out_is_open() {
    return !permits;  // its button is held
}
PersistentState& hal_persistent_state() {
    return persistent_state;
}
void hal_feed_watchdog() {}
void hal_read_parameters(uint8_t* bytes) {
    std::memcpy(bytes, parameters, PARAMETER_BYTES);
}
void hal_write_parameters(const uint8_t* bytes) {
    std::memcpy(parameters, bytes, PARAMETER_BYTES);
}
void hal_light(bool) {}
void hal_permit_cut_out(bool permitted) {
    permits = permitted;
}
}  // namespace plate

extern "C" {
void core_start() {
    std::memset(&persistent_state, 0xA7, sizeof persistent_state);
    uptime_ms = 0;
    plate::start(board);
}

void core_receive(const uint8_t* bytes, int count) {
    for (int i = 0; i < count; i++) plate::receive(board, bytes[i]);
}

// Runs one control step and returns the new output in counts.
int core_step(int plate_a, int plate_b, int sink) {
    const double share = plate_b / plate::READING_FULL_SCALE;
    const double ratio = std::pow(share / (1.0 - share), plate::CUT_OUT_BETA_K / plate::NTC_BETA_K);
    const auto cut_out = (uint16_t)(plate::READING_FULL_SCALE * ratio / (1.0 + ratio));  // as warm as the plate
    const uint16_t sums[plate::PLACES] = {(uint16_t)plate_a, (uint16_t)plate_b, (uint16_t)sink, cut_out};
    plate::step(board, sums);
    uptime_ms += plate::STEP_MS;
    return driven;
}

// Returns the current limits that act, as bits of telemetry.
int core_limited() {
    return board.loop.limited;
}

uint32_t core_faults() {
    return board.faults;
}
}
