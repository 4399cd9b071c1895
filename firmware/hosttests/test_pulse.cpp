#include <doctest/doctest.h>

#include "bench.h"

using namespace plate;

namespace {

// A plate at 30 degC whose thermistors report these shares of its movement by a test pulse.
Rig holding(double a_answers, double b_answers) {
    Rig rig;
    rig.a_answers = a_answers;
    rig.b_answers = b_answers;
    rig.plate_at(30.0);
    rig.step(60);
    rig.answer_hello();
    return rig;
}

}  // namespace

TEST_CASE("thermistors frozen at the same value are found by a test pulse within 16 s") {
    Rig frozen = holding(0.0, 0.0);
    frozen.hold_for(30.0, 800);
    CHECK(frozen.only(PLATE_FROZEN));
    CHECK(bench.counts == 0);
}

TEST_CASE("beads that lag answer late, and less, and frozen ones are found all the same") {
    for (uint16_t lag_ms : {300, 1000}) {
        Rig sound(lag_ms);
        sound.plate_at(30.0);
        sound.step(60);
        sound.answer_hello();
        double face_c = 30.0, bead_c = 30.0;
        for (int i = 0; i < 3000 && !sound.board.faults; i++) {
            if (i % 5 == 0) sound.hold(30.0);
            face_c += pulse_a(sound.board.pulse) * 3.25 * STEP_S;
            bead_c += (face_c - bead_c) * STEP_S / (lag_ms * 0.001);
            sound.a_answers = sound.b_answers = 0.0;
            sound.plate_at(bead_c);
            sound.step();
        }
        CHECK(sound.board.faults == 0);
        CHECK(sound.board.pulse.unanswered == 0);

        Rig frozen(lag_ms);
        frozen.a_answers = frozen.b_answers = 0.0;
        frozen.plate_at(30.0);
        frozen.step(60);
        frozen.answer_hello();
        frozen.hold_for(30.0, 1000);
        CHECK(frozen.only(PLATE_FROZEN));
    }
}

TEST_CASE("beads are read at the turn of a pulse and at its end, up to three ticks later where they lag") {
    const struct { float lag_s; int half; } rows[] = {{0.0f, 4}, {0.3f, 6}, {1.0f, 7}};
    for (const auto& row : rows) {
        Sensors sensors{};
        sensors.lag_s = row.lag_s;
        Pulse pulse{};
        int tick = pulse.ticks = 1;
        pulse.from_c[0] = 99.0f;  // no answer, which would begin again
        for (float middle_c = 0.0f; pulse.ticks; middle_c = pulse.middle_c[0]) {
            sensors.past_c[0][0] = sensors.past_c[1][0] = (float)++tick;
            watch_beads(pulse, sensors, true, false, 0.0f);
            if (tick <= row.half) CHECK(middle_c == 0.0f);
        }
        CHECK(pulse.middle_c[0] == 1.0f + row.half);
        CHECK(tick == 2 * row.half + 1);
        CHECK(pulse.quiet_ms == 9000);  // the next one follows within a second
    }
}

TEST_CASE("a pulse that has no room for minutes stays due") {
    Sensors sensors{};
    Pulse pulse{};
    for (int i = 0; i < 6000; i++) watch_beads(pulse, sensors, false, false, 0.0f);
    CHECK(pulse.quiet_ms == 20000);
}

TEST_CASE("one thermistor that answers does not speak for the other") {
    Rig half = holding(1.0, 0.1);
    half.hold_for(30.0, 800);
    CHECK(half.only(PLATE_FROZEN));
}

TEST_CASE("a host that changes its setpoint whenever a pulse begins delays the fault by seconds only") {
    Rig rig = holding(0.0, 0.0);
    int steps = 0;
    for (; steps < 1500 && !rig.board.faults; steps++) {
        rig.hold(rig.board.pulse.ticks ? 30.4 : 30.0);
        rig.step();
    }
    CHECK(rig.board.faults != 0);
}

TEST_CASE("a pulse leaves the mean current as it was and stays within the limits") {
    Loop loop{};
    start_loop(loop, 30.0f);
    loop.held_a = 0.3f;
    Pulse pulse{};
    double sum = 0.0;
    for (uint8_t tick = 1; tick <= 2 * PULSE_HALF; tick++) {
        pulse.ticks = tick;
        for (int i = 0; i < 5; i++) {
            follow(loop, {30.0f, 30.0f, 25.0f, COOL_LIMIT_A, pulse_a(pulse), true});
            sum += loop.current_a;
            CHECK(loop.current_a <= HEAT_LIMIT_A);
        }
    }
    CHECK(sum / (10 * PULSE_HALF) == doctest::Approx(0.3).epsilon(0.01));
    loop.current_a = HEAT_LIMIT_A - 0.5f * PULSE_A;
    CHECK_FALSE(has_room(loop, 25.0f, COOL_LIMIT_A));
}
