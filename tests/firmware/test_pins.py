"""The state "off" at the pins of the simulated chip, which noise cannot switch on."""

from __future__ import annotations

import pytest

from . import line
from .rawhost import RawHost

DDRB, PORTB, TCCR1A, TCCR1B = 0x24, 0x25, 0x80, 0x81
# The registers that determine the length of a step, the conversions and the serial line.
STEP_CLOCK = {"TCCR0A": 0x44, "TCCR0B": 0x45, "OCR0A": 0x47, "DIDR0": 0x7E, "ADCSRB": 0x7B}
SERIAL = {"UBRR0L": 0xC4, "UBRR0H": 0xC5, "UCSR0C": 0xC2}
SAMPLES_A_STEP = 200  # of 0.1 ms
ENABLE, HEAT, COOL = 1 << 0, 1 << 1, 1 << 2
COM_BITS = 0xF0  # connect the timer to the heat and the cool pin


def all_is_off(host: RawHost) -> None:
    assert not host.board.peek(PORTB) & (ENABLE | HEAT | COOL)
    assert not host.board.peek(TCCR1A) & COM_BITS
    assert host.board.peek(DDRB) & (ENABLE | HEAT | COOL) == ENABLE | HEAT | COOL


def test_a_board_that_was_asked_nothing_is_off(host: RawHost) -> None:
    host.advance(1.0)

    all_is_off(host)


@pytest.mark.parametrize(("setpoint_c", "driven", "idle"), [(38.0, HEAT, COOL), (20.0, COOL, HEAT)])
def test_one_side_of_the_bridge_is_driven_and_the_other_is_let_go(
    host: RawHost, setpoint_c: float, driven: int, idle: int
) -> None:
    com = {HEAT: 0xC0, COOL: 0x30}
    host.hold(setpoint_c, 1.0)

    assert host.board.peek(PORTB) & ENABLE
    assert host.board.peek(TCCR1A) & com[driven]
    assert not host.board.peek(TCCR1A) & com[idle]


@pytest.mark.parametrize("setpoint_c", [38.0, 20.0])
def test_a_flipped_bit_of_the_bridge_is_right_again_after_a_step(
    host: RawHost, setpoint_c: float
) -> None:
    host.hold(setpoint_c, 1.0)
    sound = {address: host.board.peek(address) for address in (DDRB, PORTB, TCCR1A, TCCR1B)}
    for address, value in sound.items():
        for bit in range(8):
            host.board.poke(address, value ^ 1 << bit)
            host.advance(0.05)
            assert host.board.peek(address) == value, (hex(address), bit)
            host.hold(setpoint_c, 0.1)
    assert host.board.shoot_through <= SAMPLES_A_STEP, "for one step, when the idle pin is set"


@pytest.mark.parametrize("name", [*STEP_CLOCK, *SERIAL])
def test_a_flipped_bit_of_clock_converter_or_line_is_right_again_after_a_step(
    host: RawHost, name: str
) -> None:
    address = (STEP_CLOCK | SERIAL)[name]
    host.hold(30.0, 0.5)
    sound = host.board.peek(address)
    for bit in range(8):
        host.board.poke(address, sound ^ 1 << bit)
        host.advance(0.06)
        assert host.board.peek(address) == sound, bit


def test_off_is_true_zero_after_heating_and_after_cooling(host: RawHost) -> None:
    for setpoint_c in (38.0, 20.0):
        host.hold(setpoint_c, 1.0)
        assert host.ask(line.OFF) == "ok"
        all_is_off(host)


def test_a_fault_is_true_zero(host: RawHost) -> None:
    host.hold(38.0, 1.0)
    host.board.sensors[2] = lambda _: 0.0
    host.hold(38.0, 0.3)

    all_is_off(host)
