"""The port: who may connect, and what each client that was admitted says."""

from __future__ import annotations

import logging
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from functools import partial

from websockets.http11 import Request, Response

from hapticvlm.messages import (
    MAX_MESSAGE_BYTES,
    Error,
    Frame,
    MessageError,
    Scene,
    ServiceMessage,
    Set,
    decode,
    encode,
)
from hapticvlm.server import status
from hapticvlm.server.access import Address
from hapticvlm.server.budgets import MAX_TEXT_BYTES, REFUSED, TokenBucket
from hapticvlm.server.connection import Connection, notice_dead_peers
from hapticvlm.server.edge.front_door import FrontDoor
from hapticvlm.server.edge.socket import EdgeSocket
from hapticvlm.server.entrance import Entrance
from hapticvlm.server.frame_header import require_header
from hapticvlm.server.gateway import Gateway
from hapticvlm.server.handshake import Handshake, ServiceInfo
from hapticvlm.server.web import http, scene_pages
from hapticvlm.server.web.local_pages import LoopbackPages

TOO_BIG = 1009

logger = logging.getLogger(__name__)


class WebSocketServer:
    """Speaks protocol v1 with each connection and hands messages to its session."""

    def __init__(
        self, address: Address, gateway: Gateway, offer: ServiceInfo, clock: Callable[[], float]
    ) -> None:
        self._address = address
        self._gateway = gateway
        self._offer = offer
        self._clock = clock
        self._door = address.policy()
        self._own_machine = LoopbackPages(self._door, offer.sessions, self._stated)
        entrance: Entrance[EdgeSocket] = Entrance(gateway.counts)
        self._front_door = FrontDoor(entrance, self._answer, self._serve, MAX_MESSAGE_BYTES)
        self._handshake = Handshake(address, gateway, offer, clock)

    @asynccontextmanager
    async def listen(self) -> AsyncIterator[int]:
        """Accept connections while the context lasts; yields the port."""
        address, certificate = self._address, self._address.certificate
        tls = None if certificate is None else certificate.context
        async with self._front_door.listen(address.host, address.port, tls) as port:
            try:
                yield port
            finally:
                if self._offer.sessions is not None:
                    await self._offer.sessions.close()

    async def _answer(self, socket: EdgeSocket, request: Request) -> Response | None:
        response = await self._own_machine.answer(socket, request)
        if response is None:
            response = await scene_pages.answer(socket, request, self._door)
        if response is None:
            response = http.answer(
                socket, request, self._door, partial(status.of_service, self._gateway)
            )
        if response is not None and response.status_code == 403:
            self._gateway.counts["refused: origin"] += 1
        is_guess = response is not None and response.status_code == 401
        if is_guess and "Authorization" in request.headers:
            await self._handshake.slow_guess(socket.remote_address[0])
        return response

    async def _serve(self, socket: EdgeSocket) -> None:
        notice_dead_peers(socket)
        connection = await self._handshake.welcome(socket)
        if connection is not None:
            talk = Conversation(socket, connection, self._gateway, self._clock)
            await socket.converse(talk.receive, talk.left)
        if socket.close_code == TOO_BIG:
            self._gateway.counts["closed: message too big"] += 1

    def _stated(self) -> dict[str, str]:
        """Return what a person stated of the owner's scene, now or before, by object id."""
        owner = self._gateway.owner
        return {**self._offer.saved, **({} if owner is None else owner.stated)}


class Conversation:
    """What one admitted client says, carried out message by message."""

    def __init__(
        self,
        socket: EdgeSocket,
        connection: Connection,
        gateway: Gateway,
        clock: Callable[[], float],
    ) -> None:
        self._socket = socket
        self._connection = connection
        self._gateway = gateway
        self._clock = clock
        self._refusals = TokenBucket(REFUSED, clock())

    def receive(self, data: bytes | str) -> None:
        """Carry out one message and answer it."""
        now = self._clock()
        try:
            answers = self._answers(data, now)
        except MessageError as error:
            self._gateway.refuse(error.code)
            refusal = Error(id=error.id, code=error.code, text=error.text, path=error.path)
            answers = [refusal]
            if not self._refusals.spend(1, now):
                self._socket.refuse("too many refused messages")
        for answer in answers:
            self._socket.write(encode(answer, as_text=self._connection.as_text))

    def left(self) -> None:
        """Forget the client; what it drove rests."""
        self._gateway.leave(self._connection)
        logger.info("%s left (%s)", self._connection.name, self._socket.close_code)

    def _answers(self, data: bytes | str, now: float) -> list[ServiceMessage]:
        """Carry out one message. Raises MessageError."""
        connection = self._connection
        if isinstance(data, str) and len(data) > MAX_TEXT_BYTES:
            text = f"$: text messages are at most {MAX_TEXT_BYTES} bytes; send MessagePack"
            raise MessageError("limit", text, path="$")
        message = decode(data)
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
