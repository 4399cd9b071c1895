"""How one scene drives the plate: by the hand of the latest contact, within limits, without leaps.

Between touches the plate is kept neutral for a while and then let go. Knows no message.
"""

from __future__ import annotations

from hapticvlm.perception import NEUTRAL_C
from hapticvlm.rendering import plate_limits
from hapticvlm.rendering.plate_limits import PlateReading
from hapticvlm.rendering.thermal import ThermalContact
from hapticvlm.rendering.thermal_course import Course
from hapticvlm.session.actions import Action, Heat, RestPlate
from hapticvlm.session.hands import LEASE_S, Hand

NEUTRAL_HOLD_S = 30.0  # between touches the plate is kept neutral, not left to cool to the room
AT_REST = PlateReading(  # until the plate has spoken, nothing but the setpoint band limits
    plate_c=None,
    sink_c=22.0,
    setpoint_c=NEUTRAL_C,
    duty=0.0,
    current_limited=False,
    dose_cem43=0.0,
    heated_s=0.0,
    faults=(),
)


class PlateDrive:
    """The course of the palm on the plate and the setpoint on its way there; `gain` is 0..1."""

    def __init__(self, reading: PlateReading = AT_REST) -> None:
        self.reading = reading
        self.gain = 1.0
        self._course = Course()
        self._setpoint_c = NEUTRAL_C
        self._is_driving = False
        self._touched_at = float("-inf")
        self._ticked_at: float | None = None

    def touched(self, now: float) -> None:
        """Note that a hand is about."""
        self._touched_at = now

    def elapse(self, now: float, reading: PlateReading) -> float:
        """Take in what the plate says; return the time since the last call, s."""
        self.reading = reading
        elapsed = 0.0 if self._ticked_at is None else max(0.0, now - self._ticked_at)
        self._ticked_at = now
        return elapsed

    def rest(self, now: float) -> list[Action]:
        """Let go of the plate, once."""
        self._course = self._course.release(now)
        was_driving, self._is_driving = self._is_driving, False
        return [RestPlate()] if was_driving else []

    def is_idle(self, now: float) -> bool:
        """Whether no hand has been about for so long that the plate may rest."""
        return not 0.0 <= now - self._touched_at <= NEUTRAL_HOLD_S

    def follow(
        self, hand: Hand | None, contact: ThermalContact | None, now: float, elapsed: float
    ) -> list[Action]:
        """Go on with what this hand does now; None = no hand is about."""
        self._course = self._after(hand, contact, now)
        wanted = self._course.wanted_c(now, self.gain)
        if not self._is_driving and self.reading.plate_c is not None:
            low, high = plate_limits.SETPOINT_MIN_C, plate_limits.SETPOINT_MAX_C
            self._setpoint_c = min(max(self.reading.plate_c, low), high)
        self._is_driving = True
        limited = plate_limits.limit(wanted, self._setpoint_c, elapsed, self.reading)
        self._setpoint_c = limited.setpoint_c
        return [Heat(limited.setpoint_c, LEASE_S)]

    def _after(self, hand: Hand | None, contact: ThermalContact | None, now: float) -> Course:
        """Continue the course.

        In a region of a frame no object tells where one ends: another material is another object.
        """
        if hand is None:
            return self._course.release(now)
        if not hand.is_touching:
            return self._course.approach(contact, now)
        bulk = contact.thermal if contact and isinstance(hand.key, tuple) else None
        return self._course.touch(contact, (hand.name, hand.key, bulk), now)
