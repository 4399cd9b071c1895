"""Arrays that take long to compute, by what they follow from; a later run may be given them. Pure.

What the materials need is the same in every run: 0.4 s of a processor, half of the audio engine's
start. So whoever owns a file may fill the memo before, and read it out after.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np
from numpy.typing import NDArray

MAX_ARRAYS = 192  # twice what the built-in materials need; the oldest makes room

Doubles = NDArray[np.float64]


class ArrayCache:
    """Float64 arrays (N,) by name; `computed` counts those that it was not given."""

    def __init__(self) -> None:
        self._arrays: dict[str, Doubles] = {}
        self.computed = 0

    def get(self, name: str, compute: Callable[[], Doubles]) -> Doubles:
        """Return the array of this name, computed if it is not there."""
        found = self._arrays.get(name)
        if found is None:
            found = compute()
            found.flags.writeable = False
            self.computed += 1
            self._put(name, found)
        return found

    def fill(self, arrays: Mapping[str, Doubles]) -> None:
        """Take arrays that an earlier run computed."""
        for name, array in arrays.items():
            self._put(name, array)

    def arrays(self) -> dict[str, Doubles]:
        """Return all of them."""
        return dict(self._arrays)

    def _put(self, name: str, array: Doubles) -> None:
        while len(self._arrays) >= MAX_ARRAYS:
            del self._arrays[next(iter(self._arrays))]
        self._arrays[name] = array


CACHE = ArrayCache()
