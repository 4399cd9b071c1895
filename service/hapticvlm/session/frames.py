"""The frames of one connection: how many, how old, and where in the newest to look."""

from __future__ import annotations

import msgspec

from hapticvlm.messages import FRAMES_PER_S, Frame, MessageError, Region, Touch
from hapticvlm.recognition import pictures
from hapticvlm.session.actions import LookAt
from hapticvlm.session.clock import ClockOffset, FrameRate
from hapticvlm.session.hands import LEASE_S, Hand
from hapticvlm.session.scene_objects import Key

LATE_S = LEASE_S  # a contact captured longer ago lapsed on its way; nobody takes it for its cause
BACK_S = {"touch": LATE_S, "frame": 60.0}  # as old as a frame may be; touches come in order
WHOLE = Region(x=0.0, y=0.0, w=1.0, h=1.0)
SURROUNDINGS: Key = ("scene", "scene")


class Frames:
    """What came of one client's camera, and of its clock."""

    def __init__(self) -> None:
        self._clock = ClockOffset()
        self._rate = FrameRate(FRAMES_PER_S)
        self._newest: Frame | None = None
        self._captured_at: dict[str, float] = {}

    def admits(self, frame: Frame, now: float) -> bool:
        """Take in a frame; false if it is one too many. Raises MessageError if it lies of its size.

        The newest live one is kept for what hands touch in it.
        """
        if not self._rate.admits(now):
            return False
        try:
            pictures.check_header(frame)
        except pictures.PictureError as error:
            raise MessageError("message", str(error), path=error.path, id=frame.id) from None
        self._hear("frame", frame.captured_at, now)
        if frame.purpose == "live":
            self._newest = frame
        return True

    def hear(self, touch: Touch, now: float) -> None:
        """Take in what a touch tells of the client's clock."""
        self._hear("touch", touch.captured_at, now)

    def age_s(self, frame: Frame, now: float) -> float:
        """Return how old the frame is, by the client's own clock."""
        return self._clock.age_s(frame.captured_at, now)

    def is_stale(self, frame: Frame, now: float) -> bool:
        """Tell whether the frame has outlived its own `max_age_ms`."""
        return frame.max_age_ms is not None and self.age_s(frame, now) * 1000.0 > frame.max_age_ms

    def is_late(self, touch: Touch, now: float) -> bool:
        """Tell whether a lease would have ended while this touch was on its way."""
        return self._clock.runs and self._clock.age_s(touch.captured_at, now) > LATE_S

    def look_at_region(self, hand: Hand, generation: int) -> list[LookAt]:
        """Have the region a hand touches looked at in the newest frame."""
        if not isinstance(hand.key, tuple) or self._newest is None:
            return []
        touched = msgspec.structs.replace(
            self._newest, id=0, object_id=None, region=hand.region, mask=None, purpose="live"
        )
        return [LookAt(touched, hand.key, generation)]

    def _hear(self, kind: str, captured_at: float, now: float) -> None:
        """Take in a capture time; one that goes far back says that the clock was set."""
        if captured_at < self._captured_at.get(kind, captured_at) - BACK_S[kind]:
            self._clock.restart()
        self._captured_at[kind] = captured_at
        self._clock.observe(captured_at, now)


def look_around(frame: Frame) -> LookAt:
    """Have the whole frame looked at for what the place looks like."""
    whole = msgspec.structs.replace(frame, id=0, object_id=None, region=WHOLE, mask=None)
    return LookAt(whole, SURROUNDINGS, 0)
