#include <doctest/doctest.h>

#include <functional>

#include "bench.h"

using namespace plate;

namespace {

// Holds `goal_c` for `steps` while the plate moves by `rate` degC/s; returns the steps until a fault, or -1.
int steps_to_fault(Rig& rig, double goal_c, int steps, const std::function<double(int)>& rate) {
    for (int i = 0; i < steps; i++) {
        if (i % 5 == 0) rig.hold(goal_c);
        rig.plate_at(rig.a_c + rate(i) * STEP_S);
        rig.step();
        if (rig.board.faults) return i + 1;
    }
    return -1;
}

Rig holding(double plate_c, double sink_c) {
    Rig rig;
    rig.plate_at(plate_c);
    rig.sink_c = sink_c;
    rig.reset(RESET_POWER_ON);
    rig.answer_hello();
    rig.step();
    return rig;
}

double still(int) {
    return 0.0;
}

// Takes the readings of one step, and judges them.
uint32_t judged(Plausibility& state, Sensors& sensors, double plate_c, double sink_c, float current_a, float error_c) {
    const uint16_t sums[PLACES] = {sum_at(plate_c), sum_at(plate_c), sum_at(sink_c)};
    const bool grown = take_readings(sensors, sums);
    return judge(state, sensors, grown, current_a, error_c);
}

}  // namespace

TEST_CASE("heat into the plate follows the module's law, by figures worked out by hand") {
    CHECK(plate_power_w(0.75f, 32.0f, 32.0f) == doctest::Approx(3.003).epsilon(0.001));
    CHECK(plate_power_w(-2.0f, 20.0f, 40.0f) == doctest::Approx(-3.234).epsilon(0.001));
    CHECK(sink_power_w(-2.0f, 20.0f, 40.0f) == doctest::Approx(5.209).epsilon(0.001));
}

TEST_CASE("a plate that stands still under a second of heat or cold is a runaway") {
    for (double goal_c : {40.0, 18.0}) {
        Rig rig = holding(30.0, 30.0);
        const int steps = steps_to_fault(rig, goal_c, 200, still);
        CHECK(rig.only(RUNAWAY));
        CHECK(steps <= 75);  // the window, and half a second to reach full drive
        CHECK(bench.counts == 0);
    }
}

TEST_CASE("bursts too short for a window are judged together, however the host switches off and on") {
    for (double goal_c : {40.0, 18.0})
        for (int each : {10, 20, 40}) {
            Rig rig = holding(30.0, 30.0);
            int steps = 0;
            for (; !rig.board.faults && steps < 3000; steps++) {
                if (steps / each % 2) rig.say(OFF);
                else rig.hold(goal_c);
                rig.step();
            }
            CHECK(rig.only(RUNAWAY));
            CHECK(steps * STEP_S < 30.0);
        }
}

TEST_CASE("a first second of full heat that was not interrupted is judged by its window alone") {
    for (bool after_rest : {false, true}) {
        Sensors sensors = holding(30.0, 30.0).board.sensors;
        Plausibility state;
        start_judging(state);
        if (after_rest) pause_judging(state);
        for (int i = 0; i < 50; i++) CHECK(judged(state, sensors, 30.0 + 0.1 * i * STEP_S, 30.0, 1.8f, 3.0f) == 0);
    }
}

TEST_CASE("0.46 A of heat and 1.21 A of cold must move the plate; less is not judged") {
    for (float current_a : {0.46f, 0.44f, -1.21f, -1.19f}) {
        Plausibility state;
        start_judging(state);
        Sensors sensors{};
        uint32_t faults = 0;
        const float error_c = current_a > 0.0f ? 3.0f : -3.0f;
        for (int i = 0; i < 400; i++) faults |= judged(state, sensors, 30.0, 30.0, current_a, error_c);
        const bool pushes = current_a > 0.45f || current_a < -1.2f;
        CHECK((faults & bit(RUNAWAY)) == (pushes ? bit(RUNAWAY) : 0));
    }
}

TEST_CASE("a working plate under such a host raises no fault") {
    Rig rig = holding(30.0, 30.0);
    for (int i = 0; i < 1000 && !rig.board.faults; i++) {
        const bool on = i / 25 % 2 == 0;
        if (on) rig.hold(40.0);
        else rig.say(OFF);
        rig.plate_at(rig.a_c + (on ? 1.0 : -1.0) * STEP_S);
        rig.step();
    }
    CHECK(rig.board.faults == 0);
}

TEST_CASE("the energy of a touch is forgotten after five seconds of rest") {
    Rig rig = holding(30.0, 30.0);
    for (int round = 0; round < 5; round++) {
        for (int i = 0; i < 45; i++) {  // less than a window: 2 J of the 7
            rig.hold(40.0);
            rig.step();
        }
        rig.say(OFF);
        rig.step(255);
    }
    CHECK(rig.board.faults == 0);
}

TEST_CASE("a plate that drifts without following is a runaway after some seconds") {
    Rig rig = holding(30.0, 30.0);
    const int steps = steps_to_fault(rig, 40.0, 500, [](int) { return 0.12; });
    CHECK(rig.only(RUNAWAY));
    CHECK(steps <= 300);
}

TEST_CASE("a plate that moves in the wrong direction is wired backwards") {
    Rig heats = holding(32.0, 25.0);
    CHECK(steps_to_fault(heats, 40.0, 500, [](int) { return -3.0; }) <= 75);
    CHECK(heats.only(WIRED_BACKWARDS));
    Rig cools = holding(30.0, 25.0);
    CHECK(steps_to_fault(cools, 18.0, 500, [](int) { return 6.0; }) <= 75);
    CHECK(cools.only(WIRED_BACKWARDS));
}

TEST_CASE("a plate that followed and then seems to cool while heated lost its thermistors") {
    Rig rig = holding(32.0, 25.0);
    const int steps = steps_to_fault(rig, 40.0, 500, [](int i) { return i < 75 ? 1.5 : -3.0; });
    CHECK(rig.only(RUNAWAY));
    CHECK(steps <= 150);
}

TEST_CASE("a plate that follows at the slowest plausible rate raises no fault") {
    Rig rig = holding(30.0, 30.0);
    CHECK(steps_to_fault(rig, 40.0, 800, [](int) { return 0.25; }) == -1);
}

TEST_CASE("a cold hand that cools a plate at its goal for half a second is not a fault") {
    Rig rig = holding(38.0, 25.0);
    const int steps = steps_to_fault(rig, 38.0, 600, [](int i) {
        if (i < 50) return 0.0;
        return i < 75 ? -10.0 : 0.6;
    });
    CHECK(steps == -1);
}

TEST_CASE("a plate at the end of its reach may stand still: the heat flows back to the sink") {
    Rig rig = holding(38.0, -8.0);
    CHECK(steps_to_fault(rig, 40.0, 1500, still) == -1);
}

TEST_CASE("a plate held against a touch eases off and may stand still") {
    Plausibility state;
    start_judging(state);
    Sensors sensors{};
    for (float current_a = -2.0f; current_a < -1.2f; current_a *= 0.9990f)
        CHECK(judged(state, sensors, 20.0, 25.0, current_a, 0.0f) == 0);
}

TEST_CASE("more cooling and a warmer plate, second after second, reduces cooling and finally raises a fault") {
    Plausibility state;
    start_judging(state);
    Sensors sensors{};
    uint32_t faults = 0;
    double plate_c = 25.0;
    int steps = 0;
    float current_a = -1.6f;
    for (; !faults && steps < 2000; steps++) {
        faults = judged(state, sensors, plate_c, 40.0 + steps * 0.01, current_a, -3.0f);
        plate_c += 0.15 * STEP_S;
        if (state.strikes == 1) CHECK(state.cool_ceiling_a <= 0.76f * 1.6f);
        if (-current_a > state.cool_ceiling_a) current_a = -state.cool_ceiling_a;
    }
    CHECK(faults == bit(COOLING_REVERSED));
    CHECK(state.strikes == REVERSED_STRIKES);
    CHECK(steps * STEP_S < 20.0);
}

TEST_CASE("cooling that eases while the plate warms, and a plate or sink that is not read, are no reversal") {
    const struct { double plate_c, sink_c; bool is_read; } rows[] = {
        {25.0, 40.0, true}, {525.0, 40.0, false}, {25.0, 540.0, false}};
    for (const auto& row : rows) {
        Plausibility state;
        start_judging(state);
        Sensors sensors{};
        for (int i = 0; i < 510; i++)
            judged(state, sensors, row.plate_c + 0.15 * i * STEP_S, row.sink_c, -2.0f + 0.1f * i * STEP_S, -3.0f);
        CHECK(state.strikes == 0);
        CHECK((state.second_ms != 0) == row.is_read);
    }
}

TEST_CASE("a sink that takes heat without its reading moving is not being read") {
    for (double current_a : {-1.5, -0.6}) {
        Plausibility state;
        start_judging(state);
        Sensors sensors{};
        uint32_t faults = 0;
        int steps = 0;
        for (; !faults && steps < 6000; steps++)
            faults = judged(state, sensors, 20.0, 25.0, (float)current_a, 0.0f) & bit(SINK_IMPLAUSIBLE);
        CHECK(faults == bit(SINK_IMPLAUSIBLE));
        CHECK(steps * STEP_S < 120.0);
    }
}

TEST_CASE("a good sink that warms by half a degree is believed") {
    Plausibility state;
    start_judging(state);
    Sensors sensors{};
    for (int i = 0; i < 30000; i++) {
        const double sink_c = 25.0 + 0.5 * (1.0 - 1.0 / (1.0 + i * STEP_S / 60.0));
        CHECK(judged(state, sensors, 20.0, sink_c, -0.6f, 0.0f) == 0);
    }
}
