"""When what failed may be tried again: pauses that double, and a circuit breaker. Pure.

The service waits in three places, each for another fault: a child process that dies is started
again (processes/supervised.py), a scene view whose question failed is asked about again
(session/surroundings.py), an endpoint that fails is left alone (Breaker). An output or a board that
is gone is looked for once a second, since a person plugs it in.

After the k-th failure in a row an endpoint rests for FIRST_REST_S 2^(k-1) seconds, jittered so
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
MAX_REST_S = 300.0  # no endpoint rests longer, whatever it asks for
JITTER = 0.5  # a rest is stretched by up to this share
_MAX_DOUBLINGS = 64  # more would leave the range of a float

State = Literal["closed", "open", "half-open"]


def pause_s(failures: int, first_s: float, longest_s: float) -> float:
    """Seconds to pause after so many failures in a row: 0, `first_s`, then twice the one before."""
    if failures <= 0:
        return 0.0
    return min(longest_s, first_s * 2.0 ** min(failures - 1, _MAX_DOUBLINGS))


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
        self, now: float, reason: str, *, dice: float, requested_s: float | None = None
    ) -> Breaker:
        """Count a failure. `dice` is uniform in 0..1, `requested_s` the rest the endpoint asked for."""
        failures = self.failures + 1
        rest = self.open_s if failures >= TRIP else pause_s(failures, FIRST_REST_S, MAX_REST_S)
        rest = max(rest * (1.0 + JITTER * dice), requested_s or 0.0)
        until = now + min(rest, MAX_REST_S)
        return replace(self, failures=failures, rests_until=until, reason=reason)

    def succeeded(self) -> Breaker:
        """Forget the failures."""
        return Breaker(open_s=self.open_s)
