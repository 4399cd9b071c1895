"""When a failing endpoint may be asked again: back-off with jitter, then a circuit breaker. Pure.

After the k-th failure in a row the endpoint rests for FIRST_REST_S 2^(k-1) seconds, jittered so
that many headsets do not come back at once. From TRIP failures on the circuit is open: it rests
for `open_s`, then one question is let through (half-open); its failure opens the circuit again, its
answer closes it. Nothing is repeated and nothing waits here: who is turned away goes without.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

FIRST_REST_S = 0.5
TRIP = 4  # failures in a row that open the circuit: 0.5, 1 and 2 s apart by then
OPEN_S = 30.0
MOST_REST_S = 300.0  # no endpoint rests longer, whatever it asks for
JITTER = 0.5  # a rest is stretched by up to this share

State = Literal["closed", "open", "half-open"]


@dataclass(frozen=True, slots=True)
class Breaker:
    """Failures in a row, and the time in seconds until when nothing may be asked.

    `reason` is the last failure in words; an open circuit rests for `open_s`.
    """

    failures: int = 0
    rests_until: float = 0.0
    reason: str = ""
    open_s: float = OPEN_S

    def rest_s(self, now: float) -> float:
        """Seconds until a question may be asked; 0 when it may be asked now."""
        return max(0.0, self.rests_until - now) if self.failures else 0.0

    def state(self, now: float) -> State:
        """Name the state: open turns all away, half-open lets one question through."""
        if self.failures < TRIP:
            return "closed"
        return "open" if self.rest_s(now) > 0 else "half-open"

    def failed(
        self, now: float, reason: str, *, dice: float, asked_s: float | None = None
    ) -> Breaker:
        """Count a failure. `dice` is uniform in 0..1, `asked_s` the rest the endpoint asked for."""
        failures = self.failures + 1
        rest = self.open_s if failures >= TRIP else FIRST_REST_S * 2.0 ** (failures - 1)
        rest = max(rest * (1.0 + JITTER * dice), asked_s or 0.0)
        until = now + min(rest, MOST_REST_S)
        return replace(self, failures=failures, rests_until=until, reason=reason)

    def succeeded(self) -> Breaker:
        """Forget the failures."""
        return Breaker(open_s=self.open_s)
