#include "parameters.h"

#include "frame.h"
#include "hal.h"
#include "limits.h"

namespace plate {
namespace {

const uint8_t CHECKED_BYTES = 2;

}  // namespace

uint16_t saved_lag_ms() {
    uint8_t record[PARAMETER_BYTES];
    hal_read_parameters(record);
    const uint16_t lag_ms = record[0] | (uint16_t)record[1] << 8, crc = record[2] | (uint16_t)record[3] << 8;
    return crc == crc16(record, CHECKED_BYTES) && lag_ms <= MAX_LAG_MS ? lag_ms : LAG_UNKNOWN_MS;
}

void save_lag(uint16_t lag_ms) {
    uint8_t record[PARAMETER_BYTES] = {(uint8_t)lag_ms, (uint8_t)(lag_ms >> 8)};
    const uint16_t crc = crc16(record, CHECKED_BYTES);
    record[2] = (uint8_t)crc;
    record[3] = (uint8_t)(crc >> 8);
    hal_write_parameters(record);
}

}  // namespace plate
