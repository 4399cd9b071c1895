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

Keepsake blank() {
    Keepsake keepsake;
    std::memset(&keepsake, 0xA7, sizeof keepsake);
    return keepsake;
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

TEST_CASE("a dose that is no number counts as spent") {
    CHECK(dose_is_spent(Session{NAN, 0.0f, 0.0f}));
    CHECK(heat_is_spent(Session{0.0f, NAN, 0.0f}));
}

TEST_CASE("RAM as it comes up recalls nothing") {
    const Keepsake keepsake = blank();
    Kept kept{};
    CHECK_FALSE(recall(keepsake, kept));
    CHECK_FALSE(was_driving(keepsake));
}

TEST_CASE("the newest of what was kept is recalled, however often it was kept") {
    Keepsake keepsake = blank();
    for (int i = 0; i < 600; i++) {
        keep(keepsake, Kept{Session{0.0f, (float)i, 0.0f}, (uint32_t)i, Memory{0, 0, (uint16_t)i, 1}});
        Kept kept{};
        REQUIRE(recall(keepsake, kept));
        REQUIRE(kept.session.heated_s == (float)i);
        REQUIRE(kept.faults == (uint32_t)i);
        REQUIRE(kept.memory.quiet_ms == i);
    }
}

TEST_CASE("a reset amid writing loses one step at most") {
    Keepsake keepsake = blank();
    keep(keepsake, Kept{Session{0.1f, 10.0f, 0.0f}, 2, Memory{}});
    keep(keepsake, Kept{Session{0.2f, 20.0f, 0.0f}, 4, Memory{}});
    for (Record& record : keepsake.records) {
        Keepsake torn = keepsake;
        Record& half = torn.records[&record - keepsake.records];
        half.kept.session.heated_s += 1.0f;
        Kept kept{};
        REQUIRE(recall(torn, kept));
        CHECK(kept.session.heated_s >= 10.0f);
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
