#include "sensors.h"

#include <math.h>

#include "protocol.h"

namespace plate {
namespace {

uint32_t wire_faults_of(Wire wire, uint8_t open, uint8_t shorted) {
    return wire == Wire::open ? bit(open) : (wire == Wire::shorted ? bit(shorted) : 0);
}

uint32_t wire_faults(const Sensors& sensors) {
    return wire_faults_of(sensors.now[PLATE_A].wire, PLATE_A_OPEN, PLATE_A_SHORT) |
           wire_faults_of(sensors.now[PLATE_B].wire, PLATE_B_OPEN, PLATE_B_SHORT) |
           wire_faults_of(sensors.now[SINK].wire, SINK_OPEN, SINK_SHORT);
}

// Returns by how much a face is ahead of a reading that lags. Neither a glitch nor a wrong lag can move it far.
float ahead_c(const Sensors& sensors, uint8_t place, float lag_s) {
    const float moved_c = (lag_s + FACE_FILTER_S) * sensors.slope_c_s[place];
    return fminf(fmaxf(moved_c, -MOST_AHEAD_C), MOST_AHEAD_C);
}

float ahead_c(const Sensors& sensors, uint8_t place) {
    return ahead_c(sensors, place, sensors.lag_s);
}

uint32_t trips_of_plate(const Sensors& sensors, bool only_plausible) {
    uint32_t faults = 0;
    for (uint8_t place = PLATE_A; place <= PLATE_B; place++) {
        const Reading& reading = sensors.now[place];
        if (!reading.known || (only_plausible && sensors.implausible_steps[place])) continue;
        const float moved_c = ahead_c(sensors, place);
        if (reading.c + fmaxf(moved_c, 0.0f) >= TRIP_HIGH_C) faults |= bit(OVER_TEMPERATURE);
        if (reading.c + fminf(moved_c, 0.0f) <= TRIP_LOW_C) faults |= bit(UNDER_TEMPERATURE);
    }
    return faults;
}

uint32_t trips(const Sensors& sensors) {
    const Reading& sink = sensors.now[SINK];
    const uint32_t hot = sink.known && sink.c >= SINK_TRIP_C ? bit(SINK_HOT) : 0;
    return hot | trips_of_plate(sensors, false);
}

bool jumped(const Sensors& sensors, uint8_t place, float most_c) {
    const Reading &now = sensors.now[place], &before = sensors.before[place];
    return now.known && before.known && fabsf(now.c - before.c) >= most_c;
}

uint32_t jumps(const Sensors& sensors) {
    const bool any = jumped(sensors, PLATE_A, JUMP_STEP_C) || jumped(sensors, PLATE_B, JUMP_STEP_C) ||
                     jumped(sensors, SINK, JUMP_SINK_STEP_C);
    return any ? bit(READING_JUMPS) : 0;
}

// A wire that touches another for some milliseconds, or a contact that opens, gives a sum in between: a temperature
// that the plate never had. A plate cannot move by JUMP_STEP_C in a step, so a reading that far from the last
// plausible one is not the plate's. After a second without a plausible reading the plate may have moved that far;
// then a reading is plausible again when the other thermistor agrees.
void judge_readings(Sensors& sensors) {
    const float apart_c = fabsf(sensors.now[PLATE_A].c - sensors.now[PLATE_B].c);
    sensors.agree = plate_is_known(sensors) && apart_c < DISAGREE_C;
    for (uint8_t place = PLATE_A; place <= PLATE_B; place++) {
        const Reading& reading = sensors.now[place];
        uint8_t& steps = sensors.implausible_steps[place];
        const bool is_late = steps >= PLAUSIBLE_AGAIN_STEPS;
        const bool is_near = reading.known && fabsf(reading.c - sensors.plausible_c[place]) < JUMP_STEP_C;
        if (is_late ? sensors.agree : is_near) {
            sensors.plausible_c[place] = reading.c;
            steps = 0;
        } else if (!is_late) {
            steps++;
        }
    }
}

bool plate_is_plausible(const Sensors& sensors) {
    return !sensors.implausible_steps[PLATE_A] && !sensors.implausible_steps[PLATE_B];
}

uint32_t disagreement(Sensors& sensors) {
    if (sensors.agree || !plate_is_known(sensors)) sensors.disagree_ms = 0;
    else if (sensors.disagree_ms < DISAGREE_MS) sensors.disagree_ms += STEP_MS;
    return sensors.disagree_ms >= DISAGREE_MS ? bit(PLATE_DISAGREES) : 0;
}

// Returns the range of a plate reading in the past window.
float span_c(const float* past_c) {
    float low = past_c[0], high = past_c[0];
    for (uint8_t i = 1; i <= WINDOW; i++) {
        low = fminf(low, past_c[i]);
        high = fmaxf(high, past_c[i]);
    }
    return high - low;
}

uint32_t freezing(const Sensors& sensors) {
    if (sensors.past_known <= WINDOW) return 0;
    const float a = span_c(sensors.past_c[PLATE_A]), b = span_c(sensors.past_c[PLATE_B]);
    const bool frozen = fminf(a, b) < FROZEN_C && fmaxf(a, b) > FROZEN_OTHER_C;
    return frozen ? bit(PLATE_FROZEN) : 0;
}

const float MOST_LAG_S = MAX_LAG_MS * 0.001f;
const float NOWHERE_C = 1000.0f;

// Widens the band in which the cut-out's bead must read. It and the plate's have any lag up to MOST_LAG_S, so the face
// is between a plate's reading and its estimate for that lag, and a bead forgets where the face was at that rate.
void follow_band(Sensors& sensors) {
    float low_c = NOWHERE_C, high_c = -NOWHERE_C;
    for (uint8_t place = PLATE_A; place <= PLATE_B; place++) {
        const Reading& reading = sensors.now[place];
        if (!reading.known) continue;
        const float ahead = ahead_c(sensors, place, MOST_LAG_S);
        const float low = reading.c + fminf(ahead, 0.0f), high = reading.c + fmaxf(ahead, 0.0f);
        low_c = fminf(low_c, low);
        high_c = fmaxf(high_c, high);
    }
    if (low_c > high_c) return;
    const float share = STEP_S / MOST_LAG_S;
    sensors.low_c = fminf(low_c, sensors.low_c + share * (low_c - sensors.low_c));
    sensors.high_c = fmaxf(high_c, sensors.high_c + share * (high_c - sensors.high_c));
}

uint32_t strange_cut_out(Sensors& sensors) {
    const Reading& bead = sensors.now[CUT_OUT];
    const bool fits = bead.known && bead.c > sensors.low_c - DISAGREE_C && bead.c < sensors.high_c + DISAGREE_C;
    if (fits) sensors.strange_ms = 0;
    else if (sensors.strange_ms < STRANGE_MS) sensors.strange_ms += STEP_MS;
    return sensors.strange_ms >= STRANGE_MS ? bit(CUT_OUT_BEAD) : 0;
}

// Returns the fault of the plate's bead that is alone: the other is where the cut-out's can be, whatever its lag.
uint32_t alone(const Sensors& sensors) {
    const Reading& bead = sensors.now[CUT_OUT];
    if (!bead.known || !plate_is_known(sensors)) return 0;
    const float ahead = ahead_c(sensors, CUT_OUT, MOST_LAG_S);
    float away_c[2];
    for (uint8_t place = PLATE_A; place <= PLATE_B; place++) {
        const float apart_c = sensors.now[place].c - bead.c;
        away_c[place] = fmaxf(fmaxf(fminf(ahead, 0.0f) - apart_c, apart_c - fmaxf(ahead, 0.0f)), 0.0f);
    }
    const float more_c = away_c[PLATE_A] - away_c[PLATE_B];
    if (fabsf(more_c) < STRAY_C) return 0;
    return bit(more_c > 0.0f ? PLATE_A_STRAYS : PLATE_B_STRAYS);
}

const uint32_t OF_ONE = bit(OVER_TEMPERATURE) | bit(UNDER_TEMPERATURE) | bit(PLATE_DISAGREES) | bit(PLATE_FROZEN);

// A movement of one bead alone is told by its name, not by the limit that it happens to pass.
uint32_t named(const Sensors& sensors, uint32_t faults) {
    const bool apart = !sensors.agree || (faults & bit(PLATE_FROZEN));
    const uint32_t strays = apart && (faults & OF_ONE) ? alone(sensors) : 0;
    return strays ? (faults & ~OF_ONE) | strays : faults;
}

// Adds the means over PROGRESS_MS, which have a fifth of the noise power.
void remember(Sensors& sensors) {
    for (uint8_t place = PLATE_A; place <= PLATE_B; place++) {
        float* past_c = sensors.past_c[place];
        for (uint8_t i = WINDOW; i > 0; i--) past_c[i] = past_c[i - 1];
        past_c[0] = sensors.summed_c[place] / (PROGRESS_MS / STEP_MS);
        sensors.summed_c[place] = 0.0f;
    }
    sensors.progress_ms = 0;
    if (sensors.past_known <= WINDOW) sensors.past_known++;
}

// A reading that the plate cannot have had is no movement.
void follow_slope(Sensors& sensors, uint8_t place, bool is_plausible) {
    float& slope_c_s = sensors.slope_c_s[place];
    if (!is_plausible) slope_c_s = 0.0f;
    else slope_c_s += (STEP_S / FACE_FILTER_S) * ((sensors.now[place].c - sensors.before[place].c) / STEP_S - slope_c_s);
}

void forget_past(Sensors& sensors) {
    sensors.past_known = 0;
    sensors.progress_ms = 0;
    sensors.summed_c[PLATE_A] = sensors.summed_c[PLATE_B] = 0.0f;
}

}  // namespace

void start_sensors(Sensors& sensors) {
    sensors = Sensors();
    for (uint8_t& steps : sensors.implausible_steps) steps = PLAUSIBLE_AGAIN_STEPS;
    sensors.low_c = NOWHERE_C;
    sensors.high_c = -NOWHERE_C;
}

bool take_readings(Sensors& sensors, const uint16_t sums[PLACES]) {
    for (uint8_t place = 0; place < PLACES; place++) {
        sensors.before[place] = sensors.now[place];
        sensors.now[place] = read_thermistor(sums[place], place == CUT_OUT ? CUT_OUT_BETA_K : NTC_BETA_K);
    }
    bool was_plausible[2];
    for (uint8_t place = PLATE_A; place <= PLATE_B; place++)
        was_plausible[place] = !sensors.implausible_steps[place];
    judge_readings(sensors);
    for (uint8_t place = PLATE_A; place <= PLATE_B; place++)
        follow_slope(sensors, place, was_plausible[place] && !sensors.implausible_steps[place]);
    follow_slope(sensors, CUT_OUT, sensors.now[CUT_OUT].known && sensors.before[CUT_OUT].known);
    follow_band(sensors);
    if (!plate_is_plausible(sensors)) {
        forget_past(sensors);
        return false;
    }
    for (uint8_t place = PLATE_A; place <= PLATE_B; place++)
        sensors.summed_c[place] += sensors.now[place].c;
    sensors.progress_ms += STEP_MS;
    if (sensors.progress_ms < PROGRESS_MS) return false;
    remember(sensors);
    return true;
}

uint32_t sensor_faults(Sensors& sensors) {
    return wire_faults(sensors) | strange_cut_out(sensors) | jumps(sensors) |
           named(sensors, trips(sensors) | freezing(sensors) | disagreement(sensors));
}

bool plate_is_known(const Sensors& sensors) {
    return sensors.now[PLATE_A].known && sensors.now[PLATE_B].known;
}

float plate_c(const Sensors& sensors) {
    return 0.5f * (sensors.now[PLATE_A].c + sensors.now[PLATE_B].c);
}

float face_c(const Sensors& sensors) {
    return plate_c(sensors) + 0.5f * (ahead_c(sensors, PLATE_A) + ahead_c(sensors, PLATE_B));
}

float cut_out_face_c(const Sensors& sensors) {
    const Reading& bead = sensors.now[CUT_OUT];
    const bool still = sensors.past_known > WINDOW && span_c(sensors.past_c[PLATE_A]) < FROZEN_C &&
                       span_c(sensors.past_c[PLATE_B]) < FROZEN_C;
    return bead.known && still ? bead.c + ahead_c(sensors, CUT_OUT, CUT_OUT_LEAD_S) : NEUTRAL_C;
}

float hottest_plausible_c(const Sensors& sensors) {
    float hottest_c = NEUTRAL_C;  // the dose of anything colder is nothing
    for (uint8_t place = PLATE_A; place <= PLATE_B; place++)
        if (sensors.implausible_steps[place] < PLAUSIBLE_AGAIN_STEPS)
            hottest_c = fmaxf(hottest_c, sensors.plausible_c[place] + fmaxf(ahead_c(sensors, place), 0.0f));
    return hottest_c;
}

uint32_t implausible_trips(const Sensors& sensors) {
    return trips_of_plate(sensors, false) & ~trips_of_plate(sensors, true);
}

float plate_change_c(const Sensors& sensors, uint8_t from, uint8_t to) {
    const float* a = sensors.past_c[PLATE_A];
    const float* b = sensors.past_c[PLATE_B];
    return 0.5f * (a[to] - a[from] + b[to] - b[from]);
}

float plate_span_c(const Sensors& sensors) {
    float low = 0.0f, high = 0.0f;
    for (uint8_t i = 1; i <= WINDOW; i++) {
        const float away_c = plate_change_c(sensors, i, 0);
        low = fminf(low, away_c);
        high = fmaxf(high, away_c);
    }
    return high - low;
}

}  // namespace plate
