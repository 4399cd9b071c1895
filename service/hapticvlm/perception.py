"""What skin can feel: thresholds, masking and differences of touch and warmth. Pure."""

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

# Vibrotactile masking and threshold of the psychohaptic model of MPEG haptics (ISO/IEC 23090-31),
# implemented from its published formulae. Its reference software is under a BSD licence that gives
# no patent rights; it is used here to measure, not to encode.
JND_DB = 1.6  # least difference of amplitude told apart at the thenar (Forta and others 2012)
_MODEL_BEST_HZ, _MODEL_HZ, _MODEL_BEST_DB = 250.0, 550.0, -45.0
_PROMINENT_DB, _REACH_DB = 12.0, 45.0  # of a peak that masks: above its feet, below the highest
BANDS_HZ = 20.0 * 2.0 ** (np.arange(18) / 3.0)  # third octaves, 20 to 1016 Hz


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


def model_threshold_db(frequency_hz: NDArray[np.float64]) -> NDArray[np.float64]:
    """Threshold of the psychohaptic model, dB below full scale (never above 0), any shape."""
    b = 1.0 - _MODEL_BEST_HZ / _MODEL_HZ
    at = np.log10(frequency_hz / _MODEL_HZ + b) ** 2
    return np.asarray(np.minimum(50.0 / np.log10(b) ** 2 * at + _MODEL_BEST_DB, 0.0))


def masked_threshold_db(
    frequency_hz: NDArray[np.float64], level_db: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Threshold under a vibration's own peaks, (K,) dB: a mask at each, summed in power."""
    from scipy.signal import find_peaks

    peaks, _ = find_peaks(level_db, prominence=_PROMINENT_DB)
    total = 10.0 ** (model_threshold_db(frequency_hz) / 10.0)
    for peak in peaks:
        if level_db[peak] >= level_db.max() - _REACH_DB and frequency_hz[peak] > 0.0:
            hz = frequency_hz[peak]
            away = ((frequency_hz - hz) / hz) ** 2
            total += 10.0 ** ((level_db[peak] - 5.0 + 5.0 / 1400.0 * hz - 30.0 * away) / 10.0)
    return np.asarray(10.0 * np.log10(total))


def felt_difference_db(
    frequency_hz: NDArray[np.float64],
    meant_db: NDArray[np.float64],
    given_db: NDArray[np.float64],
) -> float:
    """Return the largest difference, in third octaves, that the meant vibration does not mask, dB.

    All (K,); levels are power a band in dB re full scale. What is below the meant one's threshold
    counts as the threshold, so only what can be felt differs; JND_DB or less is told apart by
    nobody.
    """
    hidden = 10.0 ** (masked_threshold_db(frequency_hz, meant_db) / 10.0)
    differences = []
    for centre in BANDS_HZ:
        edge = 2.0 ** (1.0 / 6.0)
        inside = (frequency_hz >= centre / edge) & (frequency_hz < centre * edge)
        if not inside.any():
            continue
        floor = float(hidden[inside].min())
        meant = float(np.sum(10.0 ** (meant_db[inside] / 10.0))) + floor
        given = float(np.sum(10.0 ** (given_db[inside] / 10.0))) + floor
        differences.append(abs(10.0 * np.log10(given / meant)))
    return float(max(differences))
