"""The plate follows the setpoint of a touch, in closed loop on the compiled firmware."""

from __future__ import annotations

from itertools import product

import pytest
from tiers import nightly_except

from . import scenes, tracking
from .build import Chip
from .scenes import Rig
from .tracking import AMBIENTS_C, MATERIALS

LIMIT_C = 0.5  # RMS from 1 s after contact


@pytest.mark.parametrize(
    ("material", "ambient_c"), nightly_except(4, product(MATERIALS, AMBIENTS_C))
)
def test_the_plate_follows_the_limited_setpoint(
    chip: Chip, material: str, ambient_c: float
) -> None:
    done = tracking.touch(chip, material, ambient_c)

    assert done.limited_rms_c < LIMIT_C, done
    assert done.unnamed == 0, "a limited setpoint must name its limit"
    print(done)


@pytest.mark.parametrize("material", ["glass", "metal"])
def test_preconditioning_brings_the_first_second_nearer_to_the_real_thing(
    chip: Chip, material: str
) -> None:
    approached = tracking.touch(chip, material, 23.0, contact_s=1.0)
    sudden = tracking.touch(chip, material, 23.0, approached=False, contact_s=1.0)

    assert approached.first_rms_c < 0.5 * sudden.first_rms_c
    assert approached.first_skin_rms_c < 0.5 * sudden.first_skin_rms_c


def test_a_setpoint_out_of_reach_is_not_wound_up(chip: Chip) -> None:
    board = chip.board(30.0)
    rig = Rig(board)
    try:
        rig.course = rig.course.touch(scenes.contact("metal", 5.0), 1, board.now)
        rig.live(10.0)
        rig.course = rig.course.release(board.now)
        back = rig.live(15.0)
    finally:
        rig.close()
        board.close()

    assert abs(back[-1].plate_c - 32.0) < 0.3
    assert max(moment.plate_c for moment in back) < 33.0, "no overshoot on the way back"
