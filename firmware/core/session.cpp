#include "session.h"

#include <math.h>
#include <stddef.h>

#include "frame.h"
#include "limits.h"

namespace plate {
namespace {

const uint16_t ARMED = 0xA51C;
const float COUNTED_FROM_C = 35.0f;  // below it a whole session adds less than 0.001 CEM43

float dose_of_step(float plate_c) {
    if (plate_c < COUNTED_FROM_C) return 0.0f;
    const float halvings = (plate_c - 43.0f) * (plate_c < 43.0f ? 2.0f : 1.0f);
    return expf(halvings * 0.6931472f) * (STEP_S / 60.0f);
}

uint16_t crc_of(const Record& record) {
    uint8_t bytes[sizeof(Saved) + 1];
    const uint8_t* saved = reinterpret_cast<const uint8_t*>(&record.saved);
    for (uint8_t i = 0; i < sizeof(Saved); i++) bytes[i] = saved[i];
    bytes[sizeof(Saved)] = record.turn;
    return crc16(bytes, sizeof bytes);
}

bool is_valid(const Record& record) {
    return record.crc == crc_of(record);
}

// Returns the index of the newest valid record, -1 when there is none.
int8_t newest(const PersistentState& persistent_state) {
    const bool first = is_valid(persistent_state.records[0]), second = is_valid(persistent_state.records[1]);
    if (!first && !second) return -1;
    if (first != second) return second;
    return (uint8_t)(persistent_state.records[0].turn + 1) == persistent_state.records[1].turn;
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

void arm(PersistentState& persistent_state, bool driving) {
    persistent_state.armed = driving ? ARMED : 0;
}

bool was_driving(const PersistentState& persistent_state) {
    return persistent_state.armed == ARMED;
}

void save(PersistentState& persistent_state, const Saved& saved) {
    const int8_t last = newest(persistent_state);
    const uint8_t turn = last < 0 ? 0 : persistent_state.records[last].turn + 1;
    Record& record = persistent_state.records[last == 0];
    record.saved = saved;
    record.turn = turn;
    record.crc = crc_of(record);
}

bool restore(const PersistentState& persistent_state, Saved& saved) {
    const int8_t last = newest(persistent_state);
    if (last < 0) return false;
    saved = persistent_state.records[last].saved;
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
