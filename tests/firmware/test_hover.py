"""A hand that hovers over cold metal, on the compiled firmware, with beads that lag."""

from __future__ import annotations

from collections.abc import Iterable
from itertools import product

import pytest
from hovers import HOVERS, Part
from tiers import nightly_except

from hapticvlm.messages import Scene, SceneObject, Touch
from hapticvlm.rendering.heat.limits import AT_REST
from hapticvlm.session.actions import DrivePlate
from hapticvlm.session.session import SceneSession
from hapticvlm.session.settings import SessionSettings

from .board import Build
from .build import Chip
from .scenes import Rig
from .test_beads import LAGS_S, ROOM_C

PALM = 2e-4  # m2 K/W, the palm that conducts best
FELT_C = 0.3


@pytest.mark.parametrize(("name", "lag_s"), nightly_except(7, product(HOVERS, LAGS_S)))
def test_a_hand_that_hovers_without_touching_never_feels_it(
    chip: Chip, name: str, lag_s: float
) -> None:
    off_c = felt(chip, HOVERS[name], lag_s, PALM, metal_c=5.0)

    print(f"{min(off_c):+.2f} to {max(off_c):+.2f} degC")
    assert max(map(abs, off_c)) <= FELT_C


def felt(
    chip: Chip, parts: Iterable[Part], lag_s: float, palm: float, metal_c: float = ROOM_C
) -> list[float]:
    """Return how far the skin is from where it rested, degC, at each step of a hand near metal."""
    board = chip.board(ROOM_C, build=Build(lag_s))
    board.plant.touch(palm)
    rig = Rig(board)
    session = SceneSession(SessionSettings(owner=True, reading=AT_REST, plate_resistance=palm))
    metal = SceneObject(object_id="thing", material="metal", temperature_c=metal_c)
    session.receive(Scene(id=1, objects=[metal], replace=True, ambient_c=ROOM_C), board.now)
    try:
        rested_c = rig.live(4.0)[-1].skin_c
        off_c = []
        for phase, seconds, fields in parts:
            until = board.now + seconds
            while board.now < until:
                rig.peltier.poll()
                now = board.now
                touch = Touch(
                    id=2,
                    hand="right",
                    phase=phase,
                    object_id="thing",
                    speed_mps=0.0,
                    force_n=0.0,
                    captured_at=now,
                    **fields,
                )
                session.receive(touch, now)
                for action in session.tick(now, rig.peltier.advance(now)):
                    if isinstance(action, DrivePlate):
                        rig.peltier.command(action.setpoint_c, action.ttl_s, now)
                off_c.append(board.plant.skin_c - rested_c)
    finally:
        rig.close()
        board.close()
    return off_c
