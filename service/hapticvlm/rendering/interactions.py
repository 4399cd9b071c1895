"""What a hand can do to a surface, and how hard: the words and numbers all of vibration shares."""

from __future__ import annotations

from dataclasses import dataclass

RATE_HZ = 48_000
IMPACTS = ("tap", "strike", "press")
TEXTURES = ("slide", "carve", "swing")


@dataclass(frozen=True, slots=True)
class Motion:
    """How the hand moves over or onto a surface: m/s and N, both >= 0."""

    speed_mps: float
    force_n: float
