"""What skin can feel: thresholds of touch and warmth. Pure."""

from __future__ import annotations

from typing import overload

import numpy as np
from numpy.typing import NDArray

NEUTRAL_C = 32.0  # degC, resting palm and QST baseline (docs/physics.md 1.1)
THERMAL_FLOOR_C = 0.2  # degC, thenar warm threshold, the larger of the two (physics.md 1.3)
SPEAKER_RESONANCE_HZ = 40.0  # a palm speaker is usable from 40-60 Hz up (physics.md 4.1)

# Detection threshold at the thenar eminence, large contactor: Hz and dB re 1 um peak displacement.
# Shape (flat to 40 Hz, then 12 dB per octave down to 250 Hz): Gescheider and Verrillo. Anchor
# (0.1 um at 250 Hz) and everything above 250 Hz are unchecked, +-5 dB; that 1000 Hz is "not felt at
# ordinary levels" we take for +20 dB (physics.md 4.1).
_THRESHOLD_HZ = np.array([40.0, 60, 80, 100, 125, 160, 200, 250, 500, 1000])
_THRESHOLD_DB = np.array([12.0, 4.7, -0.3, -4.1, -8.0, -12.3, -16.1, -20.0, -9.0, 20.0])
_THRESHOLD_LOG_HZ = np.log(_THRESHOLD_HZ)


@overload
def threshold_db(frequency_hz: float) -> float: ...
@overload
def threshold_db(frequency_hz: NDArray[np.float64]) -> NDArray[np.float64]: ...
def threshold_db(frequency_hz: float | NDArray[np.float64]) -> float | NDArray[np.float64]:
    """Smallest vibration a resting palm detects, dB re 1 um peak; flat outside 40-1000 Hz."""
    known = np.maximum(frequency_hz, _THRESHOLD_HZ[0])
    decibels = np.interp(np.log(known), _THRESHOLD_LOG_HZ, _THRESHOLD_DB)
    return float(decibels) if np.ndim(frequency_hz) == 0 else decibels


def drive_threshold_db(frequency_hz: NDArray[np.float64]) -> NDArray[np.float64]:
    """Speaker drive that is just felt, dB re 250 Hz, any shape.

    Assumes, until a speaker is measured, that the cone moves in proportion to its drive below its
    resonance and accelerates in proportion above it.
    """
    above = np.log10(np.maximum(frequency_hz, SPEAKER_RESONANCE_HZ) / 250.0)
    return np.asarray(threshold_db(frequency_hz) - threshold_db(250.0) + 40.0 * above)
