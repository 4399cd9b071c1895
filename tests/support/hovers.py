"""Hands that hover over a thing without touching it, as clients tell them."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import numpy as np

from hapticvlm.messages import Phase

TICK_S = 0.02
Part = tuple[Phase, float, dict[str, Any]]  # phase of a touch; how long, s; further fields


def sways(mean_m: float, seed: int, seconds: float = 6.0) -> Iterator[Part]:
    """A hand that sways by 5 mm rms at 0.3 to 1.5 Hz, as the client tells it."""
    random = np.random.default_rng(seed)
    rates = 2.0 * math.pi * random.uniform(0.3, 1.5, 5)
    phases = random.uniform(0.0, 2.0 * math.pi, 5)
    size_m = 0.005 * math.sqrt(2.0 / 5.0)
    for step in range(round(seconds / TICK_S)):
        angles = rates * step * TICK_S + phases
        distance_m = max(mean_m + size_m * float(np.sin(angles).sum()), 0.0)
        closing_mps = -size_m * float(rates @ np.cos(angles))
        yield "approach", TICK_S, {"distance_m": distance_m, "closing_mps": closing_mps}


def reach(beyond_m: float, lasts_s: float, length_m: float = 0.4) -> Iterator[Part]:
    """A reach of minimum jerk that ends this far beyond the surface, or before it, and rests."""
    for step in range(round((lasts_s + 1.5) / TICK_S)):
        u = min(step * TICK_S / lasts_s, 1.0)
        gone_m = length_m * u**3 * (10.0 - 15.0 * u + 6.0 * u**2)
        distance_m = length_m - beyond_m - gone_m
        closing_mps = 30.0 * length_m / lasts_s * u**2 * (1.0 - u) ** 2
        if distance_m > 0.0:
            yield "approach", TICK_S, {"distance_m": distance_m, "closing_mps": closing_mps}
        else:
            yield "contact", TICK_S, {"interaction": "press"}


SHORT_M = {0.02: 1.8, 0.05: 1.1, 0.1: 1.1}  # how far a reach stops before metal, and degC felt
REACHES_S = (0.7, 1.0, 1.5)
HOVERS: dict[str, list[Part]] = {
    "sways at 1 cm": [*sways(0.01, 0)],
    "sways at 1 cm otherwise": [*sways(0.01, 1)],
    "sways at 2 cm": [*sways(0.02, 2)],
    "tells a distance and no speed": [("approach", 3.0, {"distance_m": 0.005})],
    "an older client": [("approach", 3.0, {})],
    "an older client, in and out of reach": [("approach", 0.5, {}), ("release", 0.5, {})] * 5,
}
