"""A bad contact names itself: no dose that the skin never had, no consequence told as a cause."""

from __future__ import annotations

from typing import Any

import pytest

from . import line
from .board import Sensor
from .build import Chip
from .hardware import PLATE_A, PLATE_B, SINK, SUPPLY_MV, thermistor_mv
from .rawhost import RawHost

PLACES = {PLATE_A: "PLATE_A", PLATE_B: "PLATE_B", SINK: "SINK"}
RAILS = {0.0: "SHORT", SUPPLY_MV: "OPEN"}
DOSE_STEP_CEM43 = 0.001  # of telemetry


def contacts() -> list[Any]:
    """Every thermistor shorted and open for 1 to 100 ms; most of them at night."""
    return [
        pytest.param(
            place,
            rail_mv,
            seconds,
            marks=[] if (place, rail_mv, seconds) == (PLATE_A, 0.0, 0.01) else pytest.mark.nightly,
            id=f"{name} {RAILS[rail_mv].lower()} for {seconds * 1000:.0f} ms",
        )
        for place, name in PLACES.items()
        for rail_mv in RAILS
        for seconds in (0.001, 0.005, 0.01, 0.02, 0.04, 0.1)
    ]


@pytest.mark.parametrize(("place", "rail_mv", "seconds"), contacts())
def test_a_bad_contact_is_named_as_one_and_costs_no_dose(
    host: RawHost, place: int, rail_mv: float, seconds: float
) -> None:
    board = host.board
    host.hold(34.0, 6.0)
    sound = board.sensors[place]
    read_from(host, place, lambda _: rail_mv)
    board.advance(seconds)
    read_from(host, place, sound)
    host.hold(34.0, 2.0)

    said = host.state()
    assert set(said.faults) <= {f"{PLACES[place]}_{RAILS[rail_mv]}", "READING_JUMPS"}
    assert said.faults or (seconds <= 0.005 and said.state == "holding")
    assert said.dose_cem43 <= board.skin.dose_cem43 + DOSE_STEP_CEM43
    if said.faults:
        assert not board.is_driven
    for fault in said.faults:
        assert host.ask(line.CLEAR, bytes([line.FAULTS[fault]])) == "ok"


@pytest.mark.parametrize("lag_s", [1.0, pytest.param(5.0, marks=pytest.mark.nightly)])
def test_thermistors_that_come_off_together_are_told_by_the_one_that_stayed(
    chip: Chip, lag_s: float
) -> None:
    board = chip.board(23.0)
    host = RawHost(board)
    host.greet()
    host.hold(38.0, 12.0)
    hot_c, from_s = board.plant.plate_c, board.now
    for place in (PLATE_A, PLATE_B):
        board.sensors[place] = lambda board: thermistor_mv(
            23.0 + (hot_c - 23.0) * 2.718 ** (-(board.now - from_s) / lag_s)
        )
    host.follow(lambda _: 38.0, 20.0, until=lambda: host.state().state == "faulted")

    assert host.state().faults == ("CUT_OUT_BEAD",)
    assert board.skin.highest_c < 40.0
    board.close()


@pytest.mark.parametrize("seconds", [0.3, pytest.param(2.0, marks=pytest.mark.nightly)])
def test_a_wire_that_opens_slowly_is_not_told_as_a_cold_plate(chip: Chip, seconds: float) -> None:
    board = chip.board(23.0)
    host = RawHost(board)
    host.greet()
    host.hold(30.0, 6.0)
    from_mv, from_s = board.sensors[PLATE_A](board), board.now
    board.sensors[PLATE_A] = lambda board: min(
        from_mv + (SUPPLY_MV - from_mv) * (board.now - from_s) / seconds, SUPPLY_MV
    )
    host.hold(30.0, 4.0)

    assert set(host.state().faults) <= {"PLATE_A_STRAYS", "PLATE_A_OPEN", "READING_JUMPS"}
    assert "PLATE_A_OPEN" in host.state().faults
    board.close()


def read_from(host: RawHost, place: int, sensor: Sensor) -> None:
    """Let a pin read from another source at once, in the middle of a step of the plant."""
    host.board.sensors[place] = sensor
    host.board._sense()  # a contact does not wait for the plant's next step
