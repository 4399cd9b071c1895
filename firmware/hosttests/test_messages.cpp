#include <doctest/doctest.h>

#include <algorithm>

#include "bench.h"
#include "parameters.h"

using namespace plate;

TEST_CASE("HELLO is answered with the limits and the lag of the beads, then acknowledged") {
    Rig rig(300);
    bench.sent.clear();
    for (uint8_t byte : frame_of(HELLO, 9, {1, 4})) receive(rig.board, byte);
    const auto frames = take_frames();
    REQUIRE(frames.size() == 3);
    const std::vector<uint8_t> reply = {
        HELLO_REPLY, 9, 1, 3, 1, 6, 0, 0, 0, 0, 0,  // protocol, firmware, board id
        0x50, 0x46, 0, 0, 0x40, 0x9C, 0, 0,         // 18000, 40000
        0xE0, 0x2E, 0xE8, 0x03,                     // 12000, 1000
        0x08, 0x07, 0xB8, 0x0B, 0x57, 0x02, 0xE8, 0x03,  // 1800, 3000, 599, 1000
        20, RESET_POWER_ON};
    CHECK(frames[0] == reply);
    CHECK(frames[1] == std::vector<uint8_t>{BEADS, 9, 0x2C, 0x01});
    CHECK(frames[2].size() == 2 + ACK_BYTES);
    CHECK(frames[2][2] == HELLO);
    CHECK(frames[2][3] == 9);
    CHECK(frames[2][4] == OK);
}

TEST_CASE("the lag of the beads is kept for good, within its range, and never while driving") {
    Rig rig(0);
    CHECK(rig.say(LAG, {0x2C, 0x01}) == NEEDS_HELLO);
    rig.answer_hello();
    CHECK(rig.say(LAG, {0xE9, 0x03}) == RANGE);  // 1001
    CHECK(rig.say(LAG, {0x2C}) == LENGTH);
    rig.hold(36.0);
    CHECK(rig.say(LAG, {0x2C, 0x01}) == DRIVING);
    rig.say(OFF);
    CHECK(rig.board.sensors.lag_s == 0.0f);
    CHECK(rig.say(LAG, {0x2C, 0x01}) == OK);
    CHECK(rig.board.sensors.lag_s == 0.3f);
    rig.reset(RESET_POWER_ON);
    CHECK(rig.board.lag_ms == 300);
    CHECK(rig.board.sensors.lag_s == 0.3f);
}

TEST_CASE("a lag that was never saved or is damaged counts as unknown, and the usual one is taken") {
    Rig rig(300);
    for (uint8_t byte = 0; byte < PARAMETER_BYTES; byte++) {
        bench.parameters[byte] ^= 0x10;
        rig.reset(RESET_POWER_ON);
        CHECK(rig.board.lag_ms == LAG_UNKNOWN_MS);
        CHECK(rig.board.sensors.lag_s == USUAL_LAG_MS * 0.001f);
        bench.parameters[byte] ^= 0x10;
    }
    for (uint8_t& byte : bench.parameters) byte = 0xFF;
    rig.reset(RESET_POWER_ON);
    CHECK(rig.board.lag_ms == LAG_UNKNOWN_MS);
}

TEST_CASE("each frame begins with a zero, so that noise before it costs nothing") {
    Rig rig;
    bench.sent.clear();
    rig.say(HELLO, {1, 1});
    rig.step();
    REQUIRE(!bench.sent.empty());
    bench.sent.insert(bench.sent.begin(), {0x55, 0xAA, 0x13});
    CHECK(std::count(bench.sent.begin(), bench.sent.end(), 0) == 2);  // the one that ends it is its last byte
    CHECK(take_frames().size() == 1);  // the telemetry of these steps
}

TEST_CASE("another major version is refused with a HELLO_REPLY, and needs a new HELLO") {
    Rig rig;
    CHECK(rig.answer_hello() == OK);
    CHECK(rig.hold(36) == OK);
    CHECK(rig.say(HELLO, {2, 0}) == VERSION);
    CHECK(rig.board.state == State::off);
    CHECK(rig.hold(30) == NEEDS_HELLO);
    CHECK(rig.answer_hello() == OK);
    CHECK(rig.hold(30) == OK);
}

TEST_CASE("no setpoint is held before a HELLO, nor after a reset without a new one and a reading") {
    Rig rig;
    CHECK(rig.hold(36) == NEEDS_HELLO);
    rig.step(50);
    CHECK(bench.counts == 0);
    rig.answer_hello();
    rig.reset(RESET_EXTERNAL);
    rig.step();
    CHECK(rig.hold(36) == NEEDS_HELLO);
    bench.reset_cause = RESET_POWER_ON;
    start(rig.board);
    rig.answer_hello();
    CHECK(rig.hold(36) == FAULTED);  // nothing was read yet
    rig.step();
    CHECK(rig.hold(36) == OK);
}

TEST_CASE("setpoints outside the range are refused, never clamped") {
    Rig rig;
    rig.answer_hello();
    for (double c : {17.999, 40.001, 0.0, -40.0, 1e6, -1e6}) CHECK(rig.hold(c) == RANGE);
    CHECK(rig.board.state == State::off);
    CHECK(rig.hold(18.0) == OK);
    CHECK(rig.hold(40.0) == OK);
}

TEST_CASE("a time to live of nothing or of more than a second is refused") {
    Rig rig;
    rig.answer_hello();
    CHECK(rig.hold(30, 0) == TTL);
    CHECK(rig.hold(30, 1001) == TTL);
    CHECK(rig.hold(30, 65535) == TTL);
    CHECK(rig.board.state == State::off);
    CHECK(rig.hold(30, 1) == OK);
    CHECK(rig.hold(30, 1000) == OK);
}

TEST_CASE("payloads of a wrong size and unknown types are refused and counted") {
    Rig rig;
    rig.answer_hello();
    CHECK(rig.say(SETPOINT, {1, 2, 3}) == LENGTH);
    CHECK(rig.say(OFF, {0}) == LENGTH);
    CHECK(rig.say(HELLO, {1}) == LENGTH);
    CHECK(rig.say(CLEAR) == LENGTH);
    CHECK(rig.say(0x55) == UNKNOWN);
    CHECK(rig.say(TELEMETRY) == UNKNOWN);
    CHECK(rig.telemetry().refused == 6);
}

TEST_CASE("telemetry is sent 20 times a second from power-on with the current state") {
    Rig rig;
    bench.sent.clear();
    rig.step(500);
    CHECK(take_frames().size() == 200);
    Telemetry telemetry = rig.telemetry();
    CHECK(telemetry.state == (uint8_t)State::off);
    CHECK(telemetry.faults == 0);
    CHECK(telemetry.plate_mc == doctest::Approx(32000).epsilon(0.001));
    CHECK(telemetry.plate2_mc == doctest::Approx(32000).epsilon(0.001));
    CHECK(telemetry.sink_mc == doctest::Approx(25000).epsilon(0.001));
    CHECK(telemetry.setpoint_mc == NO_READING);
    CHECK(telemetry.duty == 0);
    CHECK(telemetry.reset_cause == RESET_POWER_ON);
    rig.answer_hello();
    rig.hold_for(20.0, 30);
    telemetry = rig.telemetry();
    CHECK(telemetry.state == (uint8_t)State::holding);
    CHECK(telemetry.setpoint_mc < 32000);
    CHECK(telemetry.duty <= -666);
    CHECK((telemetry.limited & LIMIT_CURRENT));
}

TEST_CASE("a missing reading is sent as none, not as a temperature") {
    Rig rig;
    rig.step_on({16 * 1023, sum_at(32), 0});
    rig.a_c = 500.0;
    bench.sent.clear();
    for (int i = 0; i < 3; i++) rig.step_on({16 * 1023, sum_at(32), 0});
    const auto frames = take_frames();
    REQUIRE(frames.size() >= 1);
    const std::vector<uint8_t> none = {0, 0, 0, 0x80};
    CHECK(std::vector<uint8_t>(frames[0].begin() + 11, frames[0].begin() + 15) == none);
    CHECK(std::vector<uint8_t>(frames[0].begin() + 19, frames[0].begin() + 23) == none);
    CHECK(frames[0].size() == 2 + TELEMETRY_BYTES);
}
