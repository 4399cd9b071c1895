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
    uint8_t bytes[sizeof(Session) + sizeof(uint32_t) + 1];
    const uint8_t* session = reinterpret_cast<const uint8_t*>(&record.session);
    for (uint8_t i = 0; i < sizeof(Session); i++) bytes[i] = session[i];
    for (uint8_t i = 0; i < 4; i++) bytes[sizeof(Session) + i] = (uint8_t)(record.faults >> (8 * i));
    bytes[sizeof(Session) + 4] = record.turn;
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

void keep(Keepsake& keepsake, const Session& session, uint32_t faults) {
    const int8_t last = newest(keepsake);
    const uint8_t turn = last < 0 ? 0 : keepsake.records[last].turn + 1;
    Record& record = keepsake.records[last == 0];
    record.session = session;
    record.faults = faults;
    record.turn = turn;
    record.crc = crc_of(record);
}

bool recall(const Keepsake& keepsake, Session& session, uint32_t& faults) {
    const int8_t last = newest(keepsake);
    if (last < 0) return false;
    session = keepsake.records[last].session;
    faults = keepsake.records[last].faults;
    return true;
}

}  // namespace plate
