"""Defines the ten patterns that this project proposes, a set of twenty, and a set like the paper's.

The five vibrations are the paper's. Their strokes are those that a machine observer (a model, not a
person) confuses least, with a level error of 6 dB allowed for: a long carve, quick hard taps, one
hard blow, a slow rub (low pitch) and a fast swing (high pitch). Nobody has felt them yet.

Heat: the heating current warms the palm by 2 degC in the 2.4 s of a stroke, whatever the setpoint,
which is too little to be recognised. So the palm rests on the object for PALM_LEAD_S before the
stroke, and HOT_C is the mildest setpoint that uses all of the current in that time. COLD_C lies as
far below neutral as the strongest thermal icons, whose direction people recognised in 94 % of cases
(6 degC; Wilson, Brewster; physics.md 1.3). All patterns wait for the same time, hot or cold, so
that the wait gives no hint.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from hapticvlm_studio.design import stimuli
from hapticvlm_studio.design.paper import TEMPERATURES
from hapticvlm_studio.design.stimuli import Stimulus

HOT_C = 36.0
COLD_C = 26.0
# degC, our choice: the paper states no temperatures
PAPER_HOT_C = 38.0
PAPER_COLD_C = 25.0
PALM_LEAD_S = 6.0
_ANY_C = 32.0


def _vibration(name: str, material: str, interaction: str, stroke: _Stroke) -> Stimulus:
    speed_mps, force_n, repeats = stroke
    return Stimulus(
        name=name.replace(" ", "-"),
        vibration=name,
        temperature="neutral",
        material=material,
        interaction=interaction,
        setpoint_c=_ANY_C,
        speed_mps=speed_mps,
        force_n=force_n,
        repeats=repeats,
        lead_s=PALM_LEAD_S,
    )


_Stroke = tuple[float, float, int]  # m/s, N, strokes
_Row = tuple[str, str, str, _Stroke]

_FIVE: tuple[_Row, ...] = (
    ("wood carving", "wood", "carve", (0.3, 4.0, 1)),
    ("glass tapping", "glass", "tap", (1.5, 1.5, 6)),
    ("wood striking", "wood", "strike", (2.5, 4.0, 1)),
    ("fabric rubbing", "fabric", "slide", (0.06, 1.5, 1)),
    ("metal whooshing", "metal", "swing", (12.0, 0.0, 1)),
)
_FIVE_MORE: tuple[_Row, ...] = (
    ("metal striking", "metal", "strike", (2.5, 4.0, 1)),
    ("stone rubbing", "stone", "slide", (0.5, 4.0, 1)),
    ("plastic tapping", "plastic", "tap", (1.5, 1.5, 4)),
    ("rubber pressing", "rubber", "press", (0.1, 1.5, 1)),
    ("paper rubbing", "paper", "slide", (0.5, 1.5, 1)),
)

# The paper's five vibrations. Its recordings, levels and durations are unpublished, so these
# strokes are a guess: of 72 that were tried, the one in which rubbing and whooshing are confused
# most, as they were by the paper's people.
_PAPER_FIVE: tuple[tuple[str, dict[str, Any]], ...] = (
    ("wood carving", {"material": "wood", "interaction": "carve", "speed_mps": 0.15}),
    ("glass tapping", {"material": "glass", "interaction": "tap", "speed_mps": 0.6, "repeats": 4}),
    (
        "wood striking",
        {
            "material": "wood",
            "interaction": "strike",
            "speed_mps": 1.0,
            "force_n": 4.0,
            "repeats": 2,
        },
    ),
    ("fabric rubbing", {"material": "fabric", "interaction": "slide", "speed_mps": 0.15}),
    ("metal whooshing", {"material": "metal", "interaction": "swing", "speed_mps": 2.0}),
)


def named(name: str) -> tuple[Stimulus, ...]:
    """Return a shipped set of patterns by its name, or read a file. Raises StudyError."""
    sets = {"ours": ours, "twenty": twenty, "paper-like": paper_like}
    return sets[name]() if name in sets else stimuli.read(Path(name))


def ours() -> tuple[Stimulus, ...]:
    """Return our ten patterns: five vibrations, hot and cold, in the paper's order."""
    return hot_and_cold(_vibration(*row) for row in _FIVE)


def twenty() -> tuple[Stimulus, ...]:
    """Return ten vibrations, hot and cold: `ours` and five more."""
    return hot_and_cold(_vibration(*row) for row in (*_FIVE, *_FIVE_MORE))


def paper_like() -> tuple[Stimulus, ...]:
    """Return ten patterns like the paper's: five vibrations, hot and cold."""
    return tuple(
        Stimulus(
            name=f"{vibration.replace(' ', '-')}-{temperature}",
            vibration=vibration,
            temperature=temperature,
            setpoint_c=setpoint_c,
            **stroke,
        )
        for temperature, setpoint_c in (("hot", PAPER_HOT_C), ("cold", PAPER_COLD_C))
        for vibration, stroke in _PAPER_FIVE
    )


def hot_and_cold(vibrations: Iterable[Stimulus]) -> tuple[Stimulus, ...]:
    """Return each vibration hot and cold, all hot ones first."""
    neutral = tuple(vibrations)
    return tuple(
        dataclasses.replace(
            stimulus, name=f"{stimulus.name}-{warmth}", temperature=warmth, setpoint_c=setpoint_c
        )
        for warmth, setpoint_c in zip(TEMPERATURES, (HOT_C, COLD_C), strict=True)
        for stimulus in neutral
    )
