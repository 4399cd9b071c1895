"""Computes percentiles, and the confidence interval of a share. Pure."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

_Z = 1.959963984540054  # two-sided 95 % of the normal distribution


def wilson(successes: float, n: float) -> tuple[float, float]:
    """Return the 95 % confidence interval of a share of `n` trials, by Wilson's score method.

    It is (0, 1) when n is 0.
    """
    if n == 0:
        return 0.0, 1.0
    z = _Z
    p = successes / n
    middle = p + z * z / (2 * n)
    half = z * math.sqrt(p * (1 - p) / n + z * z / (4 * n * n))
    low, high = ((middle + side * half) / (1 + z * z / n) for side in (-1.0, 1.0))
    return max(low, 0.0), min(high, 1.0)


def percentile(values: NDArray[Any], percent: float) -> Any:  # noqa: ANN401 - of values' own type
    """Return this percentile of values (N, ...) along the first axis, linearly interpolated.

    The first call of np.percentile, of np.median or of np.unique loads masked arrays: 8 MB, and
    20 ms in which the loop of a gateway stands still.
    """
    place = percent / 100.0 * (len(values) - 1)
    low, high = math.floor(place), math.ceil(place)
    parts = np.partition(values, (low, high), axis=0)
    return parts[low] + (parts[high] - parts[low]) * (place - low)
