#include <doctest/doctest.h>

#include <cmath>
#include <cstring>

#include "bench.h"

using namespace plate;

namespace {

double dose_of(double celsius, double minutes) {
    Session session{};
    for (int i = 0; i < std::lround(minutes * 60.0 / STEP_S); i++) count_step(session, (float)celsius, true);
    return session.dose_cem43;
}

PersistentState blank() {
    PersistentState persistent_state;
    std::memset(&persistent_state, 0xA7, sizeof persistent_state);
    return persistent_state;
}

}  // namespace

TEST_CASE("the dose is minutes at 43 degC, halved per degree above, quartered below") {
    CHECK(dose_of(43.0, 1.0) == doctest::Approx(1.0).epsilon(0.001));
    CHECK(dose_of(42.0, 4.0) == doctest::Approx(1.0).epsilon(0.001));
    CHECK(dose_of(44.0, 0.5) == doctest::Approx(1.0).epsilon(0.001));
    CHECK(dose_of(32.0, 10.0) == 0.0);
}

TEST_CASE("15 minutes without heat begin a new session") {
    Session session{1.5f, 800.0f, 0.0f};
    for (int i = 0; i < 44900; i++) count_step(session, 30.0f, false);
    CHECK(session.heated_s == 800.0f);
    for (int i = 0; i < 200; i++) count_step(session, 30.0f, false);
    CHECK(session.heated_s == 0.0f);
    CHECK(session.dose_cem43 == 0.0f);
}

TEST_CASE("a rest broken by heat does not count") {
    Session session{0.0f, 800.0f, 0.0f};
    for (int i = 0; i < 40000; i++) count_step(session, 30.0f, false);
    count_step(session, 30.0f, true);
    for (int i = 0; i < 10000; i++) count_step(session, 30.0f, false);
    CHECK(session.heated_s > 800.0f);
}

TEST_CASE("a dose that is not a number counts as spent") {
    CHECK(dose_is_spent(Session{NAN, 0.0f, 0.0f}));
    CHECK(heat_is_spent(Session{0.0f, NAN, 0.0f}));
}

TEST_CASE("uninitialised RAM restores nothing") {
    const PersistentState persistent_state = blank();
    Saved saved{};
    CHECK_FALSE(restore(persistent_state, saved));
    CHECK_FALSE(was_driving(persistent_state));
}

TEST_CASE("the newest saved record is restored, however often state was saved") {
    PersistentState persistent_state = blank();
    for (int i = 0; i < 600; i++) {
        save(persistent_state, Saved{Session{0.0f, (float)i, 0.0f}, (uint32_t)i, Memory{0, 0, (uint16_t)i}});
        Saved saved{};
        REQUIRE(restore(persistent_state, saved));
        REQUIRE(saved.session.heated_s == (float)i);
        REQUIRE(saved.faults == (uint32_t)i);
        REQUIRE(saved.memory.quiet_ms == i);
    }
}

TEST_CASE("a reset during a write loses at most one step") {
    PersistentState persistent_state = blank();
    save(persistent_state, Saved{Session{0.1f, 10.0f, 0.0f}, 2, Memory{}});
    save(persistent_state, Saved{Session{0.2f, 20.0f, 0.0f}, 4, Memory{}});
    for (Record& record : persistent_state.records) {
        PersistentState torn = persistent_state;
        Record& half = torn.records[&record - persistent_state.records];
        half.saved.session.heated_s += 1.0f;
        Saved saved{};
        REQUIRE(restore(torn, saved));
        CHECK(saved.session.heated_s >= 10.0f);
    }
}

TEST_CASE("two clearings are counted for each fault by itself, and forgotten after a minute of quiet") {
    Memory memory{};
    CHECK(count_clear(memory, 2));
    CHECK(count_clear(memory, 2));
    CHECK(count_clear(memory, 4));
    CHECK_FALSE(count_clear(memory, 2));
    for (int i = 0; i < CLEARED_MS / STEP_MS - 1; i++) count_quiet(memory);
    CHECK_FALSE(count_clear(memory, 2));
    count_quiet(memory);
    CHECK(count_clear(memory, 2));
}
