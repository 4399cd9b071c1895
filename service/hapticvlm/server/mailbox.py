"""What waits of one connection to be recognised: the newest of each kind, all of it bounded."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from typing import Generic, TypeVar

MAX_ENROL_PER_OBJECT = 8
MAX_ENROL_BYTES = 32 * 1024 * 1024

T = TypeVar("T")


class QueueFull(Exception):
    """Too much waits to be enrolled; the client sends too fast."""


class Mailbox(Generic[T]):
    """The newest live item, the newest for each hand, and a queue of those to enrol.

    What a hand touches comes first; live frames and frames to enrol take turns after it.
    """

    def __init__(self) -> None:
        self._live: T | None = None
        self._touched: dict[str, T] = {}
        self._enrol: deque[tuple[T, str | None, int]] = deque()
        self._enrol_next = False
        self.enrol_bytes = 0

    def __bool__(self) -> bool:
        return bool(self._live is not None or self._touched or self._enrol)

    def put_live(self, item: T) -> T | None:
        """Keep the newest live frame; return the one it supersedes."""
        superseded = self._live
        self._live = item
        return superseded

    def put_touch(self, item: T, hand: str) -> T | None:
        """Keep the newest for this hand; return the one it supersedes."""
        superseded = self._touched.get(hand)
        self._touched[hand] = item
        return superseded

    def put_enrol(self, item: T, object_id: str | None, size_bytes: int) -> None:
        """Queue a view of an object. Raises QueueFull."""
        same = sum(waiting[1] == object_id for waiting in self._enrol)
        if same >= MAX_ENROL_PER_OBJECT or self.enrol_bytes + size_bytes > MAX_ENROL_BYTES:
            raise QueueFull
        self._enrol.append((item, object_id, size_bytes))
        self.enrol_bytes += size_bytes

    def take(self, is_due: Callable[[T], bool]) -> T | None:
        """Remove and return what is to be recognised next; a live frame only where `is_due`."""
        if self._touched:
            return self._touched.pop(next(iter(self._touched)))
        # After a live frame it is the turn of one to be enrolled, and the other way round. With a
        # fixed order a scene at 60 frames a second would keep its own teaching waiting for ever, or
        # eight views of each of its objects would keep what is looked at now.
        if self._enrol and self._enrol_next:
            return self._take_enrol()
        if self._live is not None and is_due(self._live):
            self._enrol_next = True
            newest = self._live
            self._live = None
            return newest
        return self._take_enrol() if self._enrol else None

    def _take_enrol(self) -> T:
        self._enrol_next = False
        item, _, size_bytes = self._enrol.popleft()
        self.enrol_bytes -= size_bytes
        return item
