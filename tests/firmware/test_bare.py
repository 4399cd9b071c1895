"""The firmware on a board without a plate, or with a pad in its place, as a maker may try it."""

from __future__ import annotations

import math
import random

import pytest

from hapticvlm.devices.simulated.plant import Module, Plant

from . import scenes
from .board import Board
from .build import Chip
from .hardware import CUT_OUT, PLATE_A, PLATE_B, SINK, SUPPLY_MV, Driver
from .rawhost import RawHost
from .scenes import Rig

PORTB, LIGHT = 0x25, 1 << 5  # the LED marked L
ROOM_MV = SUPPLY_MV / 2.0  # two 10 kohm resistors: a thermistor at 25 degC
PAD_W = 2.0
MISSING = {"PLATE_A_OPEN", "PLATE_B_OPEN", "SINK_OPEN", "CUT_OUT_BEAD"}


def is_lit(board: Board) -> bool:
    return bool(board.peek(PORTB) & LIGHT)


def blinks(host: RawHost, seconds: float) -> int:
    """Count how often the light turns on."""
    was, count = is_lit(host.board), 0
    for _ in range(round(seconds / 0.01)):
        host.advance(0.01)
        lit = is_lit(host.board)
        count += lit and not was
        was = lit
    return count


def reads(board: Board, millivolts: float) -> None:
    """Replace the thermistors by fixed resistors."""
    for channel in (PLATE_A, PLATE_B, SINK, CUT_OUT):
        board.sensors[channel] = lambda _: millivolts


class Pad(Driver):
    """A transistor and a heating pad: its heat is the duty's share of PAD_W, and it cannot cool."""

    def current_a(self, duty: float, emf_v: float = 0.0) -> float:
        del emf_v  # a resistor has no voltage of its own
        return math.sqrt(2.0 * PAD_W * max(duty, 0.0) / PAD.resistance)


# No Peltier effect; half of I^2 R reaches the face, and 0.02 W/K are lost to the room.
PAD = Module(seebeck=1e-9, resistance=2.0, conductance=0.02)


@pytest.fixture
def bare(board: Board) -> RawHost:
    """A board with only its pull-up resistors, after a HELLO."""
    reads(board, SUPPLY_MV)
    host = RawHost(board)
    host.greet()
    return host


@pytest.fixture
def stand_in(board: Board) -> RawHost:
    """A board with resistors of 10 kohm as thermistors, whose D6 is wired to D7."""
    reads(board, ROOM_MV)
    host = RawHost(board)
    host.greet()
    return host


def test_a_bare_board_names_what_is_missing_and_blinks(bare: RawHost) -> None:
    assert set(bare.state().faults) == MISSING
    assert blinks(bare, 2.0) == 10
    assert bare.ask(2, b"\x00\x7d\x00\x00\xfa\x00") == "faulted", "32 degC for 250 ms"
    assert bare.board.last_driven_at == 0.0


def test_pins_that_float_are_faults_of_the_thermistors_and_drive_nothing(board: Board) -> None:
    chance = random.Random(3)
    for channel in (PLATE_A, PLATE_B, SINK, CUT_OUT):
        board.sensors[channel] = lambda _: chance.uniform(0.0, SUPPLY_MV)
    host = RawHost(board)
    host.greet()
    host.hold(38.0, 2.0)

    assert {"PLATE_DISAGREES", "READING_JUMPS"} & set(host.state().faults)
    assert blinks(host, 1.0) == 5
    assert board.last_driven_at == 0.0


def test_resistors_for_thermistors_let_the_bridge_be_seen_then_end_in_runaway(
    stand_in: RawHost,
) -> None:
    assert not stand_in.state().faults
    assert not is_lit(stand_in.board)
    began = stand_in.board.now
    stand_in.hold(38.0, 0.5)
    assert stand_in.board.is_driven
    assert is_lit(stand_in.board)
    stand_in.hold(38.0, 4.0)

    assert stand_in.state().faults == ("RUNAWAY",)
    assert stand_in.board.last_driven_at - began == pytest.approx(1.2, abs=0.2)
    assert blinks(stand_in, 1.0) == 5


def test_a_wire_that_moves_during_a_touch_is_named(stand_in: RawHost) -> None:
    stand_in.hold(38.0, 0.4)
    stand_in.board.cut_out_wire = "grounded"  # D7
    stand_in.hold(38.0, 0.3)
    assert stand_in.state().faults == ("CUT_OUT_OPEN",)
    assert not stand_in.board.is_driven
    stand_in.board.sensors[PLATE_A] = lambda _: SUPPLY_MV  # A0's lower resistor
    stand_in.advance(0.3)
    assert "PLATE_A_OPEN" in stand_in.state().faults


@pytest.mark.parametrize("material", ["wood", "metal"])
def test_a_heating_pad_in_place_of_the_module_is_switched_off_when_a_touch_needs_cooling(
    chip: Chip, material: str
) -> None:
    board = chip.board()
    board.plant = Plant(board.ambient_c, sink_k_per_w=0.01, module=PAD)
    board.driver = Pad()
    rig = Rig(board)
    try:
        assert rig.live(5.0)[-1].reading.faults == ()
        rig.course = rig.course.touch(
            scenes.contact(material, board.ambient_c), material, board.now
        )
        assert rig.live(2.0)[-1].reading.faults == ("runaway",)
        assert not board.is_driven
    finally:
        rig.close()
        board.close()


def test_the_light_is_steady_while_the_bridge_is_driven_and_dark_after_it(host: RawHost) -> None:
    for _ in range(20):
        host.hold(34.0, 0.1)
        assert is_lit(host.board) == host.board.is_driven
    host.advance(12.0)

    assert not host.board.is_driven
    assert not is_lit(host.board)
