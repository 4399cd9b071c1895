"""Every single fault on a plate that held its extreme, and on boards whose thermistors lag."""

from __future__ import annotations

import pytest

from .board import Build
from .build import Chip
from .faults import FAULTS, Fault
from .lagging import at_night
from .situations import HELD, MOVING, Situation
from .trials import TEST_S, trial

pytestmark = [pytest.mark.nightly, pytest.mark.spread]


@pytest.mark.parametrize("situation", HELD, ids=[situation.name for situation in HELD])
@pytest.mark.parametrize("fault", FAULTS, ids=[fault.name for fault in FAULTS])
def test_a_fault_of_a_plate_that_held_its_extreme_leaves_a_pressed_palm_safe(
    chip: Chip, fault: Fault, situation: Situation
) -> None:
    outcome = trial(chip, [fault], situation, TEST_S)

    assert outcome.is_safe, outcome
    assert outcome.shoot_through == 0


@pytest.mark.parametrize(
    ("fault", "build"),
    list(at_night()),
    ids=[
        f"{fault.name}, {build.bead_lag_s} s, {build.face_j_per_k} J per K"
        for fault, build in at_night()
    ],
)
def test_the_skin_is_safe_on_a_board_whose_beads_lag(
    chip: Chip, fault: Fault, build: Build
) -> None:
    for situation in MOVING:
        outcome = trial(chip, [fault], situation, TEST_S, build)
        assert outcome.is_safe, outcome
        assert outcome.shoot_through == 0
