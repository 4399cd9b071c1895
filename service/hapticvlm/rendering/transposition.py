"""What lies above the band of touch, moved into it. Pure.

Struck glass and small struck metal ring above 1 kHz, where a palm feels nothing (docs/physics.md
4.3). `transpose` scales such a row of modes down as a whole: the ratios between them,
by which one ringing thing differs from another, stay. The same is done to textures: a hand that
crosses 0.5 mm of weave at 1 m/s makes 2 kHz, which nobody feels: `rendered_hz` bends what exceeds
the best frequency of touch towards an upper end instead of cutting it off. Faster stays higher, and
what is below 250 Hz is left as physics has it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

BEST_HZ = 250.0  # Hz, where a palm is most sensitive (physics.md 4.1)
HIGHEST_HZ = 360.0  # Hz, needs 12 dB more drive than 250 Hz (perception.drive_threshold_db)
BEND_HZ = 150.0  # Hz, our choice: 286 and 400 Hz stay 17 % apart, about one step of frequency
BAND_END_HZ = 1000.0

# Modes of a published glass preset, Hz (physics.md 4.3); its decays, 4-18 per s, are of a
# glass that stands free, and a glass in a hand rings shorter.
GLASS_HZ = (1206.0, 2240.0, 3919.0, 5965.0)
GLASS_LOWEST_HZ = 350.0  # where its lowest mode is moved to: our choice, above the other classes


def transpose(modes_hz: Sequence[float], lowest_hz: float) -> tuple[float, ...]:
    """Scale modes so that the lowest is at `lowest_hz`; those still above the band are dropped."""
    factor = lowest_hz / min(modes_hz)
    moved = (mode_hz * factor for mode_hz in modes_hz)
    return tuple(mode_hz for mode_hz in moved if mode_hz <= BAND_END_HZ)


def rendered_hz(frequency_hz: float) -> float:
    """Bend a texture's frequency into 0..HIGHEST_HZ; strictly rising."""
    if frequency_hz <= BEST_HZ:
        return frequency_hz
    room = HIGHEST_HZ - BEST_HZ
    return BEST_HZ - room * math.expm1((BEST_HZ - frequency_hz) / BEND_HZ)
