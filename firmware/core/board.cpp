#include "board.h"

#include <math.h>

#include "hal.h"
#include "messages.h"
#include "parameters.h"

namespace plate {
namespace {

bool is_driving(const Board& board) {
    return board.state == State::holding || board.state == State::returning;
}

uint32_t faults_of_reset(uint8_t cause) {
    if (cause & RESET_WATCHDOG) return bit(WATCHDOG);
    if ((cause & RESET_BROWN_OUT) && !(cause & RESET_POWER_ON)) return bit(BROWN_OUT);
    const bool switched_on = cause & RESET_POWER_ON;
    return (cause & RESET_WHILE_DRIVING) && !switched_on ? bit(RESTARTED_DRIVING) : 0;
}

// One bead that is alone is told once: its name replaces what was told before it was known.
void latch(Board& board, uint32_t faults) {
    board.faults |= faults;
    if (board.faults & (bit(PLATE_A_STRAYS) | bit(PLATE_B_STRAYS)))
        board.faults &= ~(bit(PLATE_DISAGREES) | bit(PLATE_FROZEN));
    if (!board.faults) return;
    open_bridge(board);
    start_judging(board.plausibility);
    board.state = State::faulted;
}

const uint16_t WIRES = 0x7e;  // PLATE_A_OPEN to SINK_SHORT
const uint16_t SIGNALS = WIRES | 1 << READING_JUMPS;
const uint32_t TRIPS = bit(OVER_TEMPERATURE) | bit(UNDER_TEMPERATURE) | bit(SINK_HOT);
const uint32_t FOLLOWERS = TRIPS | bit(PLATE_DISAGREES) | bit(PLATE_FROZEN) | bit(RUNAWAY) | bit(WIRED_BACKWARDS) |
                           bit(COOLING_REVERSED) | bit(SINK_IMPLAUSIBLE) | bit(CUT_OUT_BEAD) | bit(PLATE_A_STRAYS) |
                           bit(PLATE_B_STRAYS);

// Returns the causes to latch. A bad wire or a jump of a reading makes other guards see what is not there, in the
// same step or shortly after it; each would tell its own false remedy. Those that follow are left out only while
// another fault is latched, so that the bridge is open, and for no longer than FOLLOWS_MS: a cause that stays is
// latched then. As soon as no fault is latched, every cause counts.
uint32_t root_causes(Board& board) {
    const uint16_t signals = (uint16_t)board.causes & SIGNALS;
    if (signals != board.signals) board.signal_ms = 0;
    else if (board.signal_ms < FOLLOWS_MS) board.signal_ms += STEP_MS;
    board.signals = signals;
    if (!board.faults && !signals) return board.causes;
    uint32_t follow = (uint16_t)board.faults & SIGNALS ? implausible_trips(board.sensors) : 0;
    if (board.signal_ms < FOLLOWS_MS) {
        follow |= FOLLOWERS;
        if ((uint16_t)(board.causes | board.faults) & WIRES) follow |= bit(READING_JUMPS);
    }
    return board.causes & ~follow;
}

void close_bridge(Board& board) {
    board.pulse = Pulse();
    start_loop(board.loop, face_c(board.sensors));
}

void lapse(Board& board) {
    if (board.state != State::holding) return;
    board.ttl_ms = board.ttl_ms > STEP_MS ? board.ttl_ms - STEP_MS : 0;
    if (!board.ttl_ms) rest(board);
}

void finish_return(Board& board) {
    if (board.state != State::returning) return;
    board.returning_ms += STEP_MS;
    const bool arrived = fabsf(plate_c(board.sensors) - NEUTRAL_C) < ARRIVED_C;
    if (arrived || board.returning_ms >= LONGEST_RETURN_MS) open_bridge(board);
}

// Shows the state without a host: steady while driving, blinking while a fault is latched.
void light(const Board& board) {
    const bool blink = hal_uptime_ms() / BLINK_MS % 2 == 0;
    hal_light(board.state == State::faulted ? blink : is_driving(board));
}

void drive(Board& board) {
    if (!is_driving(board)) {
        hal_drive(0);
        return;
    }
    Loop& loop = board.loop;
    loop.limited = 0;
    const float sink_c = board.sensors.now[SINK].c;
    const float goal_c = limited_setpoint(loop, board.setpoint_c, sink_c, heat_is_spent(board.session));
    const float ceiling_a = board.plausibility.cool_ceiling_a;
    const bool is_told = board.lag_ms != LAG_UNKNOWN_MS;
    follow(loop, {goal_c, face_c(board.sensors), sink_c, ceiling_a, pulse_a(board.pulse), is_told});
    hal_drive(loop.counts);
}

uint32_t judge_drive(Board& board, bool grown) {
    if (!is_driving(board)) pause_judging(board.plausibility);
    if (!is_driving(board) || !plate_is_known(board.sensors)) return 0;
    const float goal_c = board.loop.goal_c, error_c = goal_c - plate_c(board.sensors);
    const bool room = has_room(board.loop, board.sensors.now[SINK].c, board.plausibility.cool_ceiling_a);
    return judge(board.plausibility, board.sensors, grown, board.loop.current_a, error_c) |
           watch_beads(board.pulse, board.sensors, grown, room, goal_c);
}

// An open cut-out is no fault while the plate is off: it stays open until its start button is pressed. One that is
// closed and was not proved to let go is a fault when the plate is to be driven, until it opens.
uint32_t cut_out_fault(Board& board, bool is_open) {
    board.cut_out_ms = is_driving(board) && is_open ? board.cut_out_ms + STEP_MS : 0;
    const bool matters = is_driving(board) || (board.faults & bit(CUT_OUT_UNTESTED));
    const uint32_t untested = matters && !is_open && !board.proved_ms ? bit(CUT_OUT_UNTESTED) : 0;
    return untested | (board.cut_out_ms >= CUT_OUT_MS ? bit(CUT_OUT_OPEN) : 0);
}

// Nothing else opens a shorted bridge as early. With an open relay the face is the room's, which is no fault.
uint32_t face_trips(Board& board, bool is_open) {
    const float face = plate_is_known(board.sensors) ? face_c(board.sensors) : NEUTRAL_C;
    const float bead = cut_out_face_c(board.sensors);
    const bool hot = face >= FACE_TRIP_HIGH_C || bead >= FACE_TRIP_HIGH_C;
    const bool cold = face <= FACE_TRIP_LOW_C || bead <= FACE_TRIP_LOW_C;
    board.beyond_ms = !is_open && (hot || cold) ? board.beyond_ms + STEP_MS : 0;
    if (board.beyond_ms < FACE_TRIP_MS) return 0;
    board.beyond_ms = FACE_TRIP_MS;
    return bit(hot ? OVER_TEMPERATURE : UNDER_TEMPERATURE);
}

// The relay holds itself only while it is permitted, and only its button closes it. No leave is given while a fault has
// a cause, and for WITHHELD_MS after that and after a reset. When the button has pulled it in, the leave is withdrawn
// until it is seen open: that proves the transistor and the contact at each start. The button, still pressed, then
// closes it again.
void permit(Board& board, bool is_open) {
    if (board.causes) {
        board.withheld_ms = WITHHELD_MS;
        board.proved_ms = 0;
    } else if (board.withheld_ms) {
        board.withheld_ms -= STEP_MS;
    }
    if (is_open) {
        if (board.is_asked) board.proved_ms = PROOF_LASTS_MS;
        else if (board.proved_ms) board.proved_ms -= STEP_MS;
        board.is_asked = false;
        board.pulled_in_ms = 0;
    } else if (!board.proved_ms && !board.is_asked) {
        board.pulled_in_ms += STEP_MS;
        board.is_asked = board.pulled_in_ms >= PULLED_IN_MS;
    }
    hal_permit_cut_out(!board.withheld_ms && !board.is_asked);
}

void save_state(const Board& board) {
    save(hal_persistent_state(), {board.session, board.faults, board.memory});
}

void set_lag(Board& board, uint16_t lag_ms) {
    board.lag_ms = lag_ms;
    board.sensors.lag_s = (lag_ms == LAG_UNKNOWN_MS ? USUAL_LAG_MS : lag_ms) * 0.001f;
}

void account(Board& board) {
    const bool heating = is_driving(board) && board.loop.target_c > HEAT_ABOVE_C;
    count_step(board.session, hottest_plausible_c(board.sensors), heating);
    count_quiet(board.memory);
    arm(hal_persistent_state(), is_driving(board));
    save_state(board);
}

void report(Board& board) {
    board.telemetry_ms += STEP_MS;
    if (board.telemetry_ms < 1000 / TELEMETRY_HZ) return;
    board.telemetry_ms -= 1000 / TELEMETRY_HZ;
    send_telemetry(board);
}

}  // namespace

void start(Board& board) {
    board = Board();
    start_sensors(board.sensors);
    start_judging(board.plausibility);
    set_lag(board, saved_lag_ms());
    hal_drive(0);
    board.withheld_ms = WITHHELD_MS;
    hal_permit_cut_out(false);
    PersistentState& persistent_state = hal_persistent_state();
    board.reset_cause = hal_reset_cause();
    if (was_driving(persistent_state)) board.reset_cause |= RESET_WHILE_DRIVING;
    Saved saved = Saved();
    if (!(board.reset_cause & RESET_POWER_ON)) restore(persistent_state, saved);
    board.session = saved.session;
    board.memory = saved.memory;
    latch(board, saved.faults | faults_of_reset(board.reset_cause));
    arm(persistent_state, false);
    save_state(board);
}

void step(Board& board, const uint16_t sums[PLACES]) {
    const bool grown = take_readings(board.sensors, sums);
    const bool is_open = hal_cut_out_is_open();
    board.causes = sensor_faults(board.sensors) | judge_drive(board, grown) | cut_out_fault(board, is_open) |
                   face_trips(board, is_open);
    if (dose_is_spent(board.session)) board.causes |= bit(DOSE_SPENT);
    latch(board, root_causes(board));
    permit(board, is_open);
    lapse(board);
    finish_return(board);
    light(board);
    drive(board);
    account(board);
    report(board);
    hal_feed_watchdog();
}

Answer ask(Board& board, int32_t setpoint_mc, uint16_t ttl_ms) {
    if (!board.hello_received) return NEEDS_HELLO;
    if (setpoint_mc < SETPOINT_LOW_MC || setpoint_mc > SETPOINT_HIGH_MC) return RANGE;
    if (ttl_ms < 1 || ttl_ms > MAX_TTL_MS) return TTL;
    if (board.state == State::faulted || !plate_is_known(board.sensors)) return FAULTED;
    if (board.state == State::off) close_bridge(board);
    board.setpoint_c = setpoint_mc * 0.001f;
    board.ttl_ms = ttl_ms;
    board.state = State::holding;
    return OK;
}

void rest(Board& board) {
    if (board.state != State::holding) return;
    board.setpoint_c = NEUTRAL_C;
    board.returning_ms = 0;
    board.state = State::returning;
}

void open_bridge(Board& board) {
    hal_drive(0);
    stop_loop(board.loop);
    board.ttl_ms = 0;
    if (board.state != State::faulted) board.state = State::off;
}

Answer clear(Board& board, uint8_t fault) {
    if (!board.hello_received) return NEEDS_HELLO;
    if (fault >= FAULTS_END || !(board.faults & bit(fault))) return NOT_LATCHED;
    if (board.causes & bit(fault)) return PERSISTS;
    if (!count_clear(board.memory, bit(fault))) return LOCKED;
    board.faults &= ~bit(fault);
    if (!board.faults) board.state = State::off;
    return OK;
}

Answer keep_lag(Board& board, uint16_t lag_ms) {
    if (!board.hello_received) return NEEDS_HELLO;
    if (lag_ms > MAX_LAG_MS) return RANGE;
    if (is_driving(board)) return DRIVING;
    if (lag_ms != board.lag_ms) save_lag(lag_ms);
    set_lag(board, lag_ms);
    return OK;
}

}  // namespace plate
