"""The batch service curve of the bare encoder, and what a deployment makes of it. Pure but for it.

S(b) = fixed + each b, core-seconds of one pass over b crops.
"""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from hapticvlm.vision.encoders.encoder import Encoder
from hapticvlm.vision.pictures import Crop

SIZES = (1, 2, 4, 8, 16, 32, 64)
PASSES = 24


@dataclass(frozen=True, slots=True)
class Curve:
    """Core-seconds of a pass by its size, and the line through them."""

    passes_s: Mapping[int, float]
    fixed_s: float
    each_s: float

    def service_s(self, size: int) -> float:
        """Core-seconds of a pass over `size` crops: measured where it was, else by the line."""
        return self.passes_s.get(size, self.fixed_s + self.each_s * size)

    def rate(self, size: int) -> float:
        """Recognitions per core-second in batches of `size`."""
        return size / self.service_s(size)


def measure(encoder: Encoder, crops: Sequence[Crop]) -> Curve:
    """Time the encoder's passes on one thread: the median of PASSES for each size."""
    passes: dict[int, float] = {}
    for size in SIZES:
        batch = [crops[number % len(crops)] for number in range(size)]
        encoder.embed(batch)
        took = []
        for _ in range(max(3, PASSES // max(1, size // 4))):
            started = time.thread_time()
            encoder.embed(batch)
            took.append(time.thread_time() - started)
        passes[size] = float(np.median(took))
    return fit(passes)


def fit(passes_s: Mapping[int, float]) -> Curve:
    """Fit the line by least squares, each size counted alike relative to its time."""
    sizes = np.array(list(passes_s), np.float64)
    took = np.array(list(passes_s.values()))
    columns = np.stack([np.ones_like(sizes), sizes], axis=1) / took[:, None]
    (fixed, each), *_ = np.linalg.lstsq(columns, np.ones_like(took), rcond=None)
    return Curve(dict(passes_s), max(0.0, float(fixed)), float(each))


def gain(batches: Mapping[int, int], curve: Curve) -> float:
    """How many times more a core-second recognises in these batches than one by one, bare."""
    crops = sum(size * count for size, count in batches.items())
    used = sum(count * curve.service_s(size) for size, count in batches.items())
    return crops / used / curve.rate(1)


def deployed_gain(batches: Mapping[int, int], used_s: Mapping[int, float]) -> float | None:
    """Return the same of a deployment, by the core-seconds of its batches; None without any of 1.

    batches: how many of each size; used_s: core-seconds of all batches of a size.
    """
    if not batches.get(1) or not used_s.get(1):
        return None
    crops = sum(size * count for size, count in batches.items())
    return crops / sum(used_s.values()) / (batches[1] / used_s[1])
