"""What lies above the band of touch, moved into it. Pure.

A hand that crosses 0.5 mm of weave at 1 m/s makes 2 kHz, which nobody feels (docs/physics.md 4.3):
`rendered_hz` bends what exceeds the best frequency of touch towards an upper end instead of cutting
it off. Faster stays higher, and what is below 250 Hz is left as physics has it.
"""

from __future__ import annotations

import math

BEST_HZ = 250.0  # Hz, where a palm is most sensitive (physics.md 4.1)
HIGHEST_HZ = 360.0  # Hz, needs 12 dB more drive than 250 Hz (perception.drive_threshold_db)
BEND_HZ = 150.0  # Hz, our choice: 286 and 400 Hz stay 17 % apart, about one step of frequency


def rendered_hz(frequency_hz: float) -> float:
    """Bend a texture's frequency into 0..HIGHEST_HZ; strictly rising."""
    if frequency_hz <= BEST_HZ:
        return frequency_hz
    room = HIGHEST_HZ - BEST_HZ
    return BEST_HZ - room * math.expm1((BEST_HZ - frequency_hz) / BEND_HZ)
