"""Lets a number follow its target smoothly at audio rate. Pure.

A scene sends contacts 60 to 90 times a second. A level that jumped with each message would make
that rate felt. So a value passes two equal low-passes in series, computed in closed form. With its
distance e to the target w and its slope s,

    y(t) = w + (e + (s + e / T) t) exp(-t / T)

Value and slope are both continuous, so blocks of any size join. The kernel is positive, so the
value never leaves the range of its targets. The delay is 2 T = 16 ms, well below the 40 ms at which
the lag of a texture is noticed (Okamoto 2009; docs/physics.md 4.4), and a ripple of 75 Hz is damped
by 23 dB.
"""

from __future__ import annotations

import copy
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

TIME_S = 0.008  # T above
_NEGLIGIBLE = 1e-6  # a smaller distance and slope count as arrived


class SmoothedValue:
    """One value on its way to a target; of the order of 1 to some hundreds."""

    def __init__(self, value: float = 0.0) -> None:
        self.value = value
        self._slope = 0.0  # per time constant

    def fork(self) -> SmoothedValue:
        """Return an independent copy in the same state."""
        return copy.copy(self)

    def follow(self, target: float, count: int, rate_hz: int) -> NDArray[np.float64] | float:
        """Return the next `count` values, (count,), or one number if all of them are equal."""
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
