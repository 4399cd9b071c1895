"""Figures of samples that several rooms give: what a share may truly be. Pure."""

from __future__ import annotations

import math


def wilson(right: float, n: float) -> tuple[float, float]:
    """95 % interval of a share; (0, 1) when n is 0."""
    if n == 0:
        return 0.0, 1.0
    z, p = 1.96, right / n
    middle, half = p + z * z / (2 * n), z * math.sqrt(p * (1 - p) / n + z * z / (4 * n * n))
    return (middle - half) / (1 + z * z / n), (middle + half) / (1 + z * z / n)
