#include "thermistor.h"

#include <math.h>

#include "limits.h"

namespace plate {

Reading read_thermistor(uint16_t sum, float beta_k) {
    const float share = (sum + 8.0f) / READING_FULL_SCALE;  // a code represents the middle of its step
    if (share < SHORT_BELOW) return {Wire::shorted, false, 0.0f};
    if (share > OPEN_ABOVE) return {Wire::open, false, 0.0f};
    const float log_ratio = logf(share / (1.0f - share));  // of the resistance to the one at 25 degC
    return {Wire::fine, true, 1.0f / (1.0f / 298.15f + log_ratio / beta_k) - 273.15f};
}

}  // namespace plate
