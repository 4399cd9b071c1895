#include <doctest/doctest.h>

#include <cmath>

#include "bench.h"

using namespace plate;

TEST_CASE("a thermistor is read within 0.02 degC from 0 to 60 degC") {
    for (double c = 0.0; c <= 60.0; c += 0.25) {
        const Reading reading = read_thermistor(sum_at(c), NTC_BETA_K);
        REQUIRE(reading.known);
        CHECK(std::fabs(reading.c - c) < 0.02);
    }
}

TEST_CASE("no sum gives a temperature outside -31 to 111 degC") {
    for (unsigned sum = 0; sum <= 65535; sum++) {
        const Reading reading = read_thermistor((uint16_t)sum, NTC_BETA_K);
        if (!reading.known) continue;
        REQUIRE(reading.c > -31.0f);
        REQUIRE(reading.c < 111.0f);
    }
}

TEST_CASE("each wire has its own two faults, seen in one step, and none follows from them later") {
    const uint8_t open[] = {PLATE_A_OPEN, PLATE_B_OPEN, SINK_OPEN};
    const uint8_t shorted[] = {PLATE_A_SHORT, PLATE_B_SHORT, SINK_SHORT};
    for (uint8_t loose : {1, 2, 4, 3}) {  // the places, a bit each
        for (bool is_open : {true, false}) {
            Rig rig;
            uint16_t sums[PLACES] = {sum_at(32), sum_at(32), sum_at(25)};
            uint32_t faults = 0;
            for (int place = 0; place <= SINK; place++) {
                if (!(loose & bit(place))) continue;
                sums[place] = is_open ? 16 * 1023 : 0;
                faults |= bit(is_open ? open[place] : shorted[place]);
            }
            for (int i = 0; i < 100; i++) {
                rig.step_on({sums[0], sums[1], sums[2]});
                CHECK(rig.board.faults == faults);
            }
        }
    }
}

TEST_CASE("either plate thermistor trips at 43 and at 13 degC") {
    for (bool first : {true, false}) {
        Rig hot;
        hot.plate_at(42.5);
        hot.step();
        hot.board.faults = 0;  // of the way there
        (first ? hot.a_c : hot.b_c) = 43.1;
        hot.step();
        CHECK(hot.only(OVER_TEMPERATURE));
        Rig cold;
        cold.plate_at(13.5);
        cold.step();
        cold.board.faults = 0;
        (first ? cold.a_c : cold.b_c) = 12.9;
        cold.step();
        CHECK(cold.only(UNDER_TEMPERATURE));
    }
}

TEST_CASE("a sink of 44 degC trips") {
    Rig rig;
    for (rig.sink_c = 25.0; rig.sink_c < 43.9; rig.sink_c += 0.5) rig.step();
    CHECK(rig.board.faults == 0);
    rig.sink_c = 44.1;
    rig.step();
    CHECK(rig.only(SINK_HOT));
}

TEST_CASE("a reading that changes faster than a plate can is a fault of its own") {
    Rig rig;
    rig.a_c += 2.6;
    rig.step();
    CHECK(rig.has(READING_JUMPS));
    Rig sink;
    sink.sink_c += 1.6;
    sink.step();
    CHECK(sink.only(READING_JUMPS));
}

TEST_CASE("two plate thermistors apart by 1.6 degC for 300 ms are a fault; by 1.3 they are not") {
    Rig rig;
    rig.cut_out_off_c = -0.8;  // between both
    rig.b_c += 1.3;
    rig.reset(RESET_POWER_ON);
    rig.step(200);
    CHECK(rig.board.faults == 0);
    rig.b_c += 0.3;
    rig.step(14);
    CHECK(rig.board.faults == 0);
    rig.step(1);
    CHECK(rig.only(PLATE_DISAGREES));
    rig.cut_out_off_c = 500.0;  // not read: it speaks for neither
    rig.step(50);
    CHECK(rig.board.faults == (bit(PLATE_DISAGREES) | bit(CUT_OUT_BEAD)));
}

TEST_CASE("a passing disagreement has no effect later") {
    Rig rig;
    for (int round = 0; round < 10; round++) {
        rig.plate_at(round % 2 ? 32.0 : 32.4);
        rig.b_c = rig.a_c + 1.8;
        rig.step(10);
        rig.b_c = rig.a_c;
        rig.step(10);
    }
    CHECK(rig.board.faults == 0);
}

TEST_CASE("a thermistor that stands still while the other moves is named frozen") {
    Rig rig;
    for (int i = 0; i < 50; i++) {
        rig.a_c += 0.022;  // 1.1 degC/s
        rig.cut_out_off_c = 0.5 * (rig.a_c - rig.b_c);
        rig.step();
    }
    rig.step(5);
    CHECK(rig.only(PLATE_FROZEN));
}

TEST_CASE("readings give a mean each 100 ms, none while a wire is loose or both are, and again when they are not") {
    const uint16_t fine = sum_at(32), loose = 16 * 1023;
    const struct { uint16_t a, b; int means; } rows[] = {{fine, fine, 24}, {fine, loose, 0}, {loose, loose, 0}};
    for (const auto& row : rows) {
        Rig rig;
        int means = 0;
        for (int i = 0; i < 125; i++) {
            const bool is_over = i >= 120;
            const uint16_t sums[PLACES] = {is_over ? fine : row.a, is_over ? fine : row.b, sum_at(25)};
            means += take_readings(rig.board.sensors, sums);
        }
        CHECK(means == row.means + 1);
    }
}

TEST_CASE("the cut-out's bead stands for the face, 0.26 s ahead, while both of the plate stand still") {
    Rig rig;
    rig.step(60);
    for (int i = 0; i < 50; i++) {
        const uint16_t sums[PLACES] = {sum_at(32), sum_at(32), sum_at(25), sum_at(32.0 + 0.02 * i, CUT_OUT_BETA_K)};
        take_readings(rig.board.sensors, sums);
    }
    CHECK(cut_out_face_c(rig.board.sensors) == doctest::Approx(32.98 + 0.26).epsilon(0.0005));
}

TEST_CASE("the face is ahead of a moving bead by its lag, and beside a still or frozen one") {
    Rig rig(300);
    for (int i = 0; i < 50; i++) {
        rig.plate_at(rig.a_c - 0.06);  // 3 degC/s
        rig.step();
    }
    const double behind_c = plate_c(rig.board.sensors) - face_c(rig.board.sensors);
    CHECK(behind_c == doctest::Approx(3.0 * (0.3 + FACE_FILTER_S)).epsilon(0.05));
    rig.step(50);
    CHECK(face_c(rig.board.sensors) == doctest::Approx(plate_c(rig.board.sensors)).epsilon(0.001));
}

TEST_CASE("either the reading or the estimate trips, whichever is worse") {
    Rig rises(1000);
    rises.plate_at(39.0);
    rises.reset(RESET_POWER_ON);
    int steps = 0;
    for (; steps < 100 && !rises.board.faults; steps++) {
        rises.plate_at(rises.a_c + 0.06);  // 3 degC/s
        rises.step();
    }
    CHECK(rises.only(OVER_TEMPERATURE));
    CHECK(rises.a_c < 41.0);  // the face is at 43 when this bead reads 40

    Rig falls(1000);
    falls.plate_at(42.9);
    falls.reset(RESET_POWER_ON);
    falls.step(50);
    falls.plate_at(43.1);
    falls.step(2);
    for (int i = 0; i < 5 && !falls.board.faults; i++) {
        falls.plate_at(falls.a_c - 0.02);  // the estimate is below the trip, the reading above
        falls.step();
    }
    CHECK(falls.only(OVER_TEMPERATURE));
}

TEST_CASE("a glitch that is no jump moves the estimate by no more than a plate can") {
    Rig rig(1000);
    rig.step(50);
    rig.a_c = rig.b_c = 34.4;  // 2.4 degC in a step
    rig.step();
    CHECK(face_c(rig.board.sensors) <= 34.4 + MOST_AHEAD_C + 0.01);
}
