"""The unmodified `devices/plate/peltier.py` over sim://, the compiled firmware at the other end."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from .board import Board
from .faults import BY_NAME
from .scenes import Rig


@pytest.fixture
def rig(board: Board) -> Iterator[Rig]:
    rig = Rig(board)
    yield rig
    rig.close()


def test_opening_greets_and_drives_nothing(rig: Rig) -> None:
    assert "firmware 1." in rig.peltier.name
    assert rig.board.last_driven_at == 0.0


def test_a_command_is_followed_and_read_back(rig: Rig) -> None:
    moments = rig.live(2.0)

    reading = moments[-1].reading
    assert reading.plate_c == pytest.approx(rig.board.plant.plate_c, abs=0.3)
    assert reading.sink_c == pytest.approx(rig.board.plant.sink_c, abs=0.3)
    assert reading.setpoint_c == pytest.approx(32.0, abs=0.1)
    assert rig.board.is_driven


def test_a_fault_reaches_the_service_by_name(rig: Rig) -> None:
    rig.live(1.0)
    BY_NAME["plate A open"].begin(rig.board)
    faults = rig.live(0.5)[-1].reading.faults

    assert faults, "the reading names it"
    assert not rig.board.is_driven


def test_a_brown_out_needs_more_than_a_stubborn_service_to_heat_again(rig: Rig) -> None:
    rig.live(1.0)
    BY_NAME["brown-out"].begin(rig.board)
    at = rig.board.now
    rig.live(5.0)

    assert rig.board.last_driven_at <= at
