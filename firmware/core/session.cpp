#include "session.h"

#include <math.h>
#include <stddef.h>

#include "frame.h"
#include "limits.h"

namespace plate {
namespace {

const uint16_t ARMED = 0xA51C;
const float COUNTED_FROM_C = 35.0f;  // below, a session adds less than 0.001 CEM43

float dose_of_step(float plate_c) {
    if (plate_c < COUNTED_FROM_C) return 0.0f;
    const float halvings = (plate_c - 43.0f) * (plate_c < 43.0f ? 2.0f : 1.0f);
    return expf(halvings * 0.6931472f) * (STEP_S / 60.0f);
}

uint16_t crc_of(const Record& record) {
    uint8_t bytes[sizeof(Kept) + 1];
    const uint8_t* kept = reinterpret_cast<const uint8_t*>(&record.kept);
    for (uint8_t i = 0; i < sizeof(Kept); i++) bytes[i] = kept[i];
    bytes[sizeof(Kept)] = record.turn;
    return crc16(bytes, sizeof bytes);
}

bool is_valid(const Record& record) {
    return record.crc == crc_of(record);
}

// Index of the newest valid record, -1 when none is.
int8_t newest(const Keepsake& keepsake) {
    const bool first = is_valid(keepsake.records[0]), second = is_valid(keepsake.records[1]);
    if (!first && !second) return -1;
    if (first != second) return second;
    return (uint8_t)(keepsake.records[0].turn + 1) == keepsake.records[1].turn;
}

}  // namespace

void count_step(Session& session, float plate_c, bool heating) {
    session.dose_cem43 += dose_of_step(plate_c);
    if (heating) {
        session.heated_s += STEP_S;
        session.rested_s = 0.0f;
        return;
    }
    session.rested_s += STEP_S;
    if (session.rested_s >= REST_S) session = {0.0f, 0.0f, 0.0f};
}

bool dose_is_spent(const Session& session) {
    return !(session.dose_cem43 < DOSE_LIMIT_CEM43);
}

bool heat_is_spent(const Session& session) {
    return !(session.heated_s < HEAT_LIMIT_S);
}

void arm(Keepsake& keepsake, bool driving) {
    keepsake.armed = driving ? ARMED : 0;
}

bool was_driving(const Keepsake& keepsake) {
    return keepsake.armed == ARMED;
}

void keep(Keepsake& keepsake, const Kept& kept) {
    const int8_t last = newest(keepsake);
    const uint8_t turn = last < 0 ? 0 : keepsake.records[last].turn + 1;
    Record& record = keepsake.records[last == 0];
    record.kept = kept;
    record.turn = turn;
    record.crc = crc_of(record);
}

bool recall(const Keepsake& keepsake, Kept& kept) {
    const int8_t last = newest(keepsake);
    if (last < 0) return false;
    kept = keepsake.records[last].kept;
    return true;
}

bool count_clear(Memory& memory, uint32_t fault_bit) {
    if (memory.cleared_twice & fault_bit) return false;
    memory.cleared_twice |= memory.cleared_once & fault_bit;
    memory.cleared_once |= fault_bit;
    memory.quiet_ms = 0;
    return true;
}

void count_quiet(Memory& memory) {
    memory.quiet_ms += STEP_MS;
    if (memory.quiet_ms < CLEARED_MS) return;
    memory.quiet_ms = 0;
    memory.cleared_once = memory.cleared_twice = 0;
}

}  // namespace plate
