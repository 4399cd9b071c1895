"""Computes the confidence interval of a share. Pure."""

from __future__ import annotations

import math

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
