"""A look-ahead limiter: what would leave [-1, 1] is turned down smoothly beforehand. Pure.

Bending peaks sample by sample would put energy above the band of touch. Here the sound waits
DELAY_S and the gain it needs is known that much earlier: the largest reduction of the last DELAY_S,
released over RELEASE_S, is averaged over DELAY_S, so it is complete when the peak comes out and too
slow to widen the band. What stays within range passes as it was, only later.
"""

from __future__ import annotations

import copy
import math

import numpy as np
from numpy.typing import NDArray

DELAY_S = 1.0 / 600.0  # 80 samples at 48 kHz; of a tap, 5.5 ms are noticed (physics.md 4.4)
RELEASE_S = 0.1  # our choice: longer than a period of 20 Hz, so that the gain follows no wave
CEILING = 0.99
_NONE = 1e-6  # a reduction as small as that has ended

_Floats = NDArray[np.float64]


class Limiter:
    """Keeps a wave of blocks within CEILING; its state is what the next blocks need of the last."""

    def __init__(self, rate_hz: int) -> None:
        self.delay = round(DELAY_S * rate_hz)
        self._fall = math.exp(-1.0 / (RELEASE_S * rate_hz))
        window = np.sin(np.pi * np.arange(1, self.delay + 2) / (self.delay + 2))
        self._window = window / window.sum()
        self._waiting = np.zeros(self.delay, np.float32)
        self._reductions = np.zeros(2 * self.delay)

    def fork(self) -> Limiter:
        """Return a copy that goes its own way."""
        return copy.copy(self)

    @property
    def is_empty(self) -> bool:
        """Whether nothing waits to come out."""
        return not self._waiting.any()

    def clear(self) -> None:
        """Forget what waits."""
        self._waiting = np.zeros_like(self._waiting)
        self._reductions = np.zeros_like(self._reductions)

    def apply(self, part: NDArray[np.float32]) -> None:
        """Replace (N,) by the N samples that come out, each `delay` samples after it went in."""
        if part.size == 0:
            return
        line = np.concatenate((self._waiting, part))
        self._waiting = line[part.size :]
        part[:] = line[: part.size]
        known = self._reductions
        size = np.abs(line[self.delay :])
        if float(size.max()) <= CEILING and not known.any():
            return
        wanted = np.concatenate((known, self._release(size, float(known[-1]))))
        self._reductions = wanted[-known.size :]
        if float(self._reductions.max()) < _NONE:
            self._reductions = np.zeros_like(known)
        highest = np.lib.stride_tricks.sliding_window_view(wanted, self.delay + 1).max(axis=1)
        part *= (1.0 - np.convolve(highest, self._window, "valid")).astype(np.float32)

    def _release(self, size: _Floats, before: float) -> _Floats:
        """Reduction that each sample of this size (N,) needs, or what is left of earlier ones."""
        needed = 1.0 - CEILING / np.maximum(size.astype(np.float64), CEILING)
        fallen = self._fall ** np.arange(1.0, size.size + 1.0)
        return np.asarray(fallen * np.maximum(np.maximum.accumulate(needed / fallen), before))
