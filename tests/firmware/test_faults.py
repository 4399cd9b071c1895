"""Every single fault of the table: the guard that acts, its deadline, and the skin's limits."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import pytest

from . import line
from .board import RESET_POWER_ON, sink_mv
from .build import Chip
from .faults import BY_NAME, FAULTS, IDLE_S, SLOW_S, Fault, one_bag_and_the_cut_out
from .rawhost import RawHost
from .situations import COLD_WARM, HOT, Situation
from .trials import TEST_S, trial

BEADS = [
    fault
    for fault in FAULTS
    if fault.name.split()[0] in {"plate", "sink", "both"}
    and fault.numbers
    and fault.deadline_s < SLOW_S
]


def cases() -> Iterator[Any]:
    """Every fault with its situations: a quick one in its first, all the rest at night."""
    for fault in FAULTS:
        is_slow = fault.deadline_s == SLOW_S
        quick = [room for room in fault.acts_in if room is not COLD_WARM]
        for number, situation in enumerate(fault.acts_in[-1:] if is_slow else quick):
            marks = [pytest.mark.nightly] if is_slow or number else []
            yield pytest.param(fault, situation, marks=marks, id=f"{fault.name}, {situation.name}")


@pytest.mark.parametrize(("fault", "situation"), list(cases()))
def test_a_fault_is_caught_in_time_and_the_skin_is_safe(
    chip: Chip, fault: Fault, situation: Situation
) -> None:
    outcome = trial(chip, [fault], situation, TEST_S)

    assert outcome.is_safe, outcome
    assert outcome.shoot_through == 0
    if not fault.guards:
        return
    assert set(outcome.caught_by) & set(fault.guards), outcome
    if fault.numbers and "firmware" in outcome.caught_by:
        assert set(outcome.numbers) & set(fault.numbers), outcome
    if fault in BEADS:  # and nothing is named that this bead does not explain
        assert set(outcome.numbers) <= {*fault.numbers, "READING_JUMPS"}, outcome
    gone_s = outcome.left_after_s if fault.silent else outcome.off_after_s
    if "firmware" in fault.guards and "cut-out" not in outcome.caught_by:
        assert gone_s is not None
        assert gone_s <= fault.sees_s + fault.deadline_s, outcome


@pytest.mark.nightly
def test_a_bridge_that_shorts_is_cut_off_where_beads_are_of_one_wrong_kind(chip: Chip) -> None:
    bag = Fault("one bag", one_bag_and_the_cut_out, at_start=True)
    for kind in (bag, BY_NAME["all beads of one wrong kind"]):
        outcome = trial(chip, [kind, BY_NAME["bridge shorted to heat"]], HOT, TEST_S)
        assert outcome.is_safe, outcome
        assert {"cut-out", "firmware"} & set(outcome.caught_by)


def test_a_broken_sense_wire_keeps_the_bridge_off_from_the_power_on(host: RawHost) -> None:
    # A fresh board: the wire broke while its power was off.
    host.board.cut_out_wire = "broken"
    host.board.reset(RESET_POWER_ON)
    host.greet()
    host.hold(36.0, 1.0)

    assert host.state().faults == ("CUT_OUT_UNTESTED",)
    assert host.ask(line.CLEAR, bytes([22])) == "persists"
    assert host.board.last_driven_at == 0.0


def test_a_cut_out_that_opens_behind_a_broken_sense_wire_ends_in_runaway(host: RawHost) -> None:
    host.hold(36.0, 3.0)
    host.board.cut_out_wire = "broken"
    host.hold(36.0, 1.0)
    assert not host.state().faults, "the cut-out itself needs no wire to the board"
    host.board.cut_out.is_open = True
    host.follow(lambda _: 36.0, 15.0, until=lambda: not host.board.is_driven)

    assert host.state().faults == ("RUNAWAY",)


@pytest.mark.parametrize("held_c", [36.0, 26.0])
def test_beads_that_freeze_at_a_steady_plate_are_found_by_a_test_pulse(
    chip: Chip, held_c: float
) -> None:
    # Nothing else sees them: reading and setpoint agree, so the current stays as it was.
    board = chip.board(30.0)
    host = RawHost(board)
    host.greet()
    host.hold(held_c, 8.0)
    BY_NAME["both frozen alike"].begin(board)
    frozen_at = board.now
    host.follow(lambda _: held_c, 20.0, until=lambda: host.state().state == "faulted")

    assert host.state().faults == ("PLATE_FROZEN",)
    assert board.now - frozen_at < 17.0
    board.close()


@pytest.mark.nightly
def test_the_test_pulse_moves_the_skin_by_less_than_can_be_felt(chip: Chip) -> None:
    board = chip.board(23.0)
    host = RawHost(board)
    host.greet()
    host.hold(26.0, 30.0)
    skin_c = []
    for _ in range(240):  # two pulses
        host.hold(26.0, 0.1)
        skin_c.append(board.plant.skin_c)
    assert host.state().state == "holding"
    board.close()

    assert max(skin_c) - min(skin_c) < 0.2  # half of it either way; docs/physics.md 1.3


def test_clearing_again_and_again_does_not_talk_a_guard_away(host: RawHost) -> None:
    answers = []
    for _ in range(3):
        host.board.sensors[2] = lambda _: 0.0
        host.advance(0.2)
        host.board.sensors[2] = sink_mv
        host.advance(0.2)
        for number in (6, 9):
            host.ask(line.CLEAR, bytes([number]))
        answers.append(host.state().faults)

    assert answers[:2] == [(), ()]
    assert "SINK_SHORT" in answers[2]


@pytest.mark.parametrize("interrupts", [True, False])
def test_a_hung_program_is_reset_once_and_stays_off(host: RawHost, interrupts: bool) -> None:
    host.hold(38.0, 1.0)
    host.board.hang(interrupts=interrupts)
    host.hold(38.0, 3.0)

    assert host.board.resets == 1
    assert host.state().state == "faulted"


def test_a_module_wired_backwards_is_caught_where_it_can_hardly_push(chip: Chip) -> None:
    # What should cool heats, by less than 2 degC/s: it is judged by the energy spent on it.
    outcome = trial(chip, [BY_NAME["module backwards"]], COLD_WARM, TEST_S)

    assert outcome.off_after_s is not None
    assert outcome.off_after_s <= IDLE_S + 3.0
    assert outcome.skin_high_c < 35.5, "35.0 in the sweep"
