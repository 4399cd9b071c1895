"""Stretches the tones of hazy and of dark pictures to the whole scale. Pure.

Haze, an engine's fog and a camera's veil lay one light over everything: nothing is dark any more,
and nothing white. A scene at night uses only the lowest levels. The encoder learned from neither,
and is then unsure, or sure and wrong. Both leave an end of the scale unused, so the levels in use
are spread over all of it. A picture with something white in it, such as a product on its ground,
is neither, however bright it is.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hapticvlm.statistics import percentile

Levels = tuple[int, int]  # of the picture before, which its 0 and its 255 were
WHOLE: Levels = (0, 255)

# Our choice, by the decisions on choose_web that survive fog and darkness (training/LOG.md).
HAZE = 60  # the darkest level of a hazy picture, at least
WHITE = 240  # its lightest level, at most
DARK = 120  # the lightest level of a dark picture, at most
LEAST = 8  # levels between the two: one colour alone has no tones
REST = 1.0  # percent of the pixels that may lie beyond either level
EVERY = 4  # rows and columns that are counted


def stretched(image: NDArray[np.uint8]) -> tuple[NDArray[np.uint8], Levels]:
    """Return (H, W, 3) uint8 with its tones spread if it is hazy or dark, and its levels before."""
    sample = image[::EVERY, ::EVERY].reshape(-1, 3)
    low = int(percentile(sample.min(axis=1), REST))
    high = int(percentile(sample.max(axis=1), 100.0 - REST))
    is_hazy = low >= HAZE and high <= WHITE
    if not (is_hazy or high <= DARK) or high - low < LEAST:
        return image, WHOLE
    spread = (np.arange(256) - low) * (255.0 / (high - low))
    table = np.clip(spread, 0.0, 255.0).astype(np.uint8)
    return table[image], (low, high)


def brightness(image: NDArray[np.uint8], levels: Levels) -> float:
    """Return the mean brightness, 0 to 1, that a picture had before its tones were stretched."""
    low, high = levels
    return (low + float(image.mean()) * (high - low) / 255.0) / 255.0
