// What the skin has had: dose and heat of a session, kept across resets together with the latched faults.
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

// Which faults were cleared once and twice of late, for how long nothing was cleared, and whether the cut-out
// was seen open since the power came: a relay whose contacts are welded together never is.
struct Memory {
    uint32_t cleared_once, cleared_twice;
    uint16_t quiet_ms;
    uint16_t cut_out_tested;
};

// What outlives a reset.
struct Kept {
    Session session;
    uint32_t faults;
    Memory memory;
};

struct Record {
    Kept kept;
    uint8_t turn;  // the newer of two records has the turn after the other's
    uint16_t crc;
};

// Memory that a reset leaves alone. Two records, so that a reset amid writing one leaves the other;
// the word apart from them, so that it holds whatever happens to them.
struct Keepsake {
    uint16_t armed;
    Record records[2];
};

void arm(Keepsake& keepsake, bool driving);
bool was_driving(const Keepsake& keepsake);
void keep(Keepsake& keepsake, const Kept& kept);
// Fills in what was kept; false when nothing valid was, and then touches nothing.
bool recall(const Keepsake& keepsake, Kept& kept);

// Counts one clearing of a fault; false when it was cleared twice of late.
bool count_clear(Memory& memory, uint32_t fault_bit);
void count_quiet(Memory& memory);

}  // namespace plate
