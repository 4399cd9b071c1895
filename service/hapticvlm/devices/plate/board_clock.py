"""Does a board's clock run as fast as ours? Pure.

A board counts leases, dose and its guards' windows in steps of its own clock. Should that run at
another rate (a flipped bit of a timer, a crystal of another frequency), a second of heat is told
as less and nothing on the board can notice. So its uptime is compared with the host's clock. Single
telemetries are late by whatever the line and this process make of them, so of each window only the
one that was least late counts. A machine that slept makes one window wrong; two in a row are a
fault.
"""

from __future__ import annotations

from dataclasses import dataclass

WINDOW_S = 10.0
LARGEST_DRIFT = 0.05  # ceramic resonators are within 0.5 %; our choice
WRONG_WINDOWS = 2
_UPTIME_WRAPS_MS = 2**32


@dataclass(slots=True)
class BoardClock:
    """What one board's uptime says, from a reset on."""

    is_wrong: bool = False
    _started: tuple[int, float] | None = None
    _window_at: float = 0.0
    _least_late_s: float = 0.0
    _before: tuple[float, float] | None = None  # middle of the last window, its least delay
    _wrong_windows: int = 0

    def note(self, uptime_ms: int, now: float) -> None:
        """Receive an uptime that arrived at `now`."""
        if self._started is None:
            self._started = (uptime_ms, now)
            self._window_at = now
            self._least_late_s = 0.0
            return
        first_ms, begun = self._started
        late_s = (now - begun) - ((uptime_ms - first_ms) % _UPTIME_WRAPS_MS) / 1000.0
        if now - self._window_at >= WINDOW_S:
            self._judge(now)
            self._window_at = now
            self._least_late_s = late_s
        self._least_late_s = min(self._least_late_s, late_s)

    def _judge(self, now: float) -> None:
        before = self._before
        self._before = (now, self._least_late_s)
        if before is None:
            return
        then, was_late_s = before
        # Lateness is what the line, the operating system and this process add: it is never negative
        # and changes from one telemetry to the next. The least of a window is nearly free of it. A
        # clock that runs at the right rate keeps that least value, one that runs wrong moves it by
        # the same share in every window.
        drift = abs(self._least_late_s - was_late_s) / (now - then)
        self._wrong_windows = self._wrong_windows + 1 if drift > LARGEST_DRIFT else 0
        self.is_wrong = self._wrong_windows >= WRONG_WINDOWS
