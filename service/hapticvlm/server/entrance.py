"""The sockets: how many may be open, and what each may send before anybody has parsed it.

A client that sends more than its budget is closed with 1008, before its excess costs the others a
turn. Knows no message.
"""

from __future__ import annotations

import asyncio
import logging
import time
from collections import Counter
from contextlib import suppress
from typing import Any

from websockets.asyncio.server import ServerConnection
from websockets.frames import CloseCode, Frame, Opcode
from websockets.protocol import OPEN, Event

from hapticvlm.server.budgets import (
    BYTES,
    CONTROL_FRAMES,
    HELLO_FRAMES,
    MAX_CONNECTIONS,
    MAX_WAITING_SOCKETS,
    MESSAGES,
    READ_BYTES,
    SPARE_FILES,
    TokenBucket,
)

MOST_FILES = 4096
FEWEST_SOCKETS = 8
ABORT_S = 1.0
CONTROL = (Opcode.PING, Opcode.PONG)

logger = logging.getLogger(__name__)


class Entrance:
    """All open sockets. Those that have not sent a hello are few: the oldest makes room."""

    def __init__(self, counts: Counter[str], most: int | None = None) -> None:
        self.counts = counts
        self._most = socket_limit() if most is None else most
        # Two kinds of sockets. Those that have said nothing yet cost descriptors and nothing else,
        # so a few of them wait, and the one that has waited longest makes room for a newcomer: a
        # crowd of silent sockets can then lock nobody out. A socket that was admitted is never
        # closed for a newcomer. A dict without values keeps the order in which they came.
        self._waiting: dict[LimitedSocket, None] = {}
        self._greeted: set[LimitedSocket] = set()

    @property
    def sockets(self) -> list[LimitedSocket]:
        """All open sockets."""
        return [*self._waiting, *self._greeted]

    def opened(self, socket: LimitedSocket) -> None:
        """Admit a new socket; the one that has waited longest for its hello may be closed."""
        self._waiting[socket] = None
        is_full = len(self._waiting) + len(self._greeted) > self._most
        if is_full or len(self._waiting) > MAX_WAITING_SOCKETS:
            oldest = next(iter(self._waiting))
            self.closed(oldest)
            self.counts["closed: too many sockets before hello"] += 1
            oldest.transport.abort()

    def greeted(self, socket: LimitedSocket) -> None:
        """Note that a socket sent its hello and was admitted."""
        if socket in self._waiting:  # else it has made room for another one meanwhile
            del self._waiting[socket]
            self._greeted.add(socket)

    def closed(self, socket: LimitedSocket) -> None:
        """Forget a socket."""
        self._waiting.pop(socket, None)
        self._greeted.discard(socket)


class LimitedSocket(ServerConnection):
    """A WebSocket that reads in small pieces and spends budgets for each frame of its peer."""

    def __init__(self, entrance: Entrance, *given: Any, **named: Any) -> None:
        super().__init__(*given, **named)
        now = time.monotonic()
        self._entrance = entrance
        self._messages, self._bytes = TokenBucket(MESSAGES, now), TokenBucket(BYTES, now)
        self._control = TokenBucket(CONTROL_FRAMES, now)
        self._frames_before_hello = 0
        self._is_greeted = False

    def greeted(self) -> None:
        """Set the budgets of an admitted client."""
        self._is_greeted = True
        self._entrance.greeted(self)

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Count the socket and limit it to small reads."""
        super().connection_made(transport)
        if hasattr(transport, "max_size"):
            transport.max_size = READ_BYTES
        self._entrance.opened(self)

    def connection_lost(self, exc: Exception | None) -> None:
        """Forget the socket; there is nothing to abort any more (as in the client, gh-156512)."""
        self._entrance.closed(self)
        super().connection_lost(exc)
        self.transport.abort = lambda: None  # type: ignore[method-assign]

    def data_received(self, data: bytes) -> None:
        """Spend the bytes, then parse them."""
        # Bytes are counted before websockets looks at them: a frame that is never completed, or is
        # compressed, or is no frame at all costs its sender just the same. A refused socket is told
        # why (1008) and may go on sending for ABORT_S, all of which is thrown away unread.
        if not self._bytes.spend(len(data), time.monotonic()):
            self.refuse("too many bytes")
        super().data_received(data)

    def process_event(self, event: Event) -> None:
        """Spend one frame; of a socket that was refused nothing is taken any more."""
        if self.protocol.close_sent is not None and self.protocol.close_rcvd is None:
            return
        excess = self._excess(event) if isinstance(event, Frame) else None
        if excess is not None:
            self.refuse(excess)
            return
        super().process_event(event)

    def refuse(self, what: str) -> None:
        """Close with 1008, naming what was too much; counted, and logged once a connection."""
        if self.protocol.state is not OPEN:
            return
        self._entrance.counts[f"closed: {what}"] += 1
        logger.warning("%s closed: %s", (self.remote_address or ("a client",))[0], what)
        self.protocol.fail(CloseCode.POLICY_VIOLATION, what)
        with suppress(OSError):
            self.send_data()
        self.loop.call_later(ABORT_S, self._abort)  # it may go on sending

    def _abort(self) -> None:
        self.transport.abort()

    def _excess(self, frame: Frame) -> str | None:
        """Name what this frame is too much of, if it is."""
        if not self._is_greeted:
            self._frames_before_hello += 1
            return "too much before hello" if self._frames_before_hello > HELLO_FRAMES else None
        now = time.monotonic()
        if frame.opcode in CONTROL:
            return None if self._control.spend(1, now) else "too many control frames"
        if frame.opcode is Opcode.CLOSE or self._messages.spend(1, now):
            return None
        return "too many messages"


def socket_limit() -> int:
    """Return how many sockets the system has descriptors for, after asking it for enough."""
    most = MAX_CONNECTIONS + MAX_WAITING_SOCKETS
    try:
        import resource
    except ImportError:  # Windows counts no descriptors
        return most
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    wanted = MOST_FILES if hard == resource.RLIM_INFINITY else min(MOST_FILES, hard)
    if soft != resource.RLIM_INFINITY and soft < wanted:
        with suppress(OSError, ValueError):
            resource.setrlimit(resource.RLIMIT_NOFILE, (wanted, hard))
            soft = wanted
    return (
        most
        if soft == resource.RLIM_INFINITY
        else max(FEWEST_SOCKETS, min(most, soft - SPARE_FILES))
    )
