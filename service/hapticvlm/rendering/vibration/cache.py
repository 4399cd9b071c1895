"""Caches arrays that take long to compute, by what they depend on. Pure.

The tables of the materials are the same in every run, and computing them takes 0.4 s, half of the
audio engine's start. So the owner of a file may fill the cache before the first use and save its
contents afterwards (`table_cache.py`).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np
from numpy.typing import NDArray

MAX_ARRAYS = 192  # twice what the built-in materials need; the oldest is dropped

Doubles = NDArray[np.float64]


class ArrayCache:
    """Float64 arrays (N,) by name; `computed` counts those that `fill` did not provide."""

    def __init__(self) -> None:
        self._arrays: dict[str, Doubles] = {}
        self.computed = 0

    def get(self, name: str, compute: Callable[[], Doubles]) -> Doubles:
        """Return the array of this name; compute it on first use. Do not write to it."""
        array = self._arrays.get(name)
        if array is None:
            array = compute()
            array.flags.writeable = False
            self.computed += 1
            self._put(name, array)
        return array

    def fill(self, arrays: Mapping[str, Doubles]) -> None:
        """Add arrays that an earlier run computed."""
        for name, array in arrays.items():
            self._put(name, array)

    def arrays(self) -> dict[str, Doubles]:
        """Return all arrays by name."""
        return dict(self._arrays)

    def _put(self, name: str, array: Doubles) -> None:
        while len(self._arrays) >= MAX_ARRAYS:
            del self._arrays[next(iter(self._arrays))]
        self._arrays[name] = array


CACHE = ArrayCache()
