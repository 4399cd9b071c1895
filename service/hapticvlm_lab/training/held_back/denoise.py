"""Removes the path tracer's noise from a picture that was rendered twice.

Non-local means whose patch distance discounts the noise between two independent halves (Rousselle,
Knaus and Zwicker 2012, "Adaptive rendering with non-local means filtering"): where the halves
agree, texture is kept; where they differ, similar patches are averaged.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

RADIUS = 4  # px of the search window
STRENGTH = 0.5  # noise of this many standard deviations still counts as alike
_PATCH = 3  # px
_EPSILON = 1e-4

Linear = NDArray[np.floating]


def denoise(first: Linear, second: Linear) -> Linear:
    """Join two halves (N, H, W, 3) of one picture, smoothed as far as they disagree."""
    # The variance of the mean of two halves is a quarter of the squared difference between them; it
    # is smoothed, since a single difference is a poor estimate. The distance of two patches is then
    # lowered by the noise that both have, so that only a real difference of texture counts.
    mean = _root((first + second) / 2)
    spread = (_root(first) - _root(second)) ** 2 / 4
    variance = _box(spread, 2 * _PATCH + 1)
    total = np.zeros_like(mean)
    weights = np.zeros(mean.shape[:3], np.float32)
    for dy in range(-RADIUS, RADIUS + 1):
        for dx in range(-RADIUS, RADIUS + 1):
            shifted = _shift(mean, dy, dx)
            noise = _shift(variance, dy, dx)
            apart = (mean - shifted) ** 2 - (variance + np.minimum(variance, noise))
            apart = apart / (_EPSILON + STRENGTH**2 * (variance + noise))
            weight = np.exp(-np.maximum(_box(apart, _PATCH).mean(axis=-1), 0)).astype(np.float32)
            total += weight[..., None] * _shift((first + second) / 2, dy, dx)
            weights += weight
    return np.asarray(total / weights[..., None], np.float32)


def _root(values: Linear) -> Linear:
    """Take the square root, which evens out noise that grows with the light."""
    return np.asarray(np.sqrt(np.maximum(values, 0)), np.float32)


def _shift(values: Linear, dy: int, dx: int) -> Linear:
    return np.roll(values, (dy, dx), axis=(1, 2))


def _box(values: Linear, side: int) -> Linear:
    from scipy.ndimage import uniform_filter

    return np.asarray(uniform_filter(values, (0, side, side, 0), mode="nearest"), np.float32)
