"""Ambient temperature of a scene: what the scene says, else a labelled default. Pure.

A reading of a frame by a VLM is the rung between the two; its type is already here, its reader is
not. Knows no picture.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

DEFAULT_C = 22.0  # degC, design section 5: middle of heated and cooled rooms
# Indoor comfort bands run from 18 (WHO's least for healthy homes) to 26 degC (upper end of the
# ASHRAE 55 summer band, both from memory); a scene that says nothing is taken to be a room. An
# outdoor scene may lie far outside, which is why the value always carries its source.
DEFAULT_LOW_C = 18.0
DEFAULT_HIGH_C = 26.0


@dataclass(frozen=True, slots=True)
class Ambient:
    """An ambient temperature, the interval it is believed to lie in, and who said so; degC."""

    value_c: float
    low_c: float
    high_c: float
    source: Literal["scene", "vlm", "estimate", "default"]


def ambient(scene_c: float | None) -> Ambient:
    """Take the scene's value as exact, or the default with its interval; degC."""
    if scene_c is not None:
        return Ambient(scene_c, scene_c, scene_c, "scene")
    return Ambient(DEFAULT_C, DEFAULT_LOW_C, DEFAULT_HIGH_C, "default")
