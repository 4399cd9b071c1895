"""What one admitted client says, carried out message by message, and answered."""

from __future__ import annotations

import logging
from collections.abc import Callable

from hapticvlm.messages import (
    ClientMessage,
    Error,
    Frame,
    MessageError,
    Scene,
    ServiceMessage,
    Set,
    Touch,
    decode,
    encode,
)
from hapticvlm.server.budgets import MAX_TEXT_BYTES, REFUSED, TokenBucket
from hapticvlm.server.connection import Connection
from hapticvlm.server.edge.socket import EdgeSocket
from hapticvlm.server.frame_header import require_header
from hapticvlm.server.gateway import Gateway

logger = logging.getLogger(__name__)


class Conversation:
    """The messages of one connection."""

    def __init__(
        self,
        socket: EdgeSocket,
        connection: Connection,
        gateway: Gateway,
        clock: Callable[[], float],
    ) -> None:
        self.socket = socket
        self._connection = connection
        self._gateway = gateway
        self._clock = clock
        self._refusals = TokenBucket(REFUSED, clock())

    def receive(self, data: bytes | str) -> None:
        """Carry out one message and answer it."""
        now = self._clock()
        self._connection.has_spoken = True
        message: ClientMessage | None = None
        try:
            message = _read(data)
            answers = self.carry_out(message, now)
        except MessageError as error:
            self._gateway.refuse(error.code)
            refusal = Error(id=error.id, code=error.code, text=error.text, path=error.path)
            answers = [refusal]
            if not self._refusals.spend(1, now):
                self.socket.refuse("too many refused messages")
        for answer in answers:
            self.socket.write(encode(answer, as_text=self._connection.as_text))
        if isinstance(message, Touch):
            self._gateway.lull.touched()

    def left(self) -> None:
        """Forget the client; what it drove rests."""
        self._gateway.leave(self._connection)
        logger.info("%s left (%s)", self._connection.name, self.socket.close_code)

    def carry_out(self, message: ClientMessage, now: float) -> list[ServiceMessage]:
        """Carry out one message; return its answers. Raises MessageError."""
        connection = self._connection
        if isinstance(message, Set) and message.ownership is not None:
            self._gateway.change_owner(connection, message, now)
        if isinstance(message, Scene) and connection.session.observer:
            return [self._gateway.state_materials(connection, message, now)]
        if isinstance(message, Frame):
            require_header(message)
        actions = connection.session.receive(message, now)
        if isinstance(message, Scene) and message.replace:
            connection.stated.clear()
        return self._gateway.carry_out(connection, actions)


def _read(data: bytes | str) -> ClientMessage:
    """Decode a message. Raises MessageError."""
    if isinstance(data, str) and len(data) > MAX_TEXT_BYTES:
        text = f"$: text messages are at most {MAX_TEXT_BYTES} bytes; send MessagePack"
        raise MessageError("limit", text, path="$")
    return decode(data)
