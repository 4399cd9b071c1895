"""The study of the paper HapticVLM (arXiv 2505.02569): nine people, ten patterns, 450 trials.

The paper prints proportions with two decimals; each row maps to integers that sum to 45 without a
remainder (docs/physics.md 6.1), and those are kept here. Trials of single people are unpublished.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

PARTICIPANTS = 9
REPEATS = 5
VIBRATIONS = (
    "wood carving",
    "glass tapping",
    "wood striking",
    "fabric rubbing",
    "metal whooshing",
)
SHORT = ("WC", "GT", "WS", "FR", "MW")
TEMPERATURES = ("hot", "cold")
CODES = tuple(f"{short}-{warmth[0]}" for warmth in TEMPERATURES for short in SHORT)

_COUNTS = (
    (45, 0, 0, 0, 0, 0, 0, 0, 0, 0),
    (0, 42, 3, 0, 0, 0, 0, 0, 0, 0),
    (0, 2, 37, 3, 0, 0, 0, 1, 0, 2),
    (0, 0, 1, 36, 7, 0, 0, 0, 1, 0),
    (4, 0, 0, 3, 36, 0, 0, 1, 1, 0),
    (3, 0, 0, 0, 0, 42, 0, 0, 0, 0),
    (0, 2, 0, 0, 0, 1, 36, 6, 0, 0),
    (0, 0, 4, 1, 0, 0, 0, 35, 3, 2),
    (0, 0, 0, 1, 0, 0, 1, 3, 34, 6),
    (0, 0, 0, 0, 2, 0, 0, 1, 4, 38),
)
RECOGNISED = 381 / 450  # 84.67 %


def confusion() -> NDArray[np.int64]:
    """Return how often each pattern (rows, CODES) was answered as each, (10, 10); rows sum to 45.

    The five hot patterns come first, then the five cold ones.
    """
    return np.array(_COUNTS, dtype=np.int64)
