"""Decides a scene's ambient temperature: stated by the scene, read by a VLM, or a default. Pure.

A picture shows a kind of climate rather than a number, so every value has an interval and a source.
A reading whose interval leaves most temperatures open is ignored, and the next rung decides. Knows
no model; a scene view is an embedding and a brightness.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from hapticvlm.evidence.reading import Reading

DEFAULT_C = 22.0  # degC, middle of heated and cooled rooms (docs/physics.md 7.1)
# Indoor comfort ranges from 18 degC (the WHO's minimum for healthy homes) to 26 degC (upper end of
# the ASHRAE 55 summer range; physics.md 7.1). A scene that states nothing is assumed to be a room;
# an outdoor scene may be far outside, which is why the value always has its source.
DEFAULT_LOW_C = 18.0
DEFAULT_HIGH_C = 26.0
WIDEST_C = 40.0  # degC; a wider interval does not distinguish climates; our choice


@dataclass(frozen=True, slots=True)
class Ambient:
    """An ambient temperature, the interval that it is believed to lie in, degC, and its source."""

    value_c: float
    low_c: float
    high_c: float
    source: Literal["scene", "vlm", "default"]


@dataclass(frozen=True, slots=True)
class SceneView:
    """A whole frame: embedding (D,) of unit norm, and brightness 0..1."""

    embedding: NDArray[np.float32]
    brightness: float


def ambient(scene_c: float | None, readings: Sequence[Reading] = ()) -> Ambient:
    """Return the scene's value as exact, else the mean of usable readings, else the default."""
    if scene_c is not None:
        return Ambient(scene_c, scene_c, scene_c, "scene")
    usable = [reading for reading in readings if is_informative(reading)]
    return _mean(usable) if usable else Ambient(DEFAULT_C, DEFAULT_LOW_C, DEFAULT_HIGH_C, "default")


def is_informative(reading: Reading) -> bool:
    """Whether a reading is finite and its interval is at most WIDEST_C wide."""
    numbers = (reading.value_c, reading.low_c, reading.high_c)
    ordered = reading.low_c <= reading.value_c <= reading.high_c
    return all(map(math.isfinite, numbers)) and ordered and numbers[2] - numbers[1] <= WIDEST_C


def distance(first: SceneView, second: SceneView) -> float:
    """Cosine distance of two scene views, 0 (alike) to 2."""
    return 1.0 - float(first.embedding @ second.embedding)


def _mean(readings: Sequence[Reading]) -> Ambient:
    """Return the mean of readings of one place; their standard deviation widens the interval."""
    values = np.array([reading.value_c for reading in readings])
    value_c = float(values.mean())
    spread_c = float(values.std())
    below = float(np.mean([reading.value_c - reading.low_c for reading in readings]))
    above = float(np.mean([reading.high_c - reading.value_c for reading in readings]))
    return Ambient(
        value_c, value_c - math.hypot(below, spread_c), value_c + math.hypot(above, spread_c), "vlm"
    )
