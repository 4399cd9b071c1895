#include <doctest/doctest.h>

#include <algorithm>

#include "bench.h"

using namespace plate;

namespace {

Rig heating() {
    Rig rig;
    rig.answer_hello();
    rig.hold_for(36.0, 20);
    return rig;
}

Rig with_latched(uint8_t fault) {
    Rig rig = heating();
    rig.board.faults |= bit(fault);
    rig.step();
    return rig;
}

}  // namespace

TEST_CASE("a setpoint is held for its time to live, then the plate returns to neutral, then it is off") {
    Rig rig;
    rig.answer_hello();
    rig.plate_at(35.5);
    for (rig.a_c = rig.b_c = 32.0; rig.a_c < 35.5; rig.plate_at(rig.a_c + 0.1)) rig.step();
    rig.hold(36.0, 400);
    rig.step(19);
    CHECK(rig.board.state == State::holding);
    rig.step(1);
    CHECK(rig.board.state == State::returning);
    for (int i = 0; i < 100 && rig.board.state == State::returning; i++) {
        rig.plate_at(rig.a_c - 0.06);
        rig.step();
    }
    CHECK(rig.board.state == State::off);
    CHECK(rig.a_c == doctest::Approx(32.3).epsilon(0.01));
    CHECK(bench.counts == 0);
    CHECK(rig.board.faults == 0);
}

TEST_CASE("a return that never arrives ends after 10 s") {
    Rig rig;
    rig.plate_at(28.0);
    rig.sink_c = -12.0;  // not judged, because the heat flows back
    rig.reset(RESET_POWER_ON);
    rig.answer_hello();
    rig.step();
    rig.hold(30.0);
    rig.step();
    rig.say(REST);
    int steps = 0;
    for (; rig.board.state == State::returning && steps < 1000; steps++) rig.step();
    CHECK(rig.board.faults == 0);
    CHECK(steps == 500);
    CHECK(bench.counts == 0);
}

TEST_CASE("a fault opens the bridge in its step, and stays: no setpoint is taken until it is cleared") {
    Rig rig = heating();
    CHECK(bench.counts > 0);
    rig.step_on({16 * 1023, sum_at(32), sum_at(25)});
    CHECK(bench.counts == 0);
    rig.step(500);
    CHECK(rig.only(PLATE_A_OPEN));
    CHECK(rig.say(OFF) == OK);
    CHECK(rig.hold(36.0) == FAULTED);
    CHECK(bench.counts == 0);
}

TEST_CASE("clearing is by number: the others stay") {
    Rig rig = heating();
    rig.step_on({16 * 1023, sum_at(32), 0});
    rig.step(5);
    CHECK(rig.clear(PLATE_A_OPEN) == OK);
    CHECK(rig.only(SINK_SHORT));
    CHECK(rig.board.state == State::faulted);
    CHECK(rig.hold(36.0) == FAULTED);
    CHECK(rig.clear(SINK_SHORT) == OK);
    CHECK(rig.board.state == State::off);
}

TEST_CASE("clearing is refused while the cause persists") {
    Rig rig = heating();
    for (int i = 0; i < 5; i++) rig.step_on({16 * 1023, sum_at(32), sum_at(25)});
    CHECK(rig.clear(PLATE_A_OPEN) == PERSISTS);
    CHECK(rig.board.state == State::faulted);
}

TEST_CASE("clearing switches nothing on") {
    Rig rig = with_latched(RUNAWAY);
    CHECK(rig.clear(RUNAWAY) == OK);
    for (int i = 0; i < 50; i++) {
        CHECK(rig.board.state == State::off);
        rig.step();
        CHECK(bench.counts == 0);
    }
    CHECK(rig.hold(36.0) == OK);
}

TEST_CASE("every kind of reset but power-on is a fault when it should be") {
    const struct {
        uint8_t cause;
        bool driving;
        uint8_t fault;  // 0 none
    } resets[] = {
        {RESET_POWER_ON, true, 0},           {RESET_POWER_ON | RESET_BROWN_OUT, true, 0},
        {RESET_EXTERNAL, false, 0},          {RESET_EXTERNAL, true, RESTARTED_DRIVING},
        {RESET_WATCHDOG, true, WATCHDOG},    {RESET_WATCHDOG, false, WATCHDOG},
        {RESET_BROWN_OUT, false, BROWN_OUT}, {0, true, RESTARTED_DRIVING},
        {0, false, 0},
    };
    for (const auto& reset : resets) {
        Rig rig;
        if (reset.driving) rig = heating();
        rig.reset(reset.cause);
        rig.step();
        CHECK(rig.board.faults == (reset.fault ? bit(reset.fault) : 0));
        CHECK(bench.counts == 0);
        const bool reported = rig.telemetry().reset_cause & RESET_WHILE_DRIVING;
        CHECK(reported == reset.driving);
    }
}

TEST_CASE("a reset clears no fault, no dose and no heat") {
    Rig rig = with_latched(RUNAWAY);
    rig.board.session = {1.2f, 300.0f, 5.0f};
    rig.step();
    rig.reset(0);
    CHECK(rig.has(RUNAWAY));
    CHECK(rig.board.state == State::faulted);
    CHECK(rig.board.session.dose_cem43 == 1.2f);
    CHECK(rig.board.session.heated_s == 300.0f);
}

TEST_CASE("a spent dose latches, and cannot be cleared before the rest is over") {
    Rig rig = heating();
    rig.board.session.dose_cem43 = 2.0f;
    rig.step(2);
    CHECK(rig.only(DOSE_SPENT));
    CHECK(bench.counts == 0);
    CHECK(rig.clear(DOSE_SPENT) == PERSISTS);
    rig.step(45100);
    CHECK(rig.clear(DOSE_SPENT) == OK);
    CHECK(rig.hold(36.0) == OK);
}

TEST_CASE("the dose is counted from the hotter plate thermistor, whatever the state") {
    Rig rig;
    rig.plate_at(41.0);
    rig.reset(RESET_POWER_ON);
    rig.b_c = 42.0;
    rig.step(3000);
    CHECK(rig.telemetry().dose_mcem43 == doctest::Approx(250).epsilon(0.02));
}

// One thermistor's wire touches ground or comes off for `steps`; the first and last sums are partly sound.
static Rig after_a_bad_contact(uint8_t place, uint16_t rail, int steps, double share) {
    Rig rig;
    rig.answer_hello();
    rig.follow_for(36.0, 100);
    for (int i = 0; i < steps; i++) {
        uint16_t sums[PLACES] = {sum_at(rig.a_c), sum_at(rig.b_c), sum_at(rig.sink_c)};
        const double bad = i == 0 || i == steps - 1 ? share : 1.0;
        sums[place] = (uint16_t)(sums[place] + bad * (rail - sums[place]));
        rig.step_on({sums[0], sums[1], sums[2]});
    }
    return rig;
}

TEST_CASE("a bad contact of up to 0.1 s adds no dose and latches only what it is") {
    const uint8_t open[] = {PLATE_A_OPEN, PLATE_B_OPEN, SINK_OPEN};
    const uint8_t shorted[] = {PLATE_A_SHORT, PLATE_B_SHORT, SINK_SHORT};
    for (uint8_t place = PLATE_A; place <= SINK; place++)
        for (int steps : {1, 2, 3, 6})
            for (double share : {0.3, 0.5, 0.8})
                for (uint16_t rail : {0, 16 * 1023}) {
                    Rig rig = after_a_bad_contact(place, rail, steps, share);
                    const float dose_cem43 = rig.board.session.dose_cem43;
                    CHECK(bench.counts == 0);
                    rig.step(200);
                    const uint32_t wire = bit(rail ? open[place] : shorted[place]);
                    CHECK((rig.board.faults & ~(wire | bit(READING_JUMPS))) == 0);
                    CHECK(rig.board.faults != 0);
                    CHECK(rig.board.session.dose_cem43 < dose_cem43 + 0.001f);
                }
}

TEST_CASE("the dose of a hot plate is counted while one thermistor is bad") {
    Rig rig;
    rig.plate_at(42.0);
    rig.reset(RESET_POWER_ON);
    rig.step(5);
    for (int i = 0; i < 3000; i++) rig.step_on({0, sum_at(42.0), sum_at(25)});
    CHECK(rig.telemetry().dose_mcem43 == doctest::Approx(250).epsilon(0.02));
}

TEST_CASE("a plate that is really too hot is named 0.1 s after the bad wire beside it") {
    Rig rig;
    rig.plate_at(41.0);
    rig.reset(RESET_POWER_ON);
    rig.step(60);
    for (int i = 0; i < 5; i++) rig.step_on({0, sum_at(43.4), sum_at(25)});
    CHECK(rig.only(PLATE_A_SHORT));
    rig.step_on({0, sum_at(43.4), sum_at(25)});
    CHECK(rig.board.faults == (bit(PLATE_A_SHORT) | bit(OVER_TEMPERATURE)));
}

TEST_CASE("a reading that jumped and stays is never driven on, whatever is cleared") {
    Rig rig = heating();
    rig.a_c += 12.0;
    for (int i = 0; i < 400; i++) {
        rig.step();
        CHECK(bench.counts == 0);
        for (uint8_t fault = 1; fault < FAULTS_END; fault++) rig.clear(fault);
        rig.hold(36.0);
    }
    CHECK(rig.board.faults != 0);
    CHECK(rig.board.session.dose_cem43 < 0.01f);
}

TEST_CASE("15 minutes of heat are all a session gets: warm setpoints become neutral and report it") {
    Rig rig = heating();
    CHECK(rig.telemetry().heated_s == 0);
    rig.follow_for(36.0, 60);
    CHECK(rig.telemetry().heated_s >= 1);
    rig.board.session.heated_s = 899.99f;
    rig.follow_for(36.0, 20);
    const Telemetry telemetry = rig.telemetry();
    CHECK((telemetry.limited & LIMIT_DOSE));
    CHECK(rig.board.loop.goal_c == NEUTRAL_C);
    CHECK(rig.board.faults == 0);
}

TEST_CASE("an open cut-out is a fault of its own while driving, and not at rest") {
    Rig rig;
    rig.answer_hello();
    bench.cut_out_is_open = true;
    rig.step(50);
    CHECK(rig.board.faults == 0);  // its button has not been pressed yet
    rig.hold(36);
    rig.step(4);
    CHECK(rig.board.faults == 0);  // a bouncing relay
    rig.step(2);
    CHECK(rig.only(CUT_OUT_OPEN));
    CHECK(bench.counts == 0);
    CHECK(rig.clear(CUT_OUT_OPEN) == OK);
    rig.start_cut_out();
    rig.follow_for(36, 100);
    CHECK(rig.board.faults == 0);
}

TEST_CASE("no leave is given to a cut-out for 0.2 s after a reset, and then with its relay open") {
    Rig rig;
    bench.cut_out_is_open = true;
    start(rig.board);
    for (int i = 0; i < 9; i++) {
        CHECK(!bench.cut_out_is_permitted);
        rig.step();
    }
    rig.step();
    CHECK(bench.cut_out_is_permitted);
    CHECK(rig.board.faults == 0);
}

TEST_CASE("each start of the cut-out proves that its relay lets go when the leave is withdrawn") {
    Rig rig;
    bench.cut_out_is_open = true;
    rig.step(60);
    bench.cut_out_is_open = false;  // the start button
    rig.step(2);
    CHECK(bench.cut_out_is_permitted);
    rig.step(2);
    CHECK(!bench.cut_out_is_permitted);
    bench.cut_out_is_open = true;
    rig.step();
    CHECK(bench.cut_out_is_permitted);
    bench.cut_out_is_open = false;  // the button is still pressed
    rig.step(200);
    CHECK(bench.cut_out_is_permitted);
    rig.answer_hello();
    rig.follow_for(36, 100);
    CHECK(rig.board.faults == 0);
}

TEST_CASE("a relay that stays closed when its leave is withdrawn is untested, and nothing is driven") {
    Rig rig;
    bench.cut_out_is_open = false;
    start(rig.board);
    rig.step(100);
    CHECK(!bench.cut_out_is_permitted);
    rig.answer_hello();
    CHECK(rig.board.faults == 0);  // not driving yet
    for (int i = 0; i < 20; i++) {
        rig.hold(36);
        rig.step();
        CHECK(bench.counts == 0);
    }
    CHECK(rig.only(CUT_OUT_UNTESTED));
    CHECK(rig.clear(CUT_OUT_UNTESTED) == PERSISTS);
    rig.start_cut_out();
    CHECK(rig.clear(CUT_OUT_UNTESTED) == OK);
    rig.follow_for(36, 100);
    CHECK(rig.board.faults == 0);
}

TEST_CASE("every fault withdraws the leave in its step, and its end gives it back to the button") {
    Rig rig = heating();
    CHECK(bench.cut_out_is_permitted);
    rig.step_on({16 * 1023, sum_at(32), sum_at(25)});
    CHECK(!bench.cut_out_is_permitted);
    bench.cut_out_is_open = true;
    rig.step(12);
    CHECK(bench.cut_out_is_permitted);
    CHECK(rig.board.faults != 0);
}

TEST_CASE("a face at 41 or 16.5 degC withdraws the leave within 0.1 s, also while nothing is driven") {
    for (double limit_c : {FACE_TRIP_LOW_C, FACE_TRIP_HIGH_C}) {
        Rig rig;
        rig.answer_hello();
        const double way = limit_c > NEUTRAL_C ? 0.05 : -0.05;
        for (double c = 32.0; (limit_c - c) / way > 4.0; c += way) {
            rig.plate_at(c);
            rig.step();
        }
        rig.step(20);
        CHECK(bench.cut_out_is_permitted);
        rig.plate_at(limit_c + way);
        rig.step(5);
        CHECK(!bench.cut_out_is_permitted);
        CHECK(rig.only(way > 0.0 ? OVER_TEMPERATURE : UNDER_TEMPERATURE));
        for (int i = 0; i < 20; i++) {  // longer than a byte of milliseconds
            rig.step();
            CHECK(rig.clear(way > 0.0 ? OVER_TEMPERATURE : UNDER_TEMPERATURE) == PERSISTS);
        }
        bench.cut_out_is_open = true;
        rig.step();
        CHECK(rig.clear(way > 0.0 ? OVER_TEMPERATURE : UNDER_TEMPERATURE) == OK);
    }
}

TEST_CASE("the cut-out's bead alone withdraws the leave at 41 or 16.5 degC while the plate's stand still") {
    for (double limit_c : {16.5, 41.0}) {
        const double way = limit_c > NEUTRAL_C ? 1.0 : -1.0;
        Rig rig;
        rig.answer_hello();
        for (double c = 32.0; (limit_c - c) * way > 1.05; c += way * 0.05) {
            rig.plate_at(c);
            rig.step();
        }
        for (double beyond_c : {-0.1, 0.1}) {
            for (int i = 0; i < 500; i++) {  // slowly: the bead is taken to be ahead of itself by its slope
                rig.cut_out_off_c += (limit_c + way * beyond_c - rig.a_c - rig.cut_out_off_c) / (500 - i);
                rig.step();
            }
            rig.step(20);
            CHECK(bench.cut_out_is_permitted == (beyond_c < 0.0));
        }
        CHECK(rig.only(way > 0.0 ? OVER_TEMPERATURE : UNDER_TEMPERATURE));
    }
}

TEST_CASE("a bead of the cut-out 1.5 degC away from the plate's is a fault by its name") {
    for (double off_c : {-1.7, 1.7, 500.0}) {
        Rig rig = heating();
        rig.cut_out_off_c = off_c;
        rig.step(2);
        CHECK(!rig.has(CUT_OUT_BEAD));
        rig.step(1);
        CHECK(rig.only(CUT_OUT_BEAD));
        CHECK(!bench.cut_out_is_permitted);
    }
    for (double off_c : {-1.3, 1.3}) {
        Rig rig = heating();
        for (int i = 1; i <= 100; i++) {
            rig.cut_out_off_c = off_c * i / 100;
            rig.follow_for(36, 1);
        }
        rig.follow_for(36, 200);
        CHECK(rig.board.faults == 0);
    }
}

TEST_CASE("a bead of the cut-out that lags by any time up to 1 s is no fault, however the plate moves") {
    for (double lag_s : {0.0, 0.3, 1.0}) {
        Rig rig;
        double face_c = 32.0, bead_c = 32.0;
        for (int i = 0; i < 1500; i++) {
            const double way = i / 60 % 2 ? 8.0 : -10.0;  // degC/s
            face_c = std::min(std::max(face_c + way * STEP_S, 19.0), 39.0);
            bead_c += (face_c - bead_c) * std::min(STEP_S / std::max(lag_s, 1e-3), 1.0);
            rig.plate_at(face_c);
            rig.cut_out_off_c = bead_c - face_c;
            rig.step();
            REQUIRE(rig.board.faults == 0);
        }
    }
}

TEST_CASE("of three beads the one that moved alone is named, whichever limit it passes") {
    for (bool first : {true, false})
        for (double c_s : {-60.0, -3.0, 3.0}) {
            Rig rig = heating();
            const double from_c = rig.b_c;
            for (int i = 0; i < 300 && !rig.board.faults; i++) {
                (first ? rig.a_c : rig.b_c) += c_s * STEP_S;
                rig.cut_out_off_c = from_c - rig.b_c;
                rig.step();
            }
            rig.step(100);
            CHECK(rig.only(first ? PLATE_A_STRAYS : PLATE_B_STRAYS));
        }
}

TEST_CASE("of three beads the one that stays behind is named") {
    for (double lag_s : {0.02, 0.2})
        for (double c_s : {-8.0, -2.0, 2.0}) {
            Rig rig = heating();
            double bead_c = rig.b_c;
            for (int i = 0; i < 100 && !rig.board.faults; i++) {
                rig.b_c += c_s * STEP_S;
                bead_c += (rig.b_c - bead_c) * STEP_S / lag_s;  // the cut-out's follows
                rig.cut_out_off_c = bead_c - rig.b_c;
                rig.step();
            }
            rig.step(100);
            CHECK(rig.only(PLATE_A_STRAYS));
        }
}

TEST_CASE("the third clearing of a fault within a minute is refused, also behind a reset") {
    Rig rig;
    rig.answer_hello();
    for (int times = 0; times < 3; times++) {
        rig.a_c = 45.0;
        rig.step();
        CHECK(rig.only(READING_JUMPS));
        rig.a_c = 32.0;
        rig.step(60);
        CHECK(rig.clear(READING_JUMPS) == (times < 2 ? OK : LOCKED));
    }
    rig.reset(RESET_EXTERNAL);
    rig.step(60);
    rig.answer_hello();
    CHECK(rig.clear(READING_JUMPS) == LOCKED);
    rig.step(CLEARED_MS / STEP_MS);
    CHECK(rig.clear(READING_JUMPS) == OK);
}

TEST_CASE("the light is steady while driving, dark at rest, and blinks five times a second on a fault") {
    Rig rig;
    CHECK(!bench.light);
    rig.answer_hello();
    for (int i = 0; i < 20; i++) {
        rig.hold_for(32.0, 1);
        CHECK(bench.light);
    }
    rig.say(OFF);
    rig.step();
    CHECK(!bench.light);
    rig.a_c = 45.0;
    rig.step();
    int changes = 0;
    for (int i = 0; i < 50; i++) {
        const bool before = bench.light;
        rig.step();
        changes += bench.light != before;
    }
    CHECK(changes == 10);
}

TEST_CASE("a contact that bounces is not an open cut-out") {
    Rig rig;
    rig.answer_hello();
    rig.hold(32.5);
    for (int i = 0; i < 40; i++) {
        bench.cut_out_is_open = i % 4 != 0;
        rig.hold_for(32.5, 1);
    }
    CHECK(rig.board.faults == 0);
}

TEST_CASE("the watchdog is fed once by each finished step and by nothing else") {
    Rig rig = heating();
    const unsigned before = bench.fed;
    for (int i = 0; i < 500; i++) rig.say(HELLO, {1, 0});
    CHECK(bench.fed == before);
    rig.step(7);
    CHECK(bench.fed == before + 7);
}

TEST_CASE("memory is armed while driving and only then") {
    Rig rig = heating();
    CHECK(was_driving(bench.persistent_state));
    rig.say(OFF);
    rig.step();
    CHECK_FALSE(was_driving(bench.persistent_state));
}
