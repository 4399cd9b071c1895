"""The table of limits on one client and on all clients together, and the token bucket.

Each is counted where it is spent (`counts` of `/status`); an honest client reaches none of them.
Limits of the protocol itself (`welcome.limits`) stand in `messages.py`.
"""

from __future__ import annotations

from dataclasses import dataclass

from hapticvlm.server.counters import Count

MIB = 1024 * 1024


@dataclass(frozen=True, slots=True)
class Rate:
    """So many a second in the long run, and at most `burst` at once."""

    per_s: float
    burst: float


# Connections.
MAX_CONNECTIONS = 64  # after hello
LOOPBACK_SLOTS = 4  # of these, kept for observers on this machine: the dashboard and its stop
MAX_SCENES = 3  # the owner and two more; pictures of each wait for the one recogniser
MAX_WAITING_SOCKETS = 128  # before hello; the oldest makes room
# A socket of this machine that has sent its request is not closed for a newcomer for so long.
ASKED_S = 0.5
CONNECTS = Rate(per_s=250.0, burst=250.0)  # of one address
STOP_SLOTS = 8  # beyond all slots, for clients that only stop the outputs
STOP_S = 2.0  # they have for it
SPARE_FILES = 40  # descriptors that are not for sockets: children, record, plate, pages

# Input of one socket. A message costs its handling whether it is accepted or not.
READ_BYTES = 2048  # at once: all frames of one read are parsed before anybody else has a turn
TURN_BYTES = 256 * 1024  # at once of one frame whose length is known: it is copied, not parsed
HELLO_FRAMES = 4  # WebSocket frames of any kind before hello
MAX_HELLO_BYTES = 16 * 1024
MAX_TEXT_BYTES = MIB  # text carries no pictures, and JSON is slow to parse
MESSAGES = Rate(per_s=2000.0, burst=4000.0)
REFUSED = Rate(per_s=200.0, burst=2000.0)  # messages answered by `error`
CONTROL_FRAMES = Rate(per_s=20.0, burst=100.0)  # ping and pong
BYTES = Rate(per_s=128.0 * MIB, burst=128.0 * MIB)

# Recognition. Verdicts on an object seen before hardly change within 50 ms, and a recognition costs
# the recogniser some 7 ms; the burst is for clients that ask now and then, and wait for the answer.
RECOGNITION_RATE = Rate(per_s=20.0, burst=10.0)  # of one scene, of what it has shown before

# Queues.
ENROL_BYTES = 32 * MIB  # of all connections together; live frames are bounded by their number
MAX_EVENTS = 256  # to one client that reads slowly
LOG_LINES = 1000  # that wait to be written
LOG_REPEATS = Rate(per_s=5.0, burst=20.0)  # lines of one kind
GUESS_S = 1.0  # pause before a wrong token is answered


class TokenBucket:
    """Lets a rate pass; `now` is in seconds of one clock."""

    def __init__(self, rate: Rate, now: float) -> None:
        self._rate = rate
        self._left = rate.burst
        self._at = now

    def spend(self, amount: float, now: float) -> bool:
        """Take `amount` if it is left; false changes nothing but the time."""
        # The gain since the last time is added now, so no timer runs for each client. A
        # clock that went back gains nothing; the bucket never holds more than its burst, however
        # long nobody came.
        gained = max(0.0, now - self._at) * self._rate.per_s
        self._left = min(self._rate.burst, self._left + gained)
        self._at = now
        if amount > self._left:
            return False
        self._left -= amount
        return True


class PeerBudget:
    """Budget of one client: very little before its hello, then the rates above."""

    def __init__(self, now: float) -> None:
        self._bytes = TokenBucket(BYTES, now)
        self._messages = TokenBucket(MESSAGES, now)
        self._control = TokenBucket(CONTROL_FRAMES, now)
        self._before_hello = HELLO_FRAMES
        self._is_admitted = False

    def mark_admitted(self) -> None:
        """Set the budgets of an admitted client."""
        self._is_admitted = True

    def spend_bytes(self, count: int, now: float) -> bool:
        """Count what arrived; false: above the budget."""
        return self._bytes.spend(count, now)

    def excess(self, now: float, *, is_control: bool) -> Count | None:
        """Spend one frame; return the budget that it exceeds, if any."""
        if not self._is_admitted:
            self._before_hello -= 1
            return Count.CLOSED_BEFORE_HELLO if self._before_hello < 0 else None
        if is_control:
            return None if self._control.spend(1, now) else Count.CLOSED_CONTROL_FRAMES
        return None if self._messages.spend(1, now) else Count.CLOSED_MESSAGES
