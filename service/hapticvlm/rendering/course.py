"""The course of a touch: approach, contact, slide to another object midway, release. Pure.

Skin does not forget. A contact that ends leaves its cold (or heat) in the depth of the skin, which
the surface shows until it has spread; the next object meets that skin, not resting skin. If contact
k raised the surface by D and lasted for L, then s after its end it still raises it by

    D (w 2/pi acot sqrt(s / L) + (1 - w) (sqrt(1 + s / L) - sqrt(s / L)))

The first term is exact when skin and object met perfectly (flux as 1 / sqrt t), the second when the
contact resistance held the flux even; w = x / (x + 2) lies between, x as in thermal.py. The next
object then acts on the sum of what is left as on skin of that temperature. Against a
finite-difference slab this errs by at most 0.2 degC over a slide from one material to another and
0.25 over many in a row, at 10 degC of contrast; skin that began anew from its surface temperature
would err by 6.
Each object is met fresh: where a hand returns to the spot it cooled, the spot's past is not known.
Only a lift shorter than BRIEF_LIFT_S, as between two taps, ends no contact: skin and spot have kept
most of their change then, and two bodies that met perfectly go on where they were.
"""

from __future__ import annotations

import math
from collections.abc import Hashable
from dataclasses import dataclass, field, replace

from hapticvlm.perception import NEUTRAL_C
from hapticvlm.rendering.thermal import LEAD_S, ThermalContact, progress, share

BRIEF_LIFT_S = 0.15  # s, about the lift of a quick tap; our choice
MOST_TRACES = 3  # of which the oldest stands for all before it; bounds the cost of a step
_HALF_TURNS = 2.0 / math.pi
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

    def scaled(self, by: float) -> Trace:
        """Return the same with another height."""
        return replace(self, sharp_c=self.sharp_c * by, even_c=self.even_c * by)


@dataclass(frozen=True, slots=True)
class Course:
    """One palm's past and present; begin with Course() and go on with what the methods return.

    `lead_s` lets heat run ahead of vibration (DESIGN 6): an approach waits where the skin would be
    that long after contact and contact goes on from there; 0 tells what a real object would do.
    """

    lead_s: float = LEAD_S
    contact: ThermalContact | None = None
    key: Hashable = None
    begun_at: float | None = None
    lifted_at: float | None = None
    traces: tuple[Trace, ...] = field(default=())

    def approach(self, contact: ThermalContact | None, now: float) -> Course:
        """Wait for a contact, or for nothing known; what was touched is let go, if not at once."""
        if self.begun_at is not None and contact is not None and contact == self.contact:
            lifted_at = now if self.lifted_at is None else self.lifted_at
            if 0.0 <= now - lifted_at < BRIEF_LIFT_S:
                return replace(self, lifted_at=lifted_at)
        return replace(self.release(now), contact=contact)

    def touch(self, contact: ThermalContact | None, key: Hashable, now: float) -> Course:
        """Be in contact with the object `key`; call as often as you like.

        A new key is a slide to another object; the same key with another contact is a belief that
        changed, not a touch, so the contact goes on under the new belief. None: material unknown;
        what is known after it begins as a contact does, with its lead.
        """
        if self.begun_at is not None and self.key == key:
            goes_on = self.contact == contact and self.lifted_at is None
            return self if goes_on else replace(self, contact=contact, lifted_at=None)
        slides = self.begun_at is not None and self.contact is not None and self.lifted_at is None
        ended = self.release(now)
        begun_at = now if slides else now - self.lead_s
        return replace(ended, contact=contact, key=key, begun_at=begun_at)

    def release(self, now: float) -> Course:
        """End the contact; what it left in the skin stays and fades."""
        traces, ended_at = self.traces, now if self.lifted_at is None else self.lifted_at
        if self.begun_at is not None and self.contact is not None and ended_at > self.begun_at:
            new = self._trace(self.contact, self.begun_at, ended_at)
            traces = _bounded((*traces, new), now) if math.isfinite(new.sharp_c) else traces
        return Course(self.lead_s, traces=traces)

    def skin_c(self, now: float) -> float:
        """Skin surface as physics has it now; resting skin where nothing was ever touched."""
        if self.contact is None:
            return self._rested_c(NEUTRAL_C, now)
        since_s = self.lead_s if self.begun_at is None else now - self.begun_at
        rested_c = self._rested_c(self.contact.skin_c, now)
        return rested_c + share(self.contact, since_s) * (self.contact.surface_c - rested_c)

    def wanted_c(self, now: float, gain: float = 1.0) -> float:
        """Plate temperature that physics asks for: neutral unless a hand approaches or touches.

        `gain` scales the deviation from NEUTRAL_C: below 1 damps it, above 1 exaggerates it.
        """
        if self.contact is None:
            return NEUTRAL_C
        return NEUTRAL_C + gain * (self.skin_c(now) - NEUTRAL_C)

    def _rested_c(self, skin_c: float, now: float) -> float:
        """Skin surface if nothing touched it now, degC."""
        for trace in self.traces:
            skin_c += trace.left_c(now)
        return skin_c

    def _trace(self, contact: ThermalContact, begun_at: float, now: float) -> Trace:
        lasted_s = now - begun_at
        change_c = self.skin_c(now) - self._rested_c(contact.skin_c, now)
        come = progress(contact, lasted_s)
        sharpness = 1.0 if come == math.inf else come / (come + _EVEN)
        return Trace(lasted_s, now, change_c * sharpness, change_c * (1.0 - sharpness))


def _bounded(traces: tuple[Trace, ...], now: float) -> tuple[Trace, ...]:
    """Let the two oldest traces become one that shows as much now, when there are too many."""
    if len(traces) <= MOST_TRACES:
        return traces
    first, second, *others = traces
    left_c = first.left_c(now) + second.left_c(now)
    joined = Trace(second.ended_at - first.ended_at + first.lasted_s, second.ended_at, 1.0, 0.0)
    return (joined.scaled(left_c / joined.left_c(now)), *others)
