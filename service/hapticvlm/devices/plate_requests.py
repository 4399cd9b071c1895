"""Orders that must arrive (rest, off, clear): sent again until the board acknowledges. Pure."""

from __future__ import annotations

import math

from hapticvlm.devices import plate_protocol
from hapticvlm.devices.plate_protocol import Ack, Answer, Message, Off, Rest

ANSWER_S, TRIES = 0.15, 5


class Orders:
    """The newest order, and the sequence number of everything the host sends."""

    def __init__(self) -> None:
        self.answer: Answer | None = None  # to the newest order
        self.lost = 0
        self._seq = 0
        self._message: Message | None = None
        self._message_seq = self._tries = 0
        self._sent_at = -math.inf

    @property
    def is_waiting(self) -> bool:
        """Whether the newest order is not answered yet."""
        return self._message is not None

    def encode(self, message: Message) -> bytes:
        """Write a message under the next sequence number."""
        return plate_protocol.encode(message, self._next_seq())

    def put(self, message: Message) -> None:
        """Order something; it replaces an older order, but no rest replaces an unanswered off."""
        if isinstance(message, Rest) and isinstance(self._message, Off):
            return
        self._message, self._message_seq = message, self._next_seq()
        self._tries, self._sent_at, self.answer = 0, -math.inf, None

    def drop(self) -> None:
        """Forget the order."""
        self._message = None

    def drop_rest(self) -> None:
        """Forget an unanswered rest: a newer command must not be undone by its repetition."""
        if isinstance(self._message, Rest):
            self._message = None

    def due(self, now: float) -> bytes:
        """Return the order to send now, or nothing; one that never arrives is counted in `lost`."""
        if self._message is None or now - self._sent_at < ANSWER_S:
            return b""
        if self._tries >= TRIES:
            self.lost += 1
            self._message = None
            return b""
        self._tries += 1
        self._sent_at = now
        return plate_protocol.encode(self._message, self._message_seq)

    def acknowledge(self, ack: Ack) -> None:
        """Receive an acknowledgement; one of another order changes nothing."""
        message = self._message
        if message is None or ack.of_seq != self._message_seq:
            return
        if ack.of_kind == plate_protocol.kind_of(message):
            self._message = None
            self.answer = ack.answer

    def _next_seq(self) -> int:
        self._seq = (self._seq + 1) % 256
        return self._seq
