"""Mains hum on the thermistors' lines: the conversions of a step are spread over a mains period."""

from __future__ import annotations

import pytest
from tiers import nightly_except

from .build import Chip
from .rawhost import RawHost

HUM_MV = 100.0
SETTLE_S, WATCH_S = 8.0, 6.0
QUIET: dict[float, list[float]] = {}  # by setpoint


def plate_c(chip: Chip, setpoint_c: float, hum_hz: float | None) -> list[float]:
    """Return the true plate every 0.1 s while the board holds a setpoint; faults fail the test."""
    board = chip.board()
    host = RawHost(board)
    host.greet()
    if hum_hz is not None:
        board.hum(HUM_MV, hum_hz)
    host.hold(setpoint_c, SETTLE_S)
    watched = []
    for _ in range(round(WATCH_S / 0.1)):
        host.hold(setpoint_c, 0.1)
        watched.append(board.plant.plate_c)
    faults = host.state().faults
    board.close()
    assert faults == ()
    return watched


@pytest.mark.parametrize("setpoint_c", [18.0, 40.0])
@pytest.mark.parametrize("hum_hz", nightly_except(2, [50.0, 49.5, 60.0, 60.5]))
def test_hum_moves_the_plate_by_less_than_can_be_felt(
    chip: Chip, setpoint_c: float, hum_hz: float
) -> None:
    if setpoint_c not in QUIET:
        QUIET[setpoint_c] = plate_c(chip, setpoint_c, None)
    hummed = plate_c(chip, setpoint_c, hum_hz)

    assert max(abs(a - b) for a, b in zip(QUIET[setpoint_c], hummed, strict=True)) < 0.3


@pytest.mark.nightly
def test_minutes_of_hum_that_the_loop_follows_look_like_no_runaway(chip: Chip) -> None:
    # 60 Hz ripples at 10 Hz in the readings, in step with the guards: it tripped after 176 s while
    # they judged samples of the current and not its mean.
    board = chip.board(30.0)
    host = RawHost(board)
    host.greet()
    board.hum(HUM_MV, 60.0)
    host.hold(18.0, 190.0)
    faults = host.state().faults
    board.close()

    assert faults == ()
