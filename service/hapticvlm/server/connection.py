"""One admitted connection: its session, its counts, and the events that wait to be sent."""

from __future__ import annotations

import socket
from collections import Counter, deque
from contextlib import suppress

from websockets.protocol import State

from hapticvlm.messages import ServiceMessage, Telemetry, Vibration, View, encode
from hapticvlm.server.addresses import is_loopback
from hapticvlm.server.counters import Count
from hapticvlm.server.edge.limits import MAX_EVENTS
from hapticvlm.server.edge.socket import ClientSocket
from hapticvlm.session.session import SceneSession

CLOSE_ENDED = 4001
# A dead peer that sends nothing is noticed after 20 s.
IDLE_S = 10
PROBE_S = 2
PROBES = 5
DEAD_AFTER_S = 120  # a peer that acknowledges nothing of what was sent


class Event:
    """A message to several clients, encoded once for all that share an encoding."""

    def __init__(self, message: ServiceMessage) -> None:
        self.message = message
        self._encoded: dict[bool, bytes | str] = {}

    def encoded(self, *, as_text: bool) -> bytes | str:
        """Return the message as JSON text or as MessagePack."""
        if as_text not in self._encoded:
            self._encoded[as_text] = encode(self.message, as_text=as_text)
        return self._encoded[as_text]


class Connection:
    """Shell around one admitted client."""

    def __init__(
        self,
        socket_: ClientSocket,
        name: str,
        session: SceneSession,
        *,
        as_text: bool,
        has_slot: bool = True,
    ) -> None:
        self.name = name
        self.is_local = is_loopback(str(socket_.remote_address[0]))
        self.session = session
        self.watches: frozenset[str] = frozenset()
        self.as_text = as_text
        self.has_slot = has_slot  # else it may only stop the outputs
        self.has_spoken = False  # since its hello
        self._socket = socket_
        self._waiting: deque[Event] = deque()
        self._counts: Counter[Count] = Counter()
        socket_.post_from(self._next_posted)

    @property
    def counts(self) -> Counter[Count]:
        """Events that did not reach this client, and contacts that came too late to be rendered."""
        return self._counts + Counter({Count.LATE_CONTACTS: self.session.late_contacts})

    @property
    def is_idle(self) -> bool:
        """Whether this is an observer that has sent no message: it makes room for others."""
        return self.session.observer and not self.has_spoken

    @property
    def is_open(self) -> bool:
        """Whether neither side has begun to close the connection."""
        return self._socket.state is State.OPEN

    def send(self, message: ServiceMessage) -> None:
        """Send a reply now. The client's next message waits until it has read enough of them."""
        self._socket.write(encode(message, as_text=self.as_text))

    def post(self, message: ServiceMessage | Event) -> None:
        """Send an event soon; telemetry and views give way when the client reads slowly."""
        event = message if isinstance(message, Event) else Event(message)
        if isinstance(event.message, Vibration):
            self._drop_older_plan(event.message)
        if len(self._waiting) >= MAX_EVENTS:
            if isinstance(event.message, Telemetry | View):
                self._counts[Count.EVENTS_NOT_SENT] += 1
                return
            self._make_room()
        self._waiting.append(event)
        self._socket.posted()

    def end(self, reason: str, code: int = CLOSE_ENDED) -> None:
        """Close the connection, also one whose client does not answer any more."""
        self._socket.close(code, reason)

    def _next_posted(self) -> bytes | str | None:
        return self._waiting.popleft().encoded(as_text=self.as_text) if self._waiting else None

    def _drop_older_plan(self, new: Vibration) -> None:
        """Forget a plan for this hand that was not sent: the new one replaces it."""
        for index, waiting in enumerate(self._waiting):
            if isinstance(waiting.message, Vibration) and waiting.message.hand == new.hand:
                if not waiting.message.stopped:
                    del self._waiting[index]
                return

    def _make_room(self) -> None:
        for index, waiting in enumerate(self._waiting):
            if isinstance(waiting.message, Telemetry | View):
                del self._waiting[index]
                break
        else:
            self._waiting.popleft()
        self._counts[Count.EVENTS_NOT_SENT] += 1


def notice_dead_peers(connection: ClientSocket) -> None:
    """Make the kernel end a half-open connection, so that a paused program never loses its own.

    A program that is only paused still has a kernel that answers; a late WebSocket ping would cut
    it off although it is alive. Only one whose buffers stay full for DEAD_AFTER_S is given up.
    """
    raw = connection.transport.get_extra_info("socket")
    if raw is None:
        return
    options = {
        "TCP_KEEPIDLE": IDLE_S,
        "TCP_KEEPALIVE": IDLE_S,  # the same on macOS
        "TCP_KEEPINTVL": PROBE_S,
        "TCP_KEEPCNT": PROBES,
        "TCP_USER_TIMEOUT": DEAD_AFTER_S * 1000,
    }
    with suppress(OSError):
        raw.setsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE, 1)
        for name, value in options.items():
            if hasattr(socket, name):
                raw.setsockopt(socket.IPPROTO_TCP, getattr(socket, name), value)
