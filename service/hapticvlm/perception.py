"""Holds the thresholds of skin for vibration and warmth. Pure.

The figures and their sources are in docs/physics.md 1.3 and 4.1.
"""

from __future__ import annotations

from typing import overload

import numpy as np
from numpy.typing import NDArray

NEUTRAL_C = 32.0  # resting palm and baseline of thermal tests (docs/physics.md 1.1)
THERMAL_FLOOR_C = 0.2  # thenar warm threshold, the larger of warm and cold (physics.md 1.3)
SPEAKER_RESONANCE_HZ = 40.0  # a palm speaker is usable from 40-60 Hz up (physics.md 4.1)
# Level of a full-scale sine of 250 Hz above its threshold, dB, until `calibrate speaker --by-hand`
# has measured it for a speaker and a hand (physics.md 5).
FULL_SCALE_DB = 45.0

# Detection threshold at the thenar eminence with a large contactor: Hz, and dB relative to 1 um of
# peak displacement. The shape, flat to 40 Hz and then falling by 12 dB per octave to 250 Hz, is
# from Gescheider and Verrillo. The anchor (0.1 um at 250 Hz) and all values above 250 Hz are
# unchecked, +-5 dB; "not felt at ordinary levels" at 1000 Hz is taken as +20 dB (physics.md 4.1).
THRESHOLD_HZ = np.array([40.0, 60, 80, 100, 125, 160, 200, 250, 500, 1000])
THRESHOLD_DB = np.array([12.0, 4.7, -0.3, -4.1, -8.0, -12.3, -16.1, -20.0, -9.0, 20.0])
_THRESHOLD_LOG_HZ = np.log(THRESHOLD_HZ)


@overload
def threshold_db(frequency_hz: float) -> float: ...
@overload
def threshold_db(frequency_hz: NDArray[np.float64]) -> NDArray[np.float64]: ...
def threshold_db(frequency_hz: float | NDArray[np.float64]) -> float | NDArray[np.float64]:
    """Smallest vibration that a resting palm detects, dB relative to 1 um of peak displacement.

    The result has the shape of `frequency_hz`; it is constant below 40 and above 1000 Hz.
    """
    known = np.maximum(frequency_hz, THRESHOLD_HZ[0])
    decibels = np.interp(np.log(known), _THRESHOLD_LOG_HZ, THRESHOLD_DB)
    return float(decibels) if np.ndim(frequency_hz) == 0 else decibels


def drive_threshold_db(frequency_hz: NDArray[np.float64]) -> NDArray[np.float64]:
    """Speaker drive that is just felt, dB relative to 250 Hz, in the shape of `frequency_hz`.

    It assumes, until a speaker is measured, that the displacement of the cone is proportional to
    its drive below the resonance, and its acceleration above. For a constant displacement the drive
    therefore rises by 40 dB per decade above the resonance.
    """
    above = np.log10(np.maximum(frequency_hz, SPEAKER_RESONANCE_HZ) / 250.0)
    return np.asarray(threshold_db(frequency_hz) - threshold_db(250.0) + 40.0 * above)
