"""A busy scene: a seeded hand approaches, touches, slides and releases, with short pauses only."""

from __future__ import annotations

import random
from dataclasses import dataclass

from . import scenes
from .build import Chip
from .scenes import Rig
from .tracking import MATERIALS

MARK_S = 5.0  # between fingerprints


@dataclass(frozen=True)
class Scene:
    """The result of a busy scene."""

    fingerprints: tuple[str, ...]
    touches: int
    resets: int
    faults: tuple[str, ...]
    skin_low_c: float
    skin_high_c: float
    dose_cem43: float
    bytes_lost: int


def live(chip: Chip, seconds: float, seed: int = 1) -> Scene:
    """Run `seconds` (6 or more) of a scene with objects between 5 and 60 degC."""
    board = chip.board(seed=seed)
    rig = Rig(board)
    chance = random.Random(7)
    marks: list[str] = []
    touches = 0
    until = board.now + seconds
    try:
        while board.now < until:
            touches += _act(rig, chance)
            if board.now >= MARK_S * (len(marks) + 1):
                marks.append(board.fingerprint())
        skin = board.skin
        faults = rig.peltier.advance(board.now).faults
        return Scene(
            tuple(marks),
            touches,
            board.resets,
            faults,
            skin.lowest_c,
            skin.highest_c,
            skin.dose_cem43,
            board.bytes_lost(),
        )
    finally:
        rig.close()
        board.close()


def _act(rig: Rig, chance: random.Random) -> int:
    """Do one action for a while; return 1 if it was a touch."""
    material = chance.choice(MATERIALS)
    contact = scenes.contact(material, chance.choice((5.0, 15.0, 23.0, 30.0, 45.0, 60.0)))
    what, now = chance.random(), rig.board.now
    if what < 0.3:
        rig.course = rig.course.approach(contact, now)
    elif what < 0.85:
        rig.course = rig.course.touch(contact, chance.random(), now)
    else:
        rig.course = rig.course.release(now)
    rig.live(chance.uniform(0.3, 3.0))
    return int(0.3 <= what < 0.85)
