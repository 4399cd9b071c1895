"""Limits how many sockets are open at once. Knows neither messages nor WebSockets."""

from __future__ import annotations

from collections import Counter
from contextlib import suppress
from typing import Generic, Protocol, TypeVar

from hapticvlm.server.counters import Count
from hapticvlm.server.edge.limits import (
    ASKED_S,
    HELD_BYTES,
    MAX_CONNECTIONS,
    MAX_WAITING_SOCKETS,
    SPARE_FILES,
    STOP_SLOTS,
)

MOST_FILES = 4096
FEWEST_SOCKETS = 8


class Abortable(Protocol):
    """A transport that can be cut off."""

    def abort(self) -> None:
        """Close at once."""


class Socket(Protocol):
    """An open socket."""

    @property
    def transport(self) -> Abortable:
        """Its transport."""

    def refuse(self, excess: Count) -> None:
        """Close it, naming the budget exceeded."""


S = TypeVar("S", bound=Socket)


class SocketLimiter(Generic[S]):
    """All open sockets. Few may wait before their hello: the oldest makes room for a newcomer."""

    def __init__(self, counts: Counter[Count], most: int | None = None) -> None:
        self.counts = counts
        self._most = socket_limit() if most is None else most
        # Two kinds of sockets. Those that have said nothing yet cost descriptors and nothing else,
        # so some of them wait, and the one that has waited longest makes room for a newcomer: a
        # crowd of silent sockets can then lock nobody out. One that has sent its request is spared
        # for a moment: it is likely to be honest, and its hello on the way. A socket that was
        # admitted is never closed for a newcomer. Kept in the order in which they came, with the
        # time until which they are spared.
        self._waiting: dict[S, float] = {}
        self._admitted: set[S] = set()
        self._held: dict[S, int] = {}  # bytes of input that a socket keeps
        self._held_bytes = 0  # of all sockets

    @property
    def sockets(self) -> list[S]:
        """All open sockets."""
        return [*self._waiting, *self._admitted]

    def add(self, socket: S, now: float) -> None:
        """Admit a new socket; the one that has waited longest for its hello may be closed."""
        self._waiting[socket] = now
        if self._is_full(len(self._waiting)):
            spent = (each for each, until in self._waiting.items() if until <= now)
            oldest = next(spent, socket)
            self.remove(oldest)
            self.counts[Count.CLOSED_WAITING_SOCKETS] += 1
            oldest.transport.abort()

    def mark_requested(self, socket: S, now: float) -> None:
        """Note that a socket of this machine has sent its request."""
        if socket in self._waiting:
            self._waiting[socket] = now + ASKED_S

    def has_room(self, now: float) -> bool:
        """Whether a newcomer finds a place, or a socket that makes room."""
        is_full = self._is_full(len(self._waiting) + 1)
        return not is_full or any(until <= now for until in self._waiting.values())

    def mark_admitted(self, socket: S) -> None:
        """Note that a socket sent its hello and was admitted."""
        if socket in self._waiting:  # else it has made room for another one meanwhile
            del self._waiting[socket]
            self._admitted.add(socket)

    def hold(self, socket: S, count: int) -> None:
        """Note how many bytes of unfinished input a socket keeps.

        A limit for each socket bounds nothing where there are two hundred. When all of them keep
        more than HELD_BYTES, the one that keeps most is closed.
        """
        self._held_bytes += count - self._held.pop(socket, 0)
        if count:
            self._held[socket] = count
        if self._held_bytes > HELD_BYTES:
            largest = max(self._held, key=self._held.__getitem__)
            self.hold(largest, 0)
            largest.refuse(Count.CLOSED_HELD_BYTES)

    def remove(self, socket: S) -> None:
        """Forget a socket."""
        self._held_bytes -= self._held.pop(socket, 0)
        self._waiting.pop(socket, None)
        self._admitted.discard(socket)

    def _is_full(self, waiting: int) -> bool:
        return waiting + len(self._admitted) > self._most or waiting > MAX_WAITING_SOCKETS


def socket_limit() -> int:
    """Return how many sockets the system has descriptors for, after asking it for enough."""
    most = MAX_CONNECTIONS + STOP_SLOTS + MAX_WAITING_SOCKETS
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
