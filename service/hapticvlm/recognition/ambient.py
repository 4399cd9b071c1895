"""Ambient temperature of a scene, rung by rung: its own word, a VLM, a default. Pure.

A picture tells a kind of climate rather than a number, so every value carries an interval and who
said it, and a reading that leaves most temperatures open is no reading: the next rung speaks. Knows
no model; what a place looks like is an embedding and a brightness.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from hapticvlm.recognition.vlm.answers import Reading

DEFAULT_C = 22.0  # degC, middle of heated and cooled rooms (docs/physics.md 7.1)
# Indoor comfort bands run from 18 (WHO's least for healthy homes) to 26 degC (upper end of the
# ASHRAE 55 summer band; physics.md 7.1); a scene that says nothing is taken to be a room. An
# outdoor scene may lie far outside, which is why the value always carries its source.
DEFAULT_LOW_C = 18.0
DEFAULT_HIGH_C = 26.0
WIDEST_C = 40.0  # degC, an interval wider than this tells no climate from another; our choice


@dataclass(frozen=True, slots=True)
class Ambient:
    """An ambient temperature, the interval it is believed to lie in, and who said so; degC."""

    value_c: float
    low_c: float
    high_c: float
    source: Literal["scene", "vlm", "default"]


@dataclass(frozen=True, slots=True)
class Sight:
    """What a place looks like: a whole frame's embedding (D,) unit norm, and brightness 0..1."""

    embedding: NDArray[np.float32]
    brightness: float


def ambient(scene_c: float | None, readings: Sequence[Reading] = ()) -> Ambient:
    """Take the scene's value as exact, else what a VLM read, else the default; degC."""
    if scene_c is not None:
        return Ambient(scene_c, scene_c, scene_c, "scene")
    told = [reading for reading in readings if tells(reading)]
    return _mean(told) if told else Ambient(DEFAULT_C, DEFAULT_LOW_C, DEFAULT_HIGH_C, "default")


def tells(reading: Reading) -> bool:
    """Whether a reading says anything: it is a number, and its interval leaves something out."""
    numbers = (reading.value_c, reading.low_c, reading.high_c)
    ordered = reading.low_c <= reading.value_c <= reading.high_c
    return all(map(math.isfinite, numbers)) and ordered and numbers[2] - numbers[1] <= WIDEST_C


def distance(one: Sight, other: Sight) -> float:
    """Cosine distance of two places, 0 (alike) to 2."""
    return 1.0 - float(one.embedding @ other.embedding)


def _mean(readings: Sequence[Reading]) -> Ambient:
    """Mean of readings of one place; what they disagree by widens the interval."""
    values = np.array([reading.value_c for reading in readings])
    value_c, spread_c = float(values.mean()), float(values.std())
    below = float(np.mean([reading.value_c - reading.low_c for reading in readings]))
    above = float(np.mean([reading.high_c - reading.value_c for reading in readings]))
    return Ambient(
        value_c, value_c - math.hypot(below, spread_c), value_c + math.hypot(above, spread_c), "vlm"
    )
