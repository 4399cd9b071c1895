"""Pairs of faults that disable each other's guards; `sweep.py` runs all pairs."""

from __future__ import annotations

import pytest
from tiers import nightly_except

from .board import Board
from .build import Chip
from .faults import BY_NAME
from .hardware import MOST_CUT_OUT_LAG_S, CutOut
from .situations import COLD, COLD_WARM, HELD_COLD, HOT, Situation
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
    outcome = trial(chip.board, [BY_NAME[first], BY_NAME[second]], situation, LONGEST_S)

    assert outcome.is_safe, outcome
    assert outcome.shoot_through == 0


# With the slower cut-out of the sweep these three cool a pressed palm to 12.8 to 12.9 degC.
@pytest.mark.nightly
@pytest.mark.parametrize(
    ("first", "second"),
    [
        ("both read 8 low", "bridge shorted to cool"),
        ("module backwards", "bridge shorted to heat"),
        ("plate A swapped with sink", "bridge shorted to cool"),
    ],
)
def test_a_cut_out_as_fast_as_asked_protects_a_pressed_palm_from_a_held_plate(
    chip: Chip, first: str, second: str
) -> None:
    def board(ambient_c: float) -> Board:
        made = chip.board(ambient_c)
        made.cut_out = CutOut(made.plant.plate_c, MOST_CUT_OUT_LAG_S)
        return made

    outcome = trial(board, [BY_NAME[first], BY_NAME[second]], HELD_COLD, 120.0)

    assert outcome.is_safe, outcome
