"""A number that follows its target smoothly at audio rate. Pure.

Contacts come 60 to 90 times a second; a level that jumped with each would add their rate to what is
felt. Here a value goes through two equal low-passes, in closed form: with e its distance to the
target w and s its slope,

    y(t) = w + (e + (s + e / T) t) exp(-t / T)

so blocks of any size join, value and slope are both continuous, and as the kernel is positive the
value never leaves the range of its targets. T delays by 2 T = 16 ms, well within the 40 ms at which
a texture's lag is noticed (Okamoto 2009), and damps a ripple of 75 Hz by 23 dB.
"""

from __future__ import annotations

import copy
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

TIME_S = 0.008
_NEGLIGIBLE = 1e-6  # what is as near as that has arrived


class SmoothedValue:
    """One value on its way, of the order of one to some hundreds."""

    def __init__(self, value: float = 0.0) -> None:
        self.value = value
        self._slope = 0.0  # per time constant

    def fork(self) -> SmoothedValue:
        """Return a copy that goes its own way."""
        return copy.copy(self)

    def follow(self, target: float, count: int, rate_hz: int) -> NDArray[np.float64] | float:
        """Return the next `count` values (count,), or one number if all of them are equal."""
        distance = self.value - target
        if (distance == 0.0 and self._slope == 0.0) or count == 0:
            return self.value
        decay, ramp = _steps(count, rate_hz)
        push = self._slope + distance
        values = target + distance * decay + push * ramp
        self._slope = float(self._slope * decay[-1] - push * ramp[-1])
        self.value = float(values[-1])
        if abs(self.value - target) < _NEGLIGIBLE and abs(self._slope) < _NEGLIGIBLE:
            self.value = target
            self._slope = 0.0
        return np.asarray(values)


@lru_cache(maxsize=16)
def _steps(count: int, rate_hz: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """exp(-t / T) and t / T exp(-t / T) after each of the next samples, (count,) each."""
    time = np.arange(1, count + 1) / (TIME_S * rate_hz)
    decay = np.exp(-time)
    return decay, time * decay
