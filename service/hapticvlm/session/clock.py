"""The offset of a client's clock, from arrivals alone, and the rate of its frames.

The offset is the running minimum of arrival minus capture time: the message that travelled fastest
says most. The minimum runs over a window, so a client whose clock jumps back is believed again
after `WINDOW_S`, or at `restart`, instead of having every later frame called old.
"""

from __future__ import annotations

from collections import deque

WINDOW_S = 10.0


class ClockOffset:
    """Running minimum of `arrival - captured_at` over the last one to two windows."""

    def __init__(self) -> None:
        self._started: float | None = None
        self._current = self._previous = float("inf")
        self._first: float | None = None
        self.runs = False  # a client without a clock sends one number for ever: no age is known

    def restart(self) -> None:
        """Forget the offset: the client's clock was set."""
        self._started = None
        self._current = self._previous = float("inf")

    def observe(self, captured_at: float, arrived: float) -> None:
        """Take in one message's capture time (client clock) and arrival (service clock)."""
        if self._first is None:
            self._first = captured_at
        self.runs = self.runs or captured_at > self._first
        if self._started is None or arrived - self._started > WINDOW_S:
            self._started = arrived
            self._previous, self._current = self._current, float("inf")
        self._current = min(self._current, arrived - captured_at)

    def age_s(self, captured_at: float, now: float) -> float:
        """Return how long ago `captured_at` was beyond the fastest trip seen, at least 0."""
        offset = min(self._current, self._previous)
        return max(0.0, now - (captured_at + offset)) if offset != float("inf") else 0.0


class FrameRate:
    """A sliding window of one second that says whether one more frame is within the limit."""

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
