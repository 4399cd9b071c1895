"""The table of limits on one client and on all clients together, by phase; the token bucket.

Each is counted where it is spent (`counts` of `/status`); an honest client reaches none of them.
Limits of the protocol itself (`welcome.limits`) stand in `messages.py`.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum, auto

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
MAX_REQUEST_BYTES = 32 * 1024  # browsers send the cookies of all servers of a host
MAX_HELLO_BYTES = 16 * 1024
FRAME_BYTES = 14 + 125  # the longest header of a frame, and the longest ping
MAX_TEXT_BYTES = MIB  # text carries no pictures, and JSON is slow to parse
HELD_BYTES = 64 * MIB  # of all sockets together: unfinished messages, and those that wait
REQUEST_S = 5.0  # for the request, and for each piece of its answer
HELLO_S = 10.0
CLOSE_S = 1.0
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


class Phase(Enum):
    """The phases of a connection, in their order."""

    ASKING = auto()  # one request of HTTP; nothing more is read until its answer has left
    BEFORE_HELLO = auto()  # a WebSocket of a client that is not known yet
    OPEN = auto()  # a WebSocket of an admitted client
    CLOSING = auto()  # what arrives is thrown away
    CLOSED = auto()


@dataclass(frozen=True, slots=True)
class PhaseLimits:
    """The whole budget of a connection in one phase; None: limited by the rates above only.

    `input_bytes` of the phase may arrive, headers of frames included; `frames` of WebSocket may
    arrive; `read_bytes` are taken at once. After `seconds` the connection is closed or cut off.
    """

    input_bytes: int | None
    frames: int | None
    seconds: float | None
    read_bytes: int


PHASES = {
    Phase.ASKING: PhaseLimits(MAX_REQUEST_BYTES, 0, REQUEST_S, READ_BYTES),
    Phase.BEFORE_HELLO: PhaseLimits(
        MAX_HELLO_BYTES + HELLO_FRAMES * FRAME_BYTES, HELLO_FRAMES, HELLO_S, READ_BYTES
    ),
    Phase.OPEN: PhaseLimits(None, None, None, TURN_BYTES),
    Phase.CLOSING: PhaseLimits(0, 0, CLOSE_S, READ_BYTES),
    Phase.CLOSED: PhaseLimits(0, 0, None, READ_BYTES),
}


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
    """The rates of one client, whatever its phase, and its frames before hello."""

    def __init__(self, now: float) -> None:
        self._bytes = TokenBucket(BYTES, now)
        self._messages = TokenBucket(MESSAGES, now)
        self._control = TokenBucket(CONTROL_FRAMES, now)
        self._frames = 0

    def spend_bytes(self, count: int, now: float) -> bool:
        """Count what arrived; false: above the budget."""
        return self._bytes.spend(count, now)

    def excess(self, most: int | None, now: float, *, is_control: bool) -> Count | None:
        """Spend one frame; return the budget that it exceeds, if any.

        `most` frames may come in the present phase; None: as many as the rates let through.
        """
        if most is not None:
            self._frames += 1
            return Count.CLOSED_BEFORE_HELLO if self._frames > most else None
        if is_control:
            return None if self._control.spend(1, now) else Count.CLOSED_CONTROL_FRAMES
        return None if self._messages.spend(1, now) else Count.CLOSED_MESSAGES
