"""The clients that found no place: each may stop the outputs, and is closed then.

`hapticvlm stop` must reach a service that a crowd has filled. What it is cannot be known before it
has said it, so a few more are let in than there are places, for a moment each.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable

from hapticvlm.messages import ClientMessage, MessageError, ServiceMessage, Stop
from hapticvlm.server.budgets import STOP_PLACES, STOP_S
from hapticvlm.server.connection import Connection
from hapticvlm.server.conversation import Conversation
from hapticvlm.server.edge.socket import EdgeSocket
from hapticvlm.server.gateway import Gateway
from hapticvlm.server.places import NO_PLACE

CLOSE_NO_PLACE = 4003


class StopOnly(Conversation):
    """Takes a stop, and nothing else."""

    is_over = False

    def carry_out(self, message: ClientMessage, now: float) -> list[ServiceMessage]:
        """Carry out a stop. Raises MessageError for all else."""
        if not isinstance(message, Stop):
            raise MessageError("protocol", NO_PLACE, path="$.type", id=message.id)
        return super().carry_out(message, now)

    def receive(self, data: bytes | str) -> None:
        """Answer the first message, and close."""
        if not self.is_over:
            self.is_over = True
            super().receive(data)
            self.end()

    def left(self) -> None:
        """There is nothing to forget: it never joined."""

    def end(self) -> None:
        """Close the connection."""
        self.socket.close(CLOSE_NO_PLACE, "no place")


class StopPlaces:
    """The few that are let in without a place; the oldest goes when there are more."""

    def __init__(self) -> None:
        self._open: list[StopOnly] = []

    def make(
        self,
        socket: EdgeSocket,
        connection: Connection,
        gateway: Gateway,
        clock: Callable[[], float],
    ) -> StopOnly:
        """Let one in."""
        made = StopOnly(socket, connection, gateway, clock)
        self._open.append(made)
        if len(self._open) > STOP_PLACES:
            self._open.pop(0).end()
        asyncio.get_running_loop().call_later(STOP_S, self._expire, made)
        return made

    def _expire(self, made: StopOnly) -> None:
        if made in self._open:
            self._open.remove(made)
            made.end()
