"""The frames of one connection: how many, how old, and which regions to recognise in the newest.

The offset of a client's clock is the running minimum of arrival minus capture time: the message
that travelled fastest counts. The minimum runs over a window, so a client whose clock jumps back
is believed again after `WINDOW_S`, or at `restart`, instead of having every later frame called old.

A clock that stood still (a browser's does while a laptop sleeps) makes every later message look
late, and so does one that runs slow, as a game's does in slow motion. Messages that were held up in
transit look late, too, but they then arrive in a hurry: each is less late than the one before it.
So a clock whose messages have been late for `SET_AFTER_S`, without catching up, was set and
is measured again. One that this happens to twice within `DISTRUST_S` tells no age until that ends.
"""

from __future__ import annotations

from collections import deque

import msgspec

from hapticvlm.messages import FRAMES_PER_S, WHOLE, Frame, Region, Touch
from hapticvlm.session.hands import LEASE_S, Hand
from hapticvlm.session.targets import SURROUNDINGS, HandRegion, RecognitionRequest

WINDOW_S = 10.0
SET_AFTER_S = 0.25  # our choice
CATCH_UP_S = 0.05  # less late by this much: messages that were held up are arriving
DISTRUST_S = 60.0

LATE_S = LEASE_S  # a contact captured longer ago lapsed in transit; nobody takes it for its cause
BACK_S = {"touch": LATE_S, "frame": 60.0}  # as old as a frame may be; touches come in order


class ClockOffset:
    """Running minimum of `arrival - captured_at` over the last one to two windows."""

    def __init__(self) -> None:
        self._started: float | None = None
        self._current = self._previous = float("inf")
        self._first: float | None = None
        self._runs = False  # a client without a clock sends one number for ever: no age is known
        self._late_since: float | None = None  # since when every message has been late
        self._first_late_s = 0.0  # how late the first of them was
        self._set_at: deque[float] = deque(maxlen=2)  # when the clock was found to be set

    def restart(self) -> None:
        """Forget the offset: the client's clock was set."""
        self._started = None
        self._current = self._previous = float("inf")
        self._late_since = None

    def tells_age(self, now: float) -> bool:
        """Whether the age of a touch by this clock means anything: it runs, and at full speed."""
        return self._runs and not self.is_unsteady(now)

    def is_unsteady(self, now: float) -> bool:
        """Whether the clock was set twice in a short time, as one that runs slow seems to be."""
        return len(self._set_at) == 2 and 0.0 <= now - self._set_at[0] < DISTRUST_S

    def observe(self, captured_at: float, arrived: float) -> None:
        """Receive one message's capture time (client clock) and arrival (service clock)."""
        if self._first is None:
            self._first = captured_at
        self._runs = self._runs or captured_at > self._first
        self._notice_setting(captured_at, arrived)
        if self._started is None or arrived - self._started > WINDOW_S:
            self._started = arrived
            self._previous, self._current = self._current, float("inf")
        self._current = min(self._current, arrived - captured_at)

    def _notice_setting(self, captured_at: float, arrived: float) -> None:
        """Restart if messages have been late for a while and do not catch up."""
        age_s = self.age_s(captured_at, arrived)
        if age_s <= LATE_S:
            self._late_since = None
        elif self._late_since is None or age_s < self._first_late_s - CATCH_UP_S:
            self._late_since = arrived
            self._first_late_s = age_s
        elif arrived - self._late_since >= SET_AFTER_S:
            self._set_at.append(arrived)
            self.restart()

    def age_s(self, captured_at: float, now: float) -> float:
        """Return how long ago `captured_at` was beyond the fastest trip seen, at least 0."""
        offset = min(self._current, self._previous)
        return max(0.0, now - (captured_at + offset)) if offset != float("inf") else 0.0


class FrameRate:
    """A sliding window of one second that decides whether one more frame is within the limit."""

    def __init__(self, per_s: float) -> None:
        self._per_s = per_s
        self._arrivals: deque[float] = deque()

    def admits(self, now: float) -> bool:
        """Count a frame at `now` unless the last second is full."""
        while self._arrivals and not 0.0 <= now - self._arrivals[0] < 1.0:
            self._arrivals.popleft()
        if len(self._arrivals) >= self._per_s:
            return False
        self._arrivals.append(now)
        return True


class Frames:
    """One client's frames and clock."""

    def __init__(self) -> None:
        self._clock = ClockOffset()
        self._rate = FrameRate(FRAMES_PER_S)
        self._newest: Frame | None = None
        self._captured_at: dict[str, float] = {}

    def admits(self, frame: Frame, now: float) -> bool:
        """Receive a frame whose header was checked; return False if it is one too many.

        The newest live one is kept for what hands touch in it.
        """
        if not self._rate.admits(now):
            return False
        self._observe("frame", frame.captured_at, now)
        if frame.purpose == "live":
            self._newest = frame
        return True

    def observe_touch(self, touch: Touch, now: float) -> None:
        """Receive what a touch shows of the client's clock."""
        self._observe("touch", touch.captured_at, now)

    def age_s(self, frame: Frame, now: float) -> float:
        """Return how old the frame is, by the client's own clock."""
        return self._clock.age_s(frame.captured_at, now)

    def is_stale(self, frame: Frame, now: float) -> bool:
        """Whether the frame has outlived its own `max_age_ms`."""
        if frame.max_age_ms is None or self._clock.is_unsteady(now):
            return False
        return self.age_s(frame, now) * 1000.0 > frame.max_age_ms

    def is_late(self, touch: Touch, now: float) -> bool:
        """Whether a lease would have ended while this touch was in transit."""
        return self._clock.tells_age(now) and self._clock.age_s(touch.captured_at, now) > LATE_S

    def recognise_region(self, hand: Hand, generation: int, scene: int) -> list[RecognitionRequest]:
        """Recognise the region a hand touches in the newest frame; nobody waits for the answer."""
        if not isinstance(hand.target, HandRegion) or self._newest is None:
            return []
        picture = part_of(self._newest, hand.region)
        return [RecognitionRequest(hand.target, picture, None, generation, scene=scene)]

    def _observe(self, kind: str, captured_at: float, now: float) -> None:
        """Receive a capture time; one that goes far back means that the clock was set."""
        if captured_at < self._captured_at.get(kind, captured_at) - BACK_S[kind]:
            self._clock.restart()
        self._captured_at[kind] = captured_at
        self._clock.observe(captured_at, now)


def recognise_scene(frame: Frame) -> RecognitionRequest:
    """Recognise the whole frame for its scene view; nobody waits for the answer."""
    return RecognitionRequest(SURROUNDINGS, part_of(frame, WHOLE), None)


def part_of(frame: Frame, region: Region | None) -> Frame:
    """Return the same picture with another region to look at, and without the object's mask."""
    return msgspec.structs.replace(frame, object_id=None, region=region, mask=None)
