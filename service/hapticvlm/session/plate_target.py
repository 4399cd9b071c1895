"""How one scene drives the plate: by the hand of the latest contact, within limits, never jumping.

Between touches the plate is kept neutral for a while and then released. Knows no message.
"""

from __future__ import annotations

from hapticvlm.perception import NEUTRAL_C
from hapticvlm.rendering.heat import limits as plate_limits
from hapticvlm.rendering.heat.contact import PLATE_RESISTANCE, ThermalContact
from hapticvlm.rendering.heat.limits import AT_REST, PlateReading, limits_of
from hapticvlm.rendering.heat.trajectory import ThermalTrajectory
from hapticvlm.session.actions import Action, DrivePlate, RestPlate
from hapticvlm.session.hands import LEASE_S, Hand
from hapticvlm.session.targets import HandRegion

NEUTRAL_HOLD_S = 30.0  # between touches the plate is kept neutral, not left to cool to the room


class PlateTarget:
    """The trajectory of the skin and the setpoint that moves there; `gain` is 0..1."""

    def __init__(
        self,
        reading: PlateReading = AT_REST,
        plate_resistance: float = PLATE_RESISTANCE,
        gain: float = 1.0,
    ) -> None:
        self.reading = reading
        self.limits = limits_of(reading)
        self.gain = gain
        self._trajectory = ThermalTrajectory(plate_resistance=plate_resistance)
        self._setpoint_c = NEUTRAL_C
        self._is_driving = False
        self._ticked_at: float | None = None

    def elapse(self, now: float, reading: PlateReading) -> float:
        """Receive what the plate reports; return the time since the last call, s."""
        self.reading = reading
        limits = limits_of(reading)
        if limits != self.limits:
            self.limits = limits
        elapsed = 0.0 if self._ticked_at is None else max(0.0, now - self._ticked_at)
        self._ticked_at = now
        return elapsed

    def rest(self, now: float) -> list[Action]:
        """Release the plate, once."""
        self._trajectory = self._trajectory.release(now)
        was_driving = self._is_driving
        self._is_driving = False
        return [RestPlate()] if was_driving else []

    def update(
        self, hand: Hand | None, contact: ThermalContact | None, now: float, elapsed: float
    ) -> list[Action]:
        """Go on with what this hand does now; None = no hand holds a lease."""
        self._trajectory = self._after(hand, contact, now)
        waits = hand is not None and not hand.is_touching and self._trajectory.begun_at is None
        lead = hand.lead(now) if hand is not None and waits else 1.0
        wanted = self._trajectory.wanted_c(now, self.gain * lead)
        if not self._is_driving and self.reading.plate_c is not None:
            low = plate_limits.SETPOINT_MIN_C
            high = plate_limits.SETPOINT_MAX_C
            self._setpoint_c = min(max(self.reading.plate_c, low), high)
        self._is_driving = True
        limited = plate_limits.limit(wanted, self._setpoint_c, elapsed, self.reading)
        self._setpoint_c = limited.setpoint_c
        return [DrivePlate(limited.setpoint_c, LEASE_S)]

    def _after(
        self, hand: Hand | None, contact: ThermalContact | None, now: float
    ) -> ThermalTrajectory:
        """Continue the trajectory.

        A region of a frame does not show where an object ends: another material is another object.
        """
        if hand is None:
            return self._trajectory.release(now)
        if not hand.is_touching:
            return self._trajectory.approach(contact, now, leads=hand.lead(now) > 0.0)
        bulk = contact.thermal if contact and isinstance(hand.target, HandRegion) else None
        return self._trajectory.touch(contact, (hand.name, hand.target, bulk), now)
