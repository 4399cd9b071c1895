"""A rejected method to remember contacts: a shape in time for each, and its present height as skin.

If a contact raised the surface by D and lasted for L, then s after its end it still raises it by

    D (w 2/pi acot sqrt(s / L) + (1 - w) (sqrt(1 + s / L) - sqrt(s / L)))

The first term is exact when skin and object met perfectly (flux as 1 / sqrt t), the second when the
contact resistance held the flux even; w = x / (x + 2) is fitted between, x as in contact.py. The
next object then acts on what is left now as if it had always been so. That is what errs: what was
left a moment ago was more, and half of it went into the object too.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from hapticvlm.perception import NEUTRAL_C
from hapticvlm.rendering.heat.contact import ThermalContact, progress, share

_HALF_TURNS = 2.0 / math.pi
MOST_TRACES = 3  # of which the oldest stands for all before it; bounds the cost of a step
_EVEN = 2.0  # x at which half the flux counts as even; fitted to finite differences


@dataclass(frozen=True, slots=True)
class Trace:
    """What an ended contact left: how long it was, when it ended, its change in two parts, degC."""

    lasted_s: float
    ended_at: float
    sharp_c: float
    even_c: float

    def left_c(self, now: float) -> float:
        """How much of it the surface still shows, degC."""
        since = max(now - self.ended_at, 0.0) / self.lasted_s
        root = math.sqrt(since)
        sharp = _HALF_TURNS * math.atan2(1.0, root)
        return self.sharp_c * sharp + self.even_c * (math.sqrt(1.0 + since) - root)


class Traced:
    """The closed form on skin that keeps a trace of every contact it had."""

    def __init__(self, frame_s: float) -> None:
        self._frame_s = frame_s
        self._now = 0.0
        self._begun_at = 0.0
        self._contact: ThermalContact | None = None
        self._traces: tuple[Trace, ...] = ()

    def touch(self, contact: ThermalContact) -> None:
        """Slide to this object; what was touched leaves a trace."""
        if self._contact is not None:
            traces = (*self._traces, self._trace(self._contact))
            self._traces = _bounded(traces, self._now)
        self._contact = contact
        self._begun_at = self._now

    def step(self) -> float:
        """Evaluate every trace and the closed form."""
        self._now += self._frame_s
        return self._skin_c()

    def _skin_c(self) -> float:
        assert self._contact is not None
        rested_c = self._rested_c()
        taken = share(self._contact, self._now - self._begun_at)
        return rested_c + taken * (self._contact.surface_c - rested_c)

    def _rested_c(self) -> float:
        return NEUTRAL_C + sum(trace.left_c(self._now) for trace in self._traces)

    def _trace(self, contact: ThermalContact) -> Trace:
        lasted_s = self._now - self._begun_at
        change_c = self._skin_c() - self._rested_c()
        come = progress(contact, lasted_s)
        sharpness = 1.0 if come == math.inf else come / (come + _EVEN)
        return Trace(lasted_s, self._now, change_c * sharpness, change_c * (1.0 - sharpness))


def _bounded(traces: tuple[Trace, ...], now: float) -> tuple[Trace, ...]:
    """Merge the two oldest traces into one that shows as much now, when there are too many."""
    if len(traces) <= MOST_TRACES:
        return traces
    first, second, *others = traces
    left_c = first.left_c(now) + second.left_c(now)
    lasted_s = second.ended_at - first.ended_at + first.lasted_s
    whole_c = Trace(lasted_s, second.ended_at, 1.0, 0.0).left_c(now)
    return (Trace(lasted_s, second.ended_at, left_c / whole_c, 0.0), *others)
