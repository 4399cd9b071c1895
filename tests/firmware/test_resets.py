"""A reset of the chip must not clear heating time and latched faults whose cause has gone."""

from __future__ import annotations

import pytest

from .board import RESET_BROWN_OUT, RESET_EXTERNAL
from .rawhost import RawHost


@pytest.mark.parametrize("cause", [RESET_EXTERNAL, RESET_BROWN_OUT, 0])
def test_a_fault_whose_cause_has_gone_outlives_a_reset(host: RawHost, cause: int) -> None:
    sound = host.board.sensors[1]
    host.hold(38.0, 1.0)
    host.board.sensors[1] = lambda _: 0.0
    host.hold(38.0, 0.5)
    host.board.sensors[1] = sound
    host.advance(0.5)
    host.board.reset(cause)
    host.greet()

    assert "PLATE_B_SHORT" in host.state().faults


def test_the_heat_of_a_session_outlives_a_reset(host: RawHost) -> None:
    host.hold(38.0, 5.0)
    before_s = host.state().heated_s
    host.board.reset(RESET_EXTERNAL)
    host.greet()

    assert before_s >= 3
    assert host.state().heated_s == pytest.approx(before_s, abs=1)
