"""Every single fault on boards whose plate's thermistors lag, with three faces.

A file of tests has one lag: the tests of a file run one after the other, and these are many.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import pytest

from .board import Build
from .build import Chip
from .faults import FAULTS, Fault
from .situations import MOVING
from .trials import TEST_S, trial


def safe_with_a_lag_of(lag_s: float) -> Callable[[Chip, Fault, float], None]:
    """Return the test of all faults and faces with thermistors that lag by `lag_s`."""

    @pytest.mark.parametrize("face_j_per_k", [0.6, 1.0, 1.5])
    @pytest.mark.parametrize("fault", FAULTS, ids=[fault.name for fault in FAULTS])
    def test(chip: Chip, fault: Fault, face_j_per_k: float) -> None:
        board = partial(chip.board, build=Build(lag_s, face_j_per_k))
        for situation in MOVING:
            outcome = trial(board, [fault], situation, TEST_S)
            assert outcome.is_safe, outcome
            assert outcome.shoot_through == 0

    return test
