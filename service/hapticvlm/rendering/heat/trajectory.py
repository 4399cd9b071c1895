"""The skin over a whole touch: approach, contact, slide to another object midway, release. Pure.

Skin does not forget. A contact that ends leaves its cold (or heat) in the depth of the skin, which
the surface shows until it has spread; the next object meets that skin, not resting skin, and takes
its share of what is left too (thermal_history.py). Against finite differences this errs by at most
0.05 degC over slides from any material to any other, at 10 degC of contrast; skin that began anew
from its surface temperature would err by 6.
Each object is met fresh: where a hand returns to the spot it cooled, the spot's past is not known.
Only a lift shorter than BRIEF_LIFT_S, as between two taps, ends no contact: skin and spot have kept
most of their change then, and two bodies that met perfectly go on where they were.
"""

from __future__ import annotations

import math
from collections.abc import Hashable
from dataclasses import dataclass, replace

from hapticvlm.perception import NEUTRAL_C
from hapticvlm.rendering.heat.contact import LEAD_S, ThermalContact, share
from hapticvlm.rendering.heat.history import (
    Fading,
    Past,
    after,
    aged,
    faded_c,
    fading,
    flow_w_per_m2,
    remaining_c,
)

BRIEF_LIFT_S = 0.15  # s, about the lift of a quick tap; our choice


@dataclass(frozen=True, slots=True)
class ThermalTrajectory:
    """One palm's contacts, past and present; each method returns the next trajectory.

    `lead_s` lets heat run ahead of vibration (docs/physics.md 1.3): an approach waits where the
    skin would be that long after contact and contact goes on from there; 0 is a real object.
    `plate_resistance` is that between palm and plate, m2 K/W: skin lags the plate by it times the
    heat that flows, so the plate goes ahead by as much; 0 takes skin and plate for the same.
    """

    lead_s: float = LEAD_S
    plate_resistance: float = 0.0
    contact: ThermalContact | None = None
    key: Hashable = None
    begun_at: float | None = None
    lifted_at: float | None = None
    past: Past = ()
    past_at: float = 0.0  # when `past` was so
    fading: Fading = ()  # of `past`, under `contact`, from `begun_at` on

    def approach(
        self, contact: ThermalContact | None, now: float, *, leads: bool = True
    ) -> ThermalTrajectory:
        """Wait for a contact, or for nothing known; what was touched is released, if not at once.

        Without `leads` the contact is not near: nothing is waited for.
        """
        if self.begun_at is not None and contact is not None and contact == self.contact:
            lifted_at = now if self.lifted_at is None else self.lifted_at
            if 0.0 <= now - lifted_at < BRIEF_LIFT_S:
                return replace(self, lifted_at=lifted_at)
        return replace(self.release(now), contact=contact if leads else None)

    def touch(self, contact: ThermalContact | None, key: Hashable, now: float) -> ThermalTrajectory:
        """Record contact with the object `key`; call as often as you like.

        A new key is a slide to another object; the same key with another contact is a belief that
        changed, not a touch, so the contact goes on under the new belief. None: material unknown;
        what is known after it begins as a contact does, with its lead.
        """
        if self.begun_at is not None and self.key == key:
            goes_on = self.contact == contact and self.lifted_at is None
            return self if goes_on else replace(self, lifted_at=None)._believing(contact)
        slides = self.begun_at is not None and self.contact is not None and self.lifted_at is None
        ended = self.release(now)
        begun_at = now if slides else now - self.lead_s
        past = aged(ended.past, now - ended.past_at)
        met = replace(ended, key=key, begun_at=begun_at, past=past, past_at=now)
        return met._believing(contact)

    def release(self, now: float) -> ThermalTrajectory:
        """End the contact; what it left in the skin stays and fades."""
        ended_at = now if self.lifted_at is None else self.lifted_at
        rested = ThermalTrajectory(
            self.lead_s, self.plate_resistance, past=self.past, past_at=self.past_at
        )
        if self.contact is None or self.begun_at is None or not ended_at > self.begun_at:
            return rested
        change_c = self.skin_c(ended_at) - self.contact.skin_c
        if not math.isfinite(change_c):
            return rested
        past = after(self.past, self.contact, ended_at - self.begun_at, change_c)
        return replace(rested, past=past, past_at=ended_at)

    def skin_c(self, now: float) -> float:
        """Skin surface as physics has it now; resting skin where nothing was ever touched."""
        contact = self.contact
        if contact is None:
            return NEUTRAL_C + remaining_c(self.past, now - self.past_at)
        if self.begun_at is None:
            return self._expected_c(contact, now + self.lead_s)
        since_s = now - self.begun_at
        driven_c = share(contact, since_s) * (contact.surface_c - contact.skin_c)
        return contact.skin_c + driven_c + faded_c(self.fading, since_s)

    def target_c(self, now: float, gain: float = 1.0) -> float:
        """Plate temperature that physics asks for: neutral unless a hand approaches or touches.

        `gain` scales the deviation from NEUTRAL_C: below 1 damps it, above 1 exaggerates it.
        """
        if self.contact is None:
            return NEUTRAL_C
        ahead_c = self.plate_resistance * self._flow_w_per_m2(self.contact, now)
        return NEUTRAL_C + gain * (self.skin_c(now) + ahead_c - NEUTRAL_C)

    def _flow_w_per_m2(self, contact: ThermalContact, now: float) -> float:
        if self.plate_resistance <= 0.0:
            return 0.0
        if self.begun_at is None:
            past = aged(self.past, now + self.lead_s - self.past_at)
            return flow_w_per_m2(past, contact, self.lead_s)
        return flow_w_per_m2(self.past, contact, now - self.begun_at)

    def _believing(self, contact: ThermalContact | None) -> ThermalTrajectory:
        """Continue under another belief of what is touched."""
        fades = () if contact is None else fading(self.past, contact)
        return replace(self, contact=contact, fading=fades)

    def _expected_c(self, contact: ThermalContact, now: float) -> float:
        """Skin surface at `now` if the contact that is approached began `lead_s` before."""
        rested_c = contact.skin_c + remaining_c(self.past, now - self.past_at)
        return rested_c + share(contact, self.lead_s) * (contact.surface_c - rested_c)
