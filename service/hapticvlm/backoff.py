"""Decides when to retry after a failure: pauses that double, and a circuit breaker. Pure.

The service retries in three places: it restarts a child process that died
(processes/supervised.py), it asks again about a scene view after a failed question
(session/surroundings.py), and it sends requests again to an endpoint that failed (`Breaker`). An
output or a board that is gone is retried once a second, because a person has to plug it in.

After the k-th failure in a row an endpoint rests for FIRST_REST_S 2^(k-1) seconds. The rest is
jittered, so that many clients do not return at once. From TRIP failures on the circuit is open: it
rests for `open_s`, then it is half-open and lets one request through. A failure of that request
opens the circuit again, a success closes it. A request that is refused meanwhile is not queued: its
caller does without.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

FIRST_REST_S = 0.5
TRIP = 4  # failures in a row that open the circuit; 0.5, 1 and 2 s lie between them
OPEN_S = 30.0
MAX_REST_S = 300.0  # an endpoint never rests longer, whatever its Retry-After says
JITTER = 0.5  # a rest is extended by up to this share
_MAX_DOUBLINGS = 64  # more would exceed the range of a float

State = Literal["closed", "open", "half-open"]


def pause_s(failures: int, first_s: float, longest_s: float) -> float:
    """Return the pause in s after so many failures in a row: 0, `first_s`, then double each time.

    It is at most `longest_s`.
    """
    if failures <= 0:
        return 0.0
    return min(longest_s, first_s * 2.0 ** min(failures - 1, _MAX_DOUBLINGS))


@dataclass(frozen=True, slots=True)
class Breaker:
    """State of one endpoint: its failures in a row, and the time until which it rests, s.

    `reason` describes the last failure; an open circuit rests for `open_s`. Each method returns the
    next state.
    """

    failures: int = 0
    rests_until: float = 0.0
    reason: str = ""
    open_s: float = OPEN_S

    def rest_s(self, now: float) -> float:
        """Return the time in s until a request is allowed; 0 if it is allowed now."""
        return max(0.0, self.rests_until - now) if self.failures else 0.0

    def state(self, now: float) -> State:
        """Return the state: "open" refuses all requests, "half-open" lets one through."""
        if self.failures < TRIP:
            return "closed"
        return "open" if self.rest_s(now) > 0 else "half-open"

    def failed(
        self, now: float, reason: str, *, dice: float, requested_s: float | None = None
    ) -> Breaker:
        """Count a failure, for the given reason.

        `dice` is a random number, uniform in 0..1, for the jitter. `requested_s` is the rest that
        the endpoint asked for in Retry-After.
        """
        failures = self.failures + 1
        rest = self.open_s if failures >= TRIP else pause_s(failures, FIRST_REST_S, MAX_REST_S)
        rest = max(rest * (1.0 + JITTER * dice), requested_s or 0.0)
        until = now + min(rest, MAX_REST_S)
        return replace(self, failures=failures, rests_until=until, reason=reason)

    def succeeded(self) -> Breaker:
        """Forget the failures."""
        return Breaker(open_s=self.open_s)
