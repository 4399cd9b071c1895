"""Pairs of faults that disable each other's guards; `sweep.py` runs all pairs."""

from __future__ import annotations

from itertools import product

import pytest
from tiers import nightly_except

from .build import Chip
from .faults import BY_NAME, PARTS
from .situations import COLD, COLD_WARM, HELD_COLD, HELD_HOT, HOT, Situation
from .trials import trial

LONGEST_S = 60.0
PAIRS = [
    ("both read 8 low", "sink frozen", HOT),
    ("both read 8 low", "both frozen alike", HOT),
    ("both read 8 low", "fan dead", HOT),
    ("both read 8 low", "host silent", HOT),
    ("both read 8 high", "sink frozen", COLD),
    ("both read 8 high", "fan dead", COLD),
    ("both wrong beta", "both drift down", HOT),
    ("both drift up", "sink 8 K/W", COLD),
    ("both frozen alike", "bridge shorted to heat", HOT),
    ("both frozen alike", "bridge shorted to cool", COLD),
    ("bridge shorted to heat", "hang, interrupts off", HOT),
    ("bridge shorted to heat", "brown-out", HOT),
    ("bridge shorted to heat", "plate A open", HOT),
    ("bridge shorted to cool", "hang, boot loader hides it", COLD),
    ("bridge shorted to cool", "fan dead", COLD),
    ("shared ground of 50 mohm", "bridge shorted to heat", HELD_HOT),
    ("module backwards", "both frozen alike", HOT),
    ("module backwards", "both wrong beta", HOT),
    ("module backwards", "bridge shorted to cool", HOT),
    ("module backwards", "bridge shorted to cool", COLD_WARM),
    ("module backwards", "bridge shorted to heat", COLD),
    ("hang, interrupts on", "plate A frozen", HOT),
    ("dead tick", "line noise", HOT),
    ("host silent", "plate A drifts down", HOT),
    ("line noise", "both read too cold", HOT),
    ("plate A wrong beta", "plate B frozen", HOT),
    ("fan dead", "sink frozen", COLD),
]


@pytest.mark.parametrize(
    ("first", "second", "situation"),
    nightly_except(3, PAIRS),
    ids=[f"{one} and {two}, {situation.name}" for one, two, situation in PAIRS],
)
def test_two_faults_at_once_leave_the_skin_safe(
    chip: Chip, first: str, second: str, situation: Situation
) -> None:
    outcome = trial(chip, [BY_NAME[first], BY_NAME[second]], situation, LONGEST_S)

    assert outcome.is_safe, outcome
    assert outcome.shoot_through == 0


# Each of these may have failed before, unseen. Not so R13, which is looked for when the plate is
# built, and Q2, which each start proves (firmware/README.md).
@pytest.mark.parametrize(
    ("part", "short", "situation"),
    nightly_except(
        13,
        product(
            [part.name for part in PARTS if part.name not in ("R13 shorted", "Q2 shorted")],
            ["bridge shorted to heat", "bridge shorted to cool"],
            [HELD_HOT, HELD_COLD],
        ),
    ),
)
def test_a_part_of_the_guards_that_failed_unseen_leaves_the_skin_safe(
    chip: Chip, part: str, short: str, situation: Situation
) -> None:
    outcome = trial(chip, [BY_NAME[part], BY_NAME[short]], situation, 120.0)

    assert outcome.is_safe, outcome
