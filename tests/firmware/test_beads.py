"""Beads that lag behind the face, and lighter and heavier faces, on the compiled firmware.

The board knows the lag of its beads, as after `calibrate plate`.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import product

import pytest
from tiers import nightly_except

from hapticvlm.rendering.heat.contact import share
from hapticvlm.rendering.heat.trajectory import ThermalTrajectory

from . import scenes
from .board import Build
from .build import Chip
from .rawhost import RawHost
from .scenes import Rig

LAGS_S, FACES_J_PER_K = (0.0, 0.3, 1.0), (0.6, 1.0, 1.5)
BUILDS = [Build(lag_s, face) for lag_s, face in product(LAGS_S, FACES_J_PER_K)]
PALM = 5e-4  # m2 K/W
ROOM_C = 22.0


def name(build: Build) -> str:
    return f"lag {build.bead_lag_s:g} s, face {build.face_j_per_k:g} J/K"


@pytest.mark.parametrize(
    ("build", "palm"),
    nightly_except(5, product(BUILDS, (math.inf, PALM))),
    ids=[f"{name(build)}, palm {palm:g}" for build, palm in product(BUILDS, (math.inf, PALM))],
)
def test_the_face_passes_its_goal_by_less_than_can_be_felt(
    chip: Chip, build: Build, palm: float
) -> None:
    board = chip.board(ROOM_C, build=build)
    board.plant.touch(palm)
    host = RawHost(board)
    host.greet()
    host.hold(32.0, 4.0)
    past_c = []
    for goal_c in (22.0, 36.0, 28.0):
        is_colder = goal_c < board.plant.plate_c
        face_c = []
        for _ in range(60):
            host.hold(goal_c, 0.1)
            face_c.append(board.plant.plate_c)
        past_c.append(goal_c - min(face_c) if is_colder else max(face_c) - goal_c)
    faults = host.state().faults
    board.close()

    assert faults == ()
    assert max(past_c) <= (0.3 if math.isfinite(palm) else 0.45), past_c


@pytest.mark.parametrize("lag_s", LAGS_S)
def test_wood_is_felt_as_wood_whatever_the_beads_lag(chip: Chip, lag_s: float) -> None:
    felt = felt_shares(chip, "wood", Build(lag_s), (0.25, 1.0))

    print(felt)
    assert all(0.9 <= of_physics <= 1.15 for of_physics in felt), felt


# At 5 degC the lowest setpoint binds. Each bound is a little below what firmware 1.6 reaches.
@pytest.mark.nightly
@pytest.mark.parametrize("lag_s", LAGS_S)
@pytest.mark.parametrize(
    ("material", "surface_c", "least"),
    [
        ("metal", 22.0, (0.63, 0.94)),
        ("glass", 22.0, (0.77, 0.98)),
        ("metal", 5.0, (0.22, 0.4)),
        ("metal", 40.0, (0.39, 0.7)),
    ],
)
def test_cold_and_warmth_are_felt_early_whatever_the_beads_lag(
    chip: Chip, material: str, surface_c: float, least: tuple[float, float], lag_s: float
) -> None:
    felt = felt_shares(chip, material, Build(lag_s), (0.25, 1.0), surface_c)

    print(felt)
    assert all(found > bound for found, bound in zip(felt, least, strict=True)), felt


# A Weber fraction of 0.43 is a just noticeable difference (docs/physics.md 1.3).
@pytest.mark.nightly
@pytest.mark.parametrize(("surface_c", "lag_s"), list(product((5.0, 40.0), LAGS_S)))
def test_materials_stay_apart_where_a_limit_binds(
    chip: Chip, surface_c: float, lag_s: float
) -> None:
    felt = {}
    for material in ("metal", "glass", "wood"):
        (of_physics,) = felt_shares(chip, material, Build(lag_s), (1.0,), surface_c)
        felt[material] = of_physics * share(scenes.contact(material, surface_c), 1.0)
    apart = {name: math.log(felt["metal"] / felt[name]) / math.log(1.43) for name in felt}

    assert min(apart["wood"] / 1.5, apart["glass"] / 0.6) >= 1.0, apart
    assert of_physics <= 1.1, "of wood"


def felt_shares(
    chip: Chip, material: str, build: Build, at_s: Sequence[float], surface_c: float = ROOM_C
) -> list[float]:
    """Return the change of the skin at times after contact, as shares of a real object's."""
    board = chip.board(ROOM_C, build=build)
    board.plant.touch(PALM)
    rig = Rig(board)
    try:
        rig.course = ThermalTrajectory(plate_resistance=PALM)
        rested_c = rig.live(4.0)[-1].skin_c
        contact = scenes.contact(material, surface_c)
        rig.course = rig.course.approach(contact, board.now)
        rig.live(0.5)  # the longest lead of an approach
        rig.course = rig.course.touch(contact, material, board.now)
        begun = board.now
        felt_c = [rig.live(begun + s - board.now)[-1].skin_c - rested_c for s in at_s]
    finally:
        rig.close()
        board.close()
    whole_c = contact.surface_c - contact.skin_c
    return [c / (share(contact, s) * whole_c) for c, s in zip(felt_c, at_s, strict=True)]


def test_a_board_that_was_never_told_its_lag_stays_within_its_limits(chip: Chip) -> None:
    # It assumes 0.1 s and is slower. Nothing rings where `calibrate plate` swings; at the coldest
    # setpoint the face passes the goal, and trips.
    board = chip.board(ROOM_C, build=Build(1.0, is_told=False))
    board.plant.touch(math.inf)
    host = RawHost(board)
    host.greet()
    host.hold(32.0, 3.0)
    host.hold(26.0, 12.0)
    steady_c = []
    for _ in range(20):
        host.hold(26.0, 0.1)
        steady_c.append(board.plant.plate_c)
    faults = host.state().faults
    host.hold(18.0, 8.0)
    cold_faults, coldest_c = host.state().faults, board.coldest_plate_c
    board.close()

    assert faults == ()
    assert max(steady_c) - min(steady_c) < 0.3
    assert set(cold_faults) <= {"UNDER_TEMPERATURE"}
    assert coldest_c > 13.0
