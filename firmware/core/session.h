// Thermal dose and heating time of a session, saved across resets together with the latched faults.
#pragma once
#include <stdint.h>

namespace plate {

struct Session {
    float dose_cem43;
    float heated_s;
    float rested_s;
};

// Counts one step at a plate of `plate_c`; `heating` when the target is heat.
void count_step(Session& session, float plate_c, bool heating);
bool dose_is_spent(const Session& session);
bool heat_is_spent(const Session& session);

// The faults cleared once and twice recently, and the time since the last clearing.
struct Memory {
    uint32_t cleared_once, cleared_twice;
    uint16_t quiet_ms;
};

// The state that outlives a reset.
struct Saved {
    Session session;
    uint32_t faults;
    Memory memory;
};

struct Record {
    Saved saved;
    uint8_t turn;  // sequence number: the newer of two records has the one after the other's
    uint16_t crc;
};

// Memory that a reset does not clear. There are two records, so that a reset while one is written leaves
// the other intact. The armed word is separate, so that damaged records do not affect it.
struct PersistentState {
    uint16_t armed;
    Record records[2];
};

void arm(PersistentState& persistent_state, bool driving);
bool was_driving(const PersistentState& persistent_state);
void save(PersistentState& persistent_state, const Saved& saved);
// Reads the newest valid record; returns false and changes nothing when there is none.
bool restore(const PersistentState& persistent_state, Saved& saved);

// Counts one clearing of a fault; returns false when it was cleared twice recently.
bool count_clear(Memory& memory, uint32_t fault_bit);
void count_quiet(Memory& memory);

}  // namespace plate
