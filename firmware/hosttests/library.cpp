// The core as a shared library with one board in it, for measurements that step it from Python:
//   g++ -std=gnu++14 -O2 -shared -fPIC -I../core library.cpp ../core/*.cpp -o core.so
#include <cstring>

#include "board.h"
#include "hal.h"

namespace {
plate::Board board;
plate::Keepsake keepsake;
uint32_t uptime_ms;
int16_t driven;
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
    return uptime_ms < 200;  // until its button is pressed
}
Keepsake& hal_keepsake() {
    return keepsake;
}
void hal_feed_watchdog() {}
void hal_light(bool) {}
}  // namespace plate

extern "C" {
void core_start() {
    std::memset(&keepsake, 0xA7, sizeof keepsake);
    uptime_ms = 0;
    plate::start(board);
}

void core_receive(const uint8_t* bytes, int count) {
    for (int i = 0; i < count; i++) plate::receive(board, bytes[i]);
}

// One control step; the counts driven from now on.
int core_step(int plate_a, int plate_b, int sink) {
    const uint16_t sums[plate::PLACES] = {(uint16_t)plate_a, (uint16_t)plate_b, (uint16_t)sink};
    plate::step(board, sums);
    uptime_ms += plate::STEP_MS;
    return driven;
}

uint32_t core_faults() {
    return board.faults;
}
}
