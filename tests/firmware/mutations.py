"""The defects planted in the safety code, and the test that must catch each. Run by mutate.py.

Each replaces text that occurs once in one file of firmware/. `host` is a test case of
firmware/hosttests (`*` from its first comma on), `chip` a test of this folder on the chip;
a defect of the core has the first, one of the port the second.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Mutation:
    """One defect: its name, the changed file and text, and the tests that catch it."""

    name: str
    file: str
    find: str
    replace: str
    host: str = ""
    chip: str = ""


BOARD, SENSORS, LOOP = "core/board.cpp", "core/sensors.cpp", "core/loop.cpp"
JUDGE, SESSION, FRAME = "core/plausibility.cpp", "core/session.cpp", "core/frame.cpp"
THERMISTOR, MESSAGES, PORT = "core/thermistor.cpp", "core/messages.cpp", "avr/main.cpp"
PULSE = "core/pulse.cpp"

_FAULT = "test_faults.py::test_a_fault_is_caught_in_time_and_the_skin_is_safe"
_HANG = "test_faults.py::test_a_hung_program_is_reset_once_and_stays_off[True]"
_RENEWED = "test_pins.py::test_a_flipped_bit_of_clock_converter_or_line_is_right_again_after_a_step"
_TRUE_ZERO = "test_pins.py::test_off_is_true_zero_after_heating_and_after_cooling"
_FLIPPED = "test_pins.py::test_a_flipped_bit_of_the_bridge_is_right_again_after_a_step"
_OTHER_SIDE = "test_pins.py::test_one_side_of_the_bridge_is_driven_and_the_other_is_let_go"

MUTATIONS = (
    Mutation(
        "open thermistor read as a temperature",
        THERMISTOR,
        "    if (share > OPEN_ABOVE) return {Wire::open, false, 0.0f};\n",
        "",
        "the rails of the converter are wire faults*",
    ),
    Mutation(
        "shorted thermistor read as a temperature",
        THERMISTOR,
        "    if (share < SHORT_BELOW) return {Wire::shorted, false, 0.0f};\n",
        "",
        "the rails of the converter are wire faults*",
    ),
    Mutation(
        "wire faults of the sink unwatched",
        SENSORS,
        "wire_faults_of(sensors.now[SINK].wire, SINK_OPEN, SINK_SHORT)",
        "0",
        "each wire has its own two faults*",
    ),
    Mutation(
        "no over-temperature",
        SENSORS,
        "if (reading.c + fmaxf(moved_c, 0.0f) >= TRIP_HIGH_C)",
        "if (false)",
        "either plate thermistor trips at 43 and at 13 degC",
    ),
    Mutation(
        "no under-temperature",
        SENSORS,
        "if (reading.c + fminf(moved_c, 0.0f) <= TRIP_LOW_C)",
        "if (false)",
        "either plate thermistor trips at 43 and at 13 degC",
    ),
    Mutation(
        "second plate thermistor does not trip",
        SENSORS,
        "uint32_t faults = 0;\n    for (uint8_t place = PLATE_A; place <= PLATE_B; place++) {",
        "uint32_t faults = 0;\n    for (uint8_t place = PLATE_A; place < PLATE_B; place++) {",
        "either plate thermistor trips at 43 and at 13 degC",
    ),
    Mutation(
        "sink temperature unwatched",
        SENSORS,
        "sink.known && sink.c >= SINK_TRIP_C ?",
        "false ?",
        "a sink of 44 degC trips",
    ),
    Mutation(
        "jumps accepted",
        SENSORS,
        "return any ? bit(READING_JUMPS) : 0;",
        "return any ? 0 : 0;",
        "a reading that changes faster than a plate can is a fault of its own",
    ),
    Mutation(
        "cross-check of the plate thermistors dropped",
        SENSORS,
        "return sensors.disagree_ms >= DISAGREE_MS ? bit(PLATE_DISAGREES) : 0;",
        "return 0;",
        "two plate thermistors apart by 1.6 degC for 300 ms are a fault*",
    ),
    Mutation(
        "frozen thermistor not detected",
        SENSORS,
        "return frozen ? bit(PLATE_FROZEN) : 0;",
        "return frozen ? 0 : 0;",
        "a thermistor that stands still while the other moves is named frozen",
    ),
    Mutation(
        "standing still under heat is not a runaway",
        JUDGE,
        "    if (stands_still(state, sensors, drive)) return bit(RUNAWAY);\n",
        "    (void)stands_still;\n",
        "a plate that stands still under a second of heat or cold is a runaway",
    ),
    Mutation(
        "drifting under heat is not a runaway",
        JUDGE,
        "    if (!has_stalled(state, along_c, drive.power_w)) return 0;\n",
        "    if (!has_stalled(state, along_c, 0.0f)) return 0;\n",
        "a plate that drifts without following is a runaway after some seconds",
    ),
    Mutation(
        "module wired backwards not detected",
        JUDGE,
        "    if (runs_backwards(state, along_c, late_c)) return backwards_fault(state);\n",
        "    (void)runs_backwards, (void)late_c;\n",
        "a plate that moves in the wrong direction is wired backwards",
    ),
    Mutation(
        "no back-off when cooling reverses",
        JUDGE,
        "    state.cool_ceiling_a = REVERSED_BACK_OFF * -current_a;\n",
        "    (void)current_a;\n",
        "more cooling and a warmer plate*",
    ),
    Mutation(
        "reversed cooling never raises a fault",
        JUDGE,
        "return ++state.strikes >= REVERSED_STRIKES ? bit(COOLING_REVERSED) : 0;",
        "return ++state.strikes >= REVERSED_STRIKES ? 0 : 0;",
        "more cooling and a warmer plate*",
    ),
    Mutation(
        "blind sink not detected",
        JUDGE,
        "    return bit(SINK_IMPLAUSIBLE);\n",
        "    return 0;\n",
        "a sink that takes heat without its reading moving is not being read",
    ),
    Mutation(
        "faults not latched",
        BOARD,
        "    board.faults |= faults;\n    if (!board.faults) return;\n",
        "    board.faults = faults;\n"
        "    if (!faults && board.state == State::faulted) board.state = State::off;\n"
        "    if (!faults) return;\n",
        "a fault stays when its cause has gone*",
    ),
    Mutation(
        "bridge left closed on a fault",
        BOARD,
        "    open_bridge(board);\n    start_judging(board.plausibility);\n"
        "    board.state = State::faulted;\n",
        "    (void)board;\n",
        "the bridge opens in the step that sees the fault",
    ),
    Mutation(
        "clearing one fault clears all",
        BOARD,
        "    board.faults &= ~bit(fault);\n",
        "    board.faults = 0;\n",
        "clearing is by number: the others stay",
    ),
    Mutation(
        "clearing a fault whose cause persists",
        BOARD,
        "    if (board.causes & bit(fault)) return PERSISTS;\n",
        "",
        "clearing is refused while the cause persists",
    ),
    Mutation(
        "clearing switches on again",
        BOARD,
        "    if (!board.faults) board.state = State::off;\n",
        "    if (!board.faults) board.state = State::holding;\n",
        "clearing switches nothing on",
    ),
    Mutation(
        "setpoints taken while faulted",
        BOARD,
        "if (board.state == State::faulted || !plate_is_known(board.sensors)) return FAULTED;",
        "if (!plate_is_known(board.sensors)) return FAULTED;",
        "a fault stays when its cause has gone*",
    ),
    Mutation(
        "no dead-man: a setpoint never lapses",
        BOARD,
        "board.ttl_ms > STEP_MS ? board.ttl_ms - STEP_MS : 0;",
        "board.ttl_ms;",
        "a setpoint is held for its time to live*",
    ),
    Mutation(
        "a return to neutral without end",
        BOARD,
        "if (arrived || board.returning_ms >= LONGEST_RETURN_MS)",
        "if (arrived)",
        "a return that never arrives ends after 10 s",
    ),
    Mutation(
        "setpoint range unchecked",
        BOARD,
        "    if (setpoint_mc < SETPOINT_LOW_MC || setpoint_mc > SETPOINT_HIGH_MC) return RANGE;\n",
        "",
        "setpoints outside the range are refused*",
    ),
    Mutation(
        "time to live unchecked",
        BOARD,
        "    if (ttl_ms < 1 || ttl_ms > MAX_TTL_MS) return TTL;\n",
        "",
        "a time to live of nothing or of more than a second is refused",
    ),
    Mutation(
        "no HELLO needed",
        BOARD,
        "    if (!board.hello_received) return NEEDS_HELLO;\n    if (setpoint_mc",
        "    if (setpoint_mc",
        "no setpoint is held before a HELLO*",
    ),
    Mutation(
        "another major version accepted",
        MESSAGES,
        "board.hello_received = major == PROTOCOL_MAJOR;",
        "board.hello_received = major || true;",
        "another major version is refused with a HELLO_REPLY*",
    ),
    Mutation(
        "another major version leaves the bridge driven",
        MESSAGES,
        "if (!board.hello_received) open_bridge(board);",
        "",
        "another major version is refused with a HELLO_REPLY*",
        "test_parity.py::test_the_simulated_board_answers_the_same_bytes_as_the_firmware",
    ),
    Mutation(
        "payload sizes unchecked",
        MESSAGES,
        "const bool fits = board.decoder.count == 2 + size;",
        "const bool fits = board.decoder.count >= 2;",
        "payloads of a wrong size and unknown types are refused and counted",
    ),
    Mutation(
        "CRC ignored",
        FRAME,
        "    if (crc16(decoder.bytes, content) != sent) return Received::garbage;\n",
        "    (void)sent;\n",
        "no frame with one bit wrong passes*",
    ),
    Mutation(
        "endless frames overwrite memory",
        FRAME,
        "        if (decoder.count < MAX_WIRE - 1)\n",
        "        if (decoder.count < 255)\n",
        "an endless frame is dropped whole",
    ),
    Mutation(
        "caps of the current dropped",
        LOOP,
        "const float given_a = clamp(wanted_a, -most_cool_a, HEAT_LIMIT_A);",
        "const float given_a = wanted_a;\n    (void)most_cool_a;",
        "a target that the current cannot reach waits for the plate and reports it",
    ),
    Mutation(
        "caps of the output dropped",
        LOOP,
        "clamp(floorf(exact + 0.5f), -COOL_CAP_COUNTS, HEAT_CAP_COUNTS);",
        "floorf(exact + 0.5f);",
        "no error and no time take the output beyond its caps",
    ),
    Mutation(
        "slew limit dropped",
        LOOP,
        "step_c = clamp(away_c, -SLEW_COOL_C_STEP, SLEW_HEAT_C_STEP);",
        "step_c = away_c;",
        "the target never moves faster than 12 degC/s*",
    ),
    Mutation(
        "the integral winds up",
        LOOP,
        "    if (!loop.saturated || (error_c > 0.0f) != (wanted_a > 0.0f))\n",
        "",
        "the integral does not wind up: minutes at the limit are forgotten in a second",
    ),
    Mutation(
        "a warm sink keeps its cooling",
        LOOP,
        "share > 0.0f ? COOL_LIMIT_A * (1.0f - share) : cool_limit_a(loop));",
        "cool_limit_a(loop));",
        "a warm sink reduces cooling step by step*",
    ),
    Mutation(
        "a burst that does not end",
        LOOP,
        "    loop.store_v += STEP_S * fmaxf(filling, -STORE_EMPTIES * loop.store_v);",
        "    loop.store_v += 0.0f * filling;",
        "cooling begins with 3 A and ends its burst by itself at 2 A",
    ),
    Mutation(
        "an opened bridge forgets the store",
        LOOP,
        "    loop.store_v = store_v;\n",
        "    (void)store_v;\n",
        "a full store gives no second burst before it has emptied*",
    ),
    Mutation(
        "the end of a burst looks like a loop that eases",
        JUDGE,
        "    current_a = fmaxf(current_a, -COOL_LIMIT_A);\n",
        "",
        "the end of a burst of cooling does not look like a loop that eases",
    ),
    Mutation(
        "hot trips by the reading alone",
        SENSORS,
        "if (reading.c + fmaxf(moved_c, 0.0f) >= TRIP_HIGH_C)",
        "if (reading.c >= TRIP_HIGH_C)",
        "either the reading or the estimate trips*",
    ),
    Mutation(
        "the estimate ignores the lag",
        SENSORS,
        "(sensors.lag_s + FACE_FILTER_S) * sensors.slope_c_s[place]",
        "FACE_FILTER_S * sensors.slope_c_s[place]",
        "the face is ahead of a moving bead*",
    ),
    Mutation(
        "a glitch carries the estimate away",
        SENSORS,
        "return fminf(fmaxf(moved_c, -MOST_AHEAD_C), MOST_AHEAD_C);",
        "return moved_c;",
        "a glitch that is no jump*",
    ),
    Mutation(
        "a lag is taken while driving",
        BOARD,
        "    if (is_driving(board)) return DRIVING;\n",
        "",
        "the lag of the beads is kept for good*",
    ),
    Mutation(
        "a damaged lag is believed",
        "core/parameters.cpp",
        "crc == crc16(record, CHECKED_BYTES) && lag_ms",
        "crc == crc && lag_ms",
        "a lag that was never saved or is damaged*",
    ),
    Mutation(
        "dose ignored",
        BOARD,
        "    if (dose_is_spent(board.session)) board.causes |= bit(DOSE_SPENT);\n",
        "",
        "a spent dose latches*",
    ),
    Mutation(
        "heat time ignored",
        SESSION,
        "return !(session.heated_s < HEAT_LIMIT_S);",
        "return !(session.heated_s == session.heated_s);",
        "15 minutes of heat are all a session gets*",
    ),
    Mutation(
        "dose of the cooler thermistor",
        SENSORS,
        "fmaxf(hottest_c, sensors.plausible_c[place] + fmaxf(",
        "fmaxf(0.0f, sensors.plausible_c[PLATE_A] + fmaxf(",
        "the dose is counted from the hotter plate thermistor*",
    ),
    Mutation(
        "dose of a reading that the plate never had",
        SENSORS,
        "if (is_late ? sensors.agree : is_near) {",
        "if (is_late ? sensors.agree : is_near || reading.known) {",
        "a bad contact of up to 0.1 s adds no dose*",
    ),
    Mutation(
        "dose stops while one thermistor is bad",
        SENSORS,
        "        if (sensors.implausible_steps[place] < PLAUSIBLE_AGAIN_STEPS)\n",
        "        if (plate_is_plausible(sensors))\n",
        "the dose of a hot plate is counted while one thermistor is bad",
    ),
    Mutation(
        "consequences of a bad wire latched beside it",
        BOARD,
        "    return board.causes & ~follow;\n",
        "    return board.causes & ~(follow & 0);\n",
        "a bad contact of up to 0.1 s adds no dose*",
    ),
    Mutation(
        "faults beside a bad wire never latched",
        BOARD,
        "    if (board.signal_ms < FOLLOWS_MS) {\n",
        "    if (true) {\n",
        "a plate that is really too hot is named 0.1 s after*",
    ),
    Mutation(
        "thermistors that came off told as reversed wires",
        JUDGE,
        "    if (along_c >= FOLLOWED_C) state.followed = true;\n",
        "",
        "a plate that followed and then seems to cool*",
    ),
    Mutation(
        "armed word ignored",
        BOARD,
        "    if (was_driving(persistent_state)) board.reset_cause |= RESET_WHILE_DRIVING;\n",
        "",
        "every kind of reset but power-on is a fault when it should be",
        f"{_FAULT}[brown-out, boot loader hides it, hot, warm room]",
    ),
    Mutation(
        "a reset clears the faults",
        BOARD,
        "restore(persistent_state, saved);",
        "(void)restore;",
        "a reset clears no fault*",
        "test_resets.py::test_a_fault_whose_cause_has_gone_outlives_a_reset",
    ),
    Mutation(
        "saved state trusted without its CRC",
        SESSION,
        "return record.crc == crc_of(record);",
        "return record.crc == record.crc || crc_of(record);",
        "uninitialised RAM restores nothing",
    ),
    Mutation(
        "brown-out ignored",
        BOARD,
        "return bit(BROWN_OUT);",
        "return 0;",
        "every kind of reset but power-on is a fault when it should be",
    ),
    Mutation("no watchdog", PORT, "    wdt_enable(WDTO_120MS);\n", "", chip=_HANG),
    Mutation(
        "watchdog fed by the clock's interrupt",
        PORT,
        "        uptime_ms++;\n",
        "        uptime_ms++;\n        wdt_reset();\n",
        chip=_HANG,
    ),
    Mutation(
        "watchdog fed by the main loop",
        PORT,
        "        receive_waiting(board);\n",
        "        receive_waiting(board);\n        wdt_reset();\n        ADCSRA |= _BV(ADSC);\n",
        chip=f"{_FAULT}[dead tick, hot, warm room]",
    ),
    Mutation(
        "pins left connected to the timer",
        PORT,
        "    write_bridge(0, 0);\n",
        "    write_bridge(0, TCCR1A & 0xF0);\n",
        chip=_TRUE_ZERO,
    ),
    Mutation(
        "driver left enabled",
        PORT,
        "    write_bridge(0, 0);\n",
        "    write_bridge(ENABLE_PIN, 0);\n",
        chip=_TRUE_ZERO,
    ),
    Mutation(
        "both sides of the bridge driven",
        PORT,
        "counts > 0 ? _BV(COM1A1) : _BV(COM1B1));",
        "_BV(COM1A1) | _BV(COM1B1));",
        chip=_OTHER_SIDE,
    ),
    Mutation(
        "the idle pin's bit left as it is",
        PORT,
        "    PORTB = enable | (PORTB & LIGHT_PIN);\n",
        "    PORTB = enable | (PORTB & (LIGHT_PIN | HEAT_PIN | COOL_PIN));\n",
        chip=f"{_FLIPPED}[38.0]",
    ),
    Mutation(
        "direction of the pins not rewritten",
        PORT,
        "    DDRB = ENABLE_PIN | HEAT_PIN | COOL_PIN | LIGHT_PIN;\n",
        "    if (!enable) DDRB = ENABLE_PIN | HEAT_PIN | COOL_PIN | LIGHT_PIN;\n",
        chip=f"{_FLIPPED}[20.0]",
    ),
    Mutation(
        "a fault does not blink",
        BOARD,
        "board.state == State::faulted ? blink : is_driving(board)",
        "is_driving(board) || (blink && !blink)",
        "the light is steady while driving*",
        "test_bare.py::test_a_bare_board_names_what_is_missing_and_blinks",
    ),
    Mutation(
        "conversions in a bunch at the start of a step",
        PORT,
        "    if (++converted < CONVERSIONS) return;\n",
        "    if (++converted < CONVERSIONS) {\n        start_conversion();\n"
        "        return;\n    }\n"
        "    if (converted > CONVERSIONS) return;\n",
        chip="test_hum.py::test_hum_moves_the_plate_by_less_than_can_be_felt[50.0-18.0]",
    ),
    Mutation(
        "open cut-out unseen",
        BOARD,
        "(board.cut_out_ms >= CUT_OUT_MS ? bit(CUT_OUT_OPEN) : 0)",
        "(board.cut_out_ms >= CUT_OUT_MS ? 0 : 0)",
        "an open cut-out is a fault of its own*",
        f"{_FAULT}[sense wire of the cut-out grounded, hot, warm room]",
    ),
    Mutation(
        "what was judged forgotten at each OFF",
        JUDGE,
        "    if (state.open_ms >= FORGET_MS) start_judging(state);\n",
        "    start_judging(state);\n",
        "bursts too short for a window are judged together*",
        f"{_FAULT}[both frozen, host off and on, cold, warm room]",
    ),
    Mutation(
        "frames without a leading zero",
        MESSAGES,
        "uint8_t wire[1 + MAX_WIRE] = {0};",
        "uint8_t wire[1 + MAX_WIRE] = {1};",
        "each frame begins with a zero*",
    ),
    Mutation(
        "persistent memory cleared at start",
        PORT,
        'plate::PersistentState persistent_state __attribute__((section(".noinit")));',
        "plate::PersistentState persistent_state;",
        chip="test_resets.py::test_a_fault_whose_cause_has_gone_outlives_a_reset",
    ),
    Mutation(
        "a welded cut-out unseen",
        BOARD,
        "    return matters && !board.memory.cut_out_tested ? bit(CUT_OUT_UNTESTED) : 0;\n",
        "    return matters && board.faults ? 0 : 0;\n",
        "a cut-out that was never seen open*",
        f"{_FAULT}[cut-out welded, hot, warm room]",
    ),
    Mutation(
        "the test of the cut-out outlives a power cut",
        BOARD,
        "    board.memory = saved.memory;\n",
        "    board.memory = saved.memory;\n    board.memory.cut_out_tested = 1;\n",
        "the test of the cut-out outlives a reset by the port*",
    ),
    Mutation(
        "clearing is never locked",
        SESSION,
        "    if (memory.cleared_twice & fault_bit) return false;\n",
        "",
        "the third clearing of a fault within a minute*",
        "test_faults.py::test_clearing_again_and_again_does_not_talk_a_guard_away",
    ),
    Mutation(
        "clearings forgotten by a reset",
        BOARD,
        "    board.memory = saved.memory;\n",
        "    board.memory.cut_out_tested = saved.memory.cut_out_tested;\n",
        "the third clearing of a fault within a minute*",
    ),
    Mutation(
        "no test pulse",
        BOARD,
        "           watch_beads(board.pulse, board.sensors, grown, room, goal_c);\n",
        "           (room && goal_c < 0.0f ? bit(PLATE_FROZEN) : 0);\n",
        "thermistors frozen at the same value are found*",
        "test_faults.py::test_beads_that_freeze_at_a_steady_plate_are_found_by_a_test_pulse[36.0]",
    ),
    Mutation(
        "one thermistor answers for both",
        PULSE,
        "answer_c) answered = false;",
        "answer_c && which == 0) answered = false;",
        "one thermistor that answers does not speak for the other",
    ),
    Mutation(
        "a changing goal postpones the test pulse forever",
        PULSE,
        " || pulse.broken_off >= PULSES_BROKEN_OFF",
        "",
        "a host that changes its setpoint whenever a pulse begins*",
    ),
    Mutation(
        "the loop works against the test pulse",
        LOOP,
        "    if (course.pulse_a != 0.0f) return",
        "    if (course.pulse_a > 1e9f) return",
        "a pulse leaves the mean current*",
    ),
    Mutation(
        "the transmit ring takes bytes it has no room for",
        PORT,
        "(uint8_t)(tx_tail - tx_head - 1) % TX_ROOM",
        "(tx_tail - tx_head - 1) % TX_ROOM",
        chip="test_line.py::test_a_burst_of_greetings_costs_whole_frames_and_damages_none",
    ),
    Mutation(
        "the step clock set once",
        PORT,
        "            set_clock();\n",
        "",
        chip=f"{_RENEWED}[OCR0A]",
    ),
    Mutation(
        "the converter set once",
        PORT,
        "            set_converter();\n",
        "",
        chip=f"{_RENEWED}[DIDR0]",
    ),
    Mutation(
        "the serial line set once",
        PORT,
        "            refresh_serial();\n",
        "            if (tx_head == TX_ROOM) refresh_serial();\n",
        chip=f"{_RENEWED}[UBRR0L]",
    ),
)
