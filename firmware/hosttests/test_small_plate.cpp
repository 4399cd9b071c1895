// The judge as it is built for the plate of one resistor: in a namespace of its own, beside the usual build.
#include <doctest/doctest.h>

#define ONE_RESISTOR
#define plate small_plate
#include "../core/plausibility.cpp"
#include "../core/sensors.cpp"
#include "../core/thermistor.cpp"

TEST_CASE("a small plate is driven hard from 0.6 of its own limits") {
    CHECK(small_plate::HARD_HEAT_A == doctest::Approx(0.432));
    CHECK(small_plate::HARD_COOL_A == doctest::Approx(0.432));
}
