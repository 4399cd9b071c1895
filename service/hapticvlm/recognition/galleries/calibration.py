"""Choosing a gallery's calibration: the one under which what is known to be true surprises least.

Surprise is the negative log probability of the truth; the mass of "unknown" counts evenly for every
class. Pure; knows no picture and no source.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from hapticvlm.recognition.galleries.gallery import Calibration

Doubles = NDArray[np.float64]

SHARPNESSES = (4.0, 6.0, 8.0, 11.0, 14.0, 18.0, 24.0, 32.0)
SLOPES = (0.0, 2.0, 4.0, 8.0, 16.0, 32.0)
THRESHOLDS = tuple(np.arange(-0.6, 1.01, 0.1).tolist())


def least_surprising(surprise_at: Callable[[float], Callable[[Calibration], float]]) -> Calibration:
    """Try every calibration; `surprise_at(sharpness)` gives what tells the surprise of a trial."""
    best, least = Calibration(SHARPNESSES[0], 0.0, 0.0), np.inf
    for sharpness in SHARPNESSES:
        surprise_of = surprise_at(sharpness)
        for slope in SLOPES:
            for threshold in THRESHOLDS:
                trial = Calibration(sharpness, slope, threshold)
                found = surprise_of(trial)
                if found < least:
                    best, least = trial, found
    return best


def surprise(beliefs: Doubles, truth: NDArray[np.int64], weights: Doubles, classes: int) -> float:
    """Sum the weighted surprise of (N, C) beliefs; truth (N,) is a class, or -1: none of them."""
    unknown = np.clip(1.0 - beliefs.sum(axis=1), 1e-3, 1.0)
    named = beliefs[np.arange(len(beliefs)), np.maximum(truth, 0)] + unknown / classes
    right = np.where(truth >= 0, named, unknown)
    return float(-(weights * np.log(np.maximum(right, 1e-4))).sum())


def evenly(truth: NDArray[np.int64]) -> Doubles:
    """Weights (N,) by which every class, and "none of them", counts alike."""
    weights = np.zeros(len(truth))
    for value in np.unique(truth):
        weights[truth == value] = 1.0 / (truth == value).sum()
    return weights
