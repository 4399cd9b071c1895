"""Follows the skin over a whole touch: approach, contact, slide to another object, release. Pure.

Skin has a memory. A contact that ends leaves its cold (or heat) in the depth of the skin, and the
surface shows it until it has spread. The next object meets that skin and not resting skin, and it
takes its share of what is left too (`history.py`). Compared with finite differences this errs by at
most 0.05 degC over slides from any material to any other, at a contrast of 10 degC. A model that
starts every contact from the surface temperature alone would err by 6 degC.

Objects have no memory here: where a hand returns to a spot that it has cooled, the spot is taken to
be at its original temperature. One exception is a lift shorter than BRIEF_LIFT_S, as between two
taps. It does not end the contact, since skin and spot have kept most of their change by then.
"""

from __future__ import annotations

import math
from collections.abc import Hashable
from dataclasses import dataclass, replace

from hapticvlm.perception import NEUTRAL_C
from hapticvlm.rendering.heat.contact import LEAD_S, ThermalContact, share, strength
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

BRIEF_LIFT_S = 0.15  # the lift of a quick tap; our choice (docs/physics.md 1.1)


@dataclass(frozen=True, slots=True)
class ThermalTrajectory:
    """The contacts of one palm, past and present. Each method returns the next trajectory.

    All times are in s on one clock. `lead_s` lets heat lead vibration, because heat is felt later
    (docs/physics.md 1.3): an approach waits at the temperature that the skin would have `lead_s`
    after contact, and the contact continues from there; 0 behaves like a real object.
    `plate_resistance` is that between palm and plate, m2 K/W. The skin lags behind the plate by
    this resistance times the heat flow, so the plate has to lead by as much; 0 takes both
    temperatures as equal. `contact` is what is touched or approached, None for nothing or an
    unknown material.
    """

    lead_s: float = LEAD_S
    plate_resistance: float = 0.0
    contact: ThermalContact | None = None
    key: Hashable = None
    begun_at: float | None = None
    lifted_at: float | None = None
    past: Past = ()
    past_at: float = 0.0  # time of `past`
    fading: Fading = ()  # of `past` under `contact`, from `begun_at` on

    def approach(
        self, contact: ThermalContact | None, now: float, *, leads: bool = True
    ) -> ThermalTrajectory:
        """Record that the palm approaches an object, which ends any contact.

        `contact` is None for an unknown material. If it is the same contact that was just lifted,
        the touch goes on for BRIEF_LIFT_S. Without `leads` the object is not near yet, and the
        plate does not prepare for it.
        """
        if self.begun_at is not None and contact is not None and contact == self.contact:
            lifted_at = now if self.lifted_at is None else self.lifted_at
            if 0.0 <= now - lifted_at < BRIEF_LIFT_S:
                return replace(self, lifted_at=lifted_at)
        return replace(self.release(now), contact=contact if leads else None)

    def touch(self, contact: ThermalContact | None, key: Hashable, now: float) -> ThermalTrajectory:
        """Record contact with the object `key`; may be called any number of times.

        A new key is a slide to another object. The same key with another contact is a changed
        belief about the same object, so the contact continues under the new belief. `contact` is
        None for an unknown material; when it becomes known, the contact begins then, with its lead.
        """
        if self.begun_at is not None and self.key == key:
            is_unchanged = self.contact == contact and self.lifted_at is None
            return self if is_unchanged else replace(self, lifted_at=None)._believing(contact)
        # A slide meets the next object at once. A first contact was approached, and the skin waits
        # where it would be `lead_s` after contact. So the contact counts as begun that much
        # earlier.
        slides = self.begun_at is not None and self.contact is not None and self.lifted_at is None
        ended = self.release(now)
        begun_at = now if slides else now - self.lead_s
        past = aged(ended.past, now - ended.past_at)
        begun = replace(ended, key=key, begun_at=begun_at, past=past, past_at=now)
        return begun._believing(contact)

    def release(self, now: float) -> ThermalTrajectory:
        """End the contact; the change that it left in the skin stays and fades."""
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
        """Temperature of the skin surface by the model, degC; neutral if nothing was touched."""
        contact = self.contact
        if contact is None:
            return NEUTRAL_C + remaining_c(self.past, now - self.past_at)
        if self.begun_at is None:
            return self._expected_c(contact, now + self.lead_s)
        since_s = now - self.begun_at
        driven_c = share(contact, since_s) * (contact.surface_c - contact.skin_c)
        return contact.skin_c + driven_c + faded_c(self.fading, since_s)

    def target_c(self, now: float, gain: float = 1.0) -> float:
        """Plate temperature in degC that brings the skin to `skin_c`; neutral without a contact.

        It is not limited yet (`limits.py`). `gain` scales the deviation from NEUTRAL_C: below 1
        damps it, above 1 exaggerates it.
        """
        if self.contact is None:
            return NEUTRAL_C
        ahead_c = self.plate_resistance * self._flow_w_per_m2(self.contact, now)
        return NEUTRAL_C + gain * (self.skin_c(now) + ahead_c - NEUTRAL_C)

    @property
    def strength(self) -> float:
        """Change that the contact makes in skin, as a share of the strongest material's."""
        return 1.0 if self.contact is None else strength(self.contact.thermal)

    def _flow_w_per_m2(self, contact: ThermalContact, now: float) -> float:
        if self.plate_resistance <= 0.0:
            return 0.0
        if self.begun_at is None:
            past = aged(self.past, now + self.lead_s - self.past_at)
            return flow_w_per_m2(past, contact, self.lead_s)
        return flow_w_per_m2(self.past, contact, now - self.begun_at)

    def _believing(self, contact: ThermalContact | None) -> ThermalTrajectory:
        """Continue under another belief about the object, from the same begin and past."""
        fades = () if contact is None else fading(self.past, contact)
        return replace(self, contact=contact, fading=fades)

    def _expected_c(self, contact: ThermalContact, now: float) -> float:
        """Skin surface at `now` if the approached contact had begun `lead_s` before, degC."""
        rested_c = contact.skin_c + remaining_c(self.past, now - self.past_at)
        return rested_c + share(contact, self.lead_s) * (contact.surface_c - rested_c)
