"""The defects planted in the safety code, and the test that must catch each. Run by mutate.py.

Each replaces text that occurs once in one file of firmware/; `chip` is a test of this folder on
the simulated chip. tests/defects.py plants those of the core by rule.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Mutation:
    """One defect: its name, the changed file and text, and the test that catches it."""

    name: str
    file: str
    find: str
    replace: str
    chip: str


BOARD, SENSORS, JUDGE = "core/board.cpp", "core/sensors.cpp", "core/plausibility.cpp"
SESSION, MESSAGES, PORT = "core/session.cpp", "core/messages.cpp", "avr/main.cpp"

_FAULT = "test_faults.py::test_a_fault_is_caught_in_time_and_the_skin_is_safe"
_PARTS = "test_pairs.py::test_a_part_of_the_guards_that_failed_unseen_leaves_the_skin_safe"
_HANG = "test_faults.py::test_a_hung_program_is_reset_once_and_stays_off[True]"
_RENEWED = "test_pins.py::test_a_flipped_bit_of_clock_converter_or_line_is_right_again_after_a_step"
_TRUE_ZERO = "test_pins.py::test_off_is_true_zero_after_heating_and_after_cooling"
_FLIPPED = "test_pins.py::test_a_flipped_bit_of_the_bridge_is_right_again_after_a_step"
_OTHER_SIDE = "test_pins.py::test_one_side_of_the_bridge_is_driven_and_the_other_is_let_go"

MUTATIONS = (
    Mutation(
        "another major version leaves the bridge driven",
        MESSAGES,
        "if (!board.hello_received) open_bridge(board);",
        "",
        "test_parity.py::test_the_simulated_board_answers_the_same_bytes_as_the_firmware",
    ),
    Mutation(
        "armed word ignored",
        BOARD,
        "    if (was_driving(persistent_state)) board.reset_cause |= RESET_WHILE_DRIVING;\n",
        "",
        f"{_FAULT}[brown-out, boot loader hides it, hot, warm room]",
    ),
    Mutation(
        "a reset clears the faults",
        BOARD,
        "restore(persistent_state, saved);",
        "(void)restore;",
        "test_resets.py::test_a_fault_whose_cause_has_gone_outlives_a_reset",
    ),
    Mutation("no watchdog", PORT, "    wdt_enable(WDTO_120MS);\n", "", _HANG),
    Mutation(
        "watchdog fed by the clock's interrupt",
        PORT,
        "        uptime_ms++;\n",
        "        uptime_ms++;\n        wdt_reset();\n",
        _HANG,
    ),
    Mutation(
        "watchdog fed by the main loop",
        PORT,
        "        receive_waiting(board);\n",
        "        receive_waiting(board);\n        wdt_reset();\n        ADCSRA |= _BV(ADSC);\n",
        f"{_FAULT}[dead tick, hot, warm room]",
    ),
    Mutation(
        "pins left connected to the timer",
        PORT,
        "    write_bridge(0, 0);\n",
        "    write_bridge(0, TCCR1A & 0xF0);\n",
        _TRUE_ZERO,
    ),
    Mutation(
        "driver left enabled",
        PORT,
        "    write_bridge(0, 0);\n",
        "    write_bridge(ENABLE_PIN, 0);\n",
        _TRUE_ZERO,
    ),
    Mutation(
        "both sides of the bridge driven",
        PORT,
        "counts > 0 ? _BV(COM1A1) : _BV(COM1B1));",
        "_BV(COM1A1) | _BV(COM1B1));",
        _OTHER_SIDE,
    ),
    Mutation(
        "the idle pin's bit left as it is",
        PORT,
        "    PORTB = enable | (PORTB & LIGHT_PIN);\n",
        "    PORTB = enable | (PORTB & (LIGHT_PIN | HEAT_PIN | COOL_PIN));\n",
        f"{_FLIPPED}[38.0]",
    ),
    Mutation(
        "direction of the pins not rewritten",
        PORT,
        "    DDRB = ENABLE_PIN | HEAT_PIN | COOL_PIN | LIGHT_PIN;\n",
        "    if (!enable) DDRB = ENABLE_PIN | HEAT_PIN | COOL_PIN | LIGHT_PIN;\n",
        f"{_FLIPPED}[20.0]",
    ),
    Mutation(
        "a fault does not blink",
        BOARD,
        "board.state == State::faulted ? blink : is_driving(board)",
        "is_driving(board) || (blink && !blink)",
        "test_bare.py::test_a_bare_board_names_what_is_missing_and_blinks",
    ),
    Mutation(
        "conversions in a bunch at the start of a step",
        PORT,
        "    if (++converted < CONVERSIONS) return;\n",
        "    if (++converted < CONVERSIONS) {\n        start_conversion();\n"
        "        return;\n    }\n"
        "    if (converted > CONVERSIONS) return;\n",
        "test_hum.py::test_hum_moves_the_plate_by_less_than_can_be_felt[50.0-18.0]",
    ),
    Mutation(
        "open cut-out unseen",
        BOARD,
        "(board.cut_out_ms >= CUT_OUT_MS ? bit(CUT_OUT_OPEN) : 0)",
        "(board.cut_out_ms >= CUT_OUT_MS ? 0 : 0)",
        f"{_FAULT}[sense wire of the cut-out grounded, hot, warm room]",
    ),
    Mutation(
        "what was judged forgotten at each OFF",
        JUDGE,
        "    if (state.open_ms >= FORGET_MS) start_judging(state);\n",
        "    start_judging(state);\n",
        f"{_FAULT}[both frozen, host off and on, cold, warm room]",
    ),
    Mutation(
        "persistent memory cleared at start",
        PORT,
        'plate::PersistentState persistent_state __attribute__((section(".noinit")));',
        "plate::PersistentState persistent_state;",
        "test_resets.py::test_a_fault_whose_cause_has_gone_outlives_a_reset",
    ),
    Mutation(
        "a welded cut-out unseen",
        BOARD,
        "matters && !is_open && !board.proved_ms ?",
        "matters && !is_open && board.proved_ms > 9999 ?",
        f"{_FAULT}[cut-out welded, hot, warm room]",
    ),
    Mutation(
        "the leave outlives a fault",
        BOARD,
        "        board.withheld_ms = WITHHELD_MS;\n        board.proved_ms = 0;\n",
        "        board.proved_ms = 0;\n",
        f"{_PARTS}[U4 open or Q1 shorted-bridge shorted to cool-situation1]",
    ),
    Mutation(
        "a start without a proof",
        BOARD,
        "board.is_asked = board.pulled_in_ms >= PULLED_IN_MS;",
        "board.proved_ms = PROOF_LASTS_MS;",
        f"{_FAULT}[Q2 shorted, hot, warm room]",
    ),
    Mutation(
        "a strange bead of the cut-out unseen",
        SENSORS,
        "return sensors.strange_ms >= STRANGE_MS ? bit(CUT_OUT_BEAD) : 0;",
        "return 0;",
        "test_causes.py::test_thermistors_that_come_off_together_are_told_by_the_one_that_stayed[1.0]",
    ),
    Mutation(
        "clearing is never locked",
        SESSION,
        "    if (memory.cleared_twice & fault_bit) return false;\n",
        "",
        "test_faults.py::test_clearing_again_and_again_does_not_talk_a_guard_away",
    ),
    Mutation(
        "no test pulse",
        BOARD,
        "           watch_beads(board.pulse, board.sensors, grown, room, goal_c);\n",
        "           (room && goal_c < 0.0f ? bit(PLATE_FROZEN) : 0);\n",
        "test_faults.py::test_beads_that_freeze_at_a_steady_plate_are_found_by_a_test_pulse[36.0]",
    ),
    Mutation(
        "the transmit ring takes bytes it has no room for",
        PORT,
        "(uint8_t)(tx_tail - tx_head - 1) % TX_ROOM",
        "(tx_tail - tx_head - 1) % TX_ROOM",
        "test_line.py::test_a_burst_of_greetings_costs_whole_frames_and_damages_none",
    ),
    Mutation(
        "the step clock set once", PORT, "            set_clock();\n", "", f"{_RENEWED}[OCR0A]"
    ),
    Mutation(
        "the converter set once", PORT, "            set_converter();\n", "", f"{_RENEWED}[DIDR0]"
    ),
    Mutation(
        "the serial line set once",
        PORT,
        "            refresh_serial();\n",
        "            if (tx_head == TX_ROOM) refresh_serial();\n",
        f"{_RENEWED}[UBRR0L]",
    ),
)
