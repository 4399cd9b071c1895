"""The defects planted in the firmware's port, and the test that must catch each. Run by mutate.py.

Each replaces text that occurs once in firmware/avr/main.cpp; `chip` is a test of this folder on
the simulated chip. tests/defects.py plants those of the core by rule.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Mutation:
    """One defect: its name, the changed text, and the test that catches it."""

    name: str
    find: str
    replace: str
    chip: str


_FAULT = "test_faults.py::test_a_fault_is_caught_in_time_and_the_skin_is_safe"
_HANG = "test_faults.py::test_a_hung_program_is_reset_once_and_stays_off[True]"
_RENEWED = "test_pins.py::test_a_flipped_bit_of_clock_converter_or_line_is_right_again_after_a_step"
_TRUE_ZERO = "test_pins.py::test_off_is_true_zero_after_heating_and_after_cooling"
_FLIPPED = "test_pins.py::test_a_flipped_bit_of_the_bridge_is_right_again_after_a_step"
_OTHER_SIDE = "test_pins.py::test_one_side_of_the_bridge_is_driven_and_the_other_is_let_go"

MUTATIONS = (
    Mutation("no watchdog", "    wdt_enable(WDTO_120MS);\n", "", _HANG),
    Mutation(
        "watchdog fed by the clock's interrupt",
        "        uptime_ms++;\n",
        "        uptime_ms++;\n        wdt_reset();\n",
        _HANG,
    ),
    Mutation(
        "watchdog fed by the main loop",
        "        receive_waiting(board);\n",
        "        receive_waiting(board);\n        wdt_reset();\n        ADCSRA |= _BV(ADSC);\n",
        f"{_FAULT}[dead tick, hot, warm room]",
    ),
    Mutation(
        "pins left connected to the timer",
        "    write_bridge(0, 0);\n",
        "    write_bridge(0, TCCR1A & 0xF0);\n",
        _TRUE_ZERO,
    ),
    Mutation(
        "driver left enabled",
        "    write_bridge(0, 0);\n",
        "    write_bridge(ENABLE_PIN, 0);\n",
        _TRUE_ZERO,
    ),
    Mutation(
        "both sides of the bridge driven",
        "counts > 0 ? _BV(COM1A1) : _BV(COM1B1));",
        "_BV(COM1A1) | _BV(COM1B1));",
        _OTHER_SIDE,
    ),
    Mutation(
        "the idle pin's bit left as it is",
        "    PORTB = enable | (PORTB & LIGHT_PIN);\n",
        "    PORTB = enable | (PORTB & (LIGHT_PIN | HEAT_PIN | COOL_PIN));\n",
        f"{_FLIPPED}[38.0]",
    ),
    Mutation(
        "direction of the pins not rewritten",
        "    DDRB = ENABLE_PIN | HEAT_PIN | COOL_PIN | LIGHT_PIN;\n",
        "    if (!enable) DDRB = ENABLE_PIN | HEAT_PIN | COOL_PIN | LIGHT_PIN;\n",
        f"{_FLIPPED}[20.0]",
    ),
    Mutation(
        "conversions in a bunch at the start of a step",
        "    if (++converted < CONVERSIONS) return;\n",
        "    if (++converted < CONVERSIONS) {\n        start_conversion();\n"
        "        return;\n    }\n"
        "    if (converted > CONVERSIONS) return;\n",
        "test_hum.py::test_hum_moves_the_plate_by_less_than_can_be_felt[50.0-18.0]",
    ),
    Mutation(
        "persistent memory cleared at start",
        'plate::PersistentState persistent_state __attribute__((section(".noinit")));',
        "plate::PersistentState persistent_state;",
        "test_resets.py::test_a_fault_whose_cause_has_gone_outlives_a_reset",
    ),
    Mutation(
        "the transmit ring takes bytes it has no room for",
        "(uint8_t)(tx_tail - tx_head - 1) % TX_ROOM",
        "(tx_tail - tx_head - 1) % TX_ROOM",
        "test_line.py::test_a_burst_of_greetings_costs_whole_frames_and_damages_none",
    ),
    Mutation("the step clock set once", "            set_clock();\n", "", f"{_RENEWED}[OCR0A]"),
    Mutation("the converter set once", "            set_converter();\n", "", f"{_RENEWED}[DIDR0]"),
    Mutation(
        "the serial line set once",
        "            refresh_serial();\n",
        "            if (tx_head == TX_ROOM) refresh_serial();\n",
        f"{_RENEWED}[UBRR0L]",
    ),
)
