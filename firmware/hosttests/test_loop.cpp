#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>

#include "bench.h"

using namespace plate;

namespace {

void follow_for(Loop& loop, double goal_c, double plate_c, int steps) {
    for (int i = 0; i < steps; i++) {
        loop.limited = 0;
        follow(loop, {(float)goal_c, (float)plate_c, 25.0f, COOL_LIMIT_A, 0.0f, true});
    }
}

}  // namespace

TEST_CASE("the target never moves faster than 12 degC/s, and arrives") {
    for (float goal_c : {24.0f, 40.0f}) {
        Loop loop{};
        start_loop(loop, 32.0f);
        float before = loop.target_c, fastest = 0.0f;
        for (int i = 0; i < 200; i++) {
            loop.limited = 0;
            follow(loop, {goal_c, loop.target_c, 25.0f, COOL_LIMIT_A, 0.0f, true});  // a plate that keeps up
            fastest = std::fmax(fastest, std::fabs(loop.target_c - before));
            CHECK(((loop.limited & LIMIT_SLEW) != 0) == (loop.target_c != goal_c));
            before = loop.target_c;
        }
        CHECK(fastest == doctest::Approx(0.24).epsilon(0.001));
        CHECK(loop.target_c == goal_c);
        CHECK((loop.limited & LIMIT_CURRENT) == 0);
    }
}

TEST_CASE("no error and no time take the output beyond its caps") {
    for (double goal_c : {18.0, 40.0}) {
        for (double plate_c : {14.0, 42.0}) {
            Loop loop{};
            start_loop(loop, (float)plate_c);
            loop.owed = goal_c > plate_c ? 0.9f : -0.9f;  // of an earlier rounding
            for (int i = 0; i < 3000; i++) {
                follow_for(loop, goal_c, plate_c, 1);
                REQUIRE(loop.counts <= HEAT_CAP_COUNTS);
                REQUIRE(loop.counts >= -COOL_CAP_COUNTS);
            }
            CHECK((loop.limited & LIMIT_CURRENT) != 0);
        }
    }
    CHECK(HEAT_CAP_COUNTS * FULL_SCALE_MA <= 1800 * FULL_SCALE_COUNTS);
    CHECK(COOL_CAP_COUNTS * FULL_SCALE_MA <= 3000 * FULL_SCALE_COUNTS);
}

TEST_CASE("the integral does not wind up: minutes at the limit are forgotten in a second") {
    Loop loop{};
    start_loop(loop, 30.0f);
    follow_for(loop, 40.0, 30.0, 6000);
    CHECK(loop.counts == HEAT_CAP_COUNTS);
    follow_for(loop, 30.0, 31.0, 50);
    CHECK(loop.counts < 0);
}

TEST_CASE("a target that the current cannot reach waits for the plate and reports it") {
    Loop loop{};
    start_loop(loop, 30.0f);
    follow_for(loop, 40.0, 30.0, 500);
    CHECK(loop.target_c <= 30.0f + HEAT_LIMIT_A + 2 * SLEW_HEAT_C_STEP);  // 1 A for each degC
    CHECK((loop.limited & LIMIT_CURRENT));
}

TEST_CASE("a goal that is far colder gets the current that moves a light face in the step in which it arrives") {
    Loop loop{};
    start_loop(loop, 32.0f);
    loop.integral_a = 0.2f;  // what held the plate, against a cool room
    loop.counts = 34;
    follow_for(loop, 22.0, 32.0, 1);
    CHECK(loop.current_a < -1.9f);
    CHECK(loop.falling == 3);
    follow_for(loop, loop.target_c, 32.0, 3);
    CHECK(loop.falling == 0);
}

TEST_CASE("the mean output is finer than a count") {
    Loop loop{};
    start_loop(loop, 32.0f);
    loop.integral_a = 10.3f / COUNTS_PER_A;
    double sum = 0.0;
    for (int i = 0; i < 1000; i++) {
        follow_for(loop, 32.0, 32.0, 1);
        sum += loop.counts;
    }
    CHECK(sum / 1000.0 == doctest::Approx(10.3).epsilon(0.002));
}

TEST_CASE("a warm sink reduces cooling step by step, and reports it") {
    Loop loop{};
    CHECK(limited_setpoint(loop, 18.0f, 37.0f, false) == 18.0f);
    CHECK(loop.limited == 0);
    CHECK(limited_setpoint(loop, 18.0f, 41.0f, false) == doctest::Approx(25.0));
    CHECK((loop.limited & LIMIT_SINK));
    CHECK(limited_setpoint(loop, 18.0f, 60.0f, false) == NEUTRAL_C);
    start_loop(loop, 30.0f);
    for (int i = 0; i < 200; i++) {
        loop.limited = 0;
        follow(loop, {20.0f, 30.0f, 41.0f, COOL_LIMIT_A, 0.0f, true});
        CHECK(-loop.current_a <= 0.5f * COOL_LIMIT_A + 1.0f / COUNTS_PER_A);
    }
    CHECK((loop.limited & LIMIT_SINK));
}

TEST_CASE("spent heat holds warm setpoints to neutral and leaves cold ones alone") {
    Loop loop{};
    CHECK(limited_setpoint(loop, 39.0f, 25.0f, true) == NEUTRAL_C);
    CHECK((loop.limited & LIMIT_DOSE));
    loop.limited = 0;
    CHECK(limited_setpoint(loop, 24.0f, 25.0f, true) == 24.0f);
    CHECK(loop.limited == 0);
}
