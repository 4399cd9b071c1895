// Converts the sum of 16 conversions to degrees.
#pragma once
#include <stdint.h>

namespace plate {

enum class Wire : uint8_t { fine, open, shorted };

struct Reading {
    Wire wire;
    bool known;  // there is a temperature
    float c;     // only when known
};

Reading read_thermistor(uint16_t sum, float beta_k);

}  // namespace plate
