"""The port: who may connect, and one receive loop for each connection that was admitted."""

from __future__ import annotations

import asyncio
import contextlib
import logging
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from functools import partial
from typing import Any

from websockets.asyncio.server import Server, ServerConnection, serve
from websockets.exceptions import ConnectionClosed
from websockets.http11 import Request, Response

from hapticvlm.messages import MAX_MESSAGE_BYTES, Error, Frame, MessageError, Scene, Set, decode
from hapticvlm.server import status
from hapticvlm.server.access import Address
from hapticvlm.server.budgets import MAX_TEXT_BYTES, REFUSED, TokenBucket
from hapticvlm.server.connection import Connection, notice_dead_peers
from hapticvlm.server.entrance import Entrance, LimitedSocket
from hapticvlm.server.frame_header import require_header
from hapticvlm.server.gateway import Gateway
from hapticvlm.server.handshake import Handshake, ServiceInfo
from hapticvlm.server.web import http
from hapticvlm.server.web.local_pages import LoopbackPages

OPEN_S = 5.0
CLOSE_S = 1.0
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
        self._entrance = Entrance(gateway.counts)
        self._handshake = Handshake(address, gateway, offer, clock)

    @asynccontextmanager
    async def listen(self) -> AsyncIterator[int]:
        """Accept connections while the context lasts; yields the port."""
        certificate = self._address.certificate
        encrypted: dict[str, Any] = {}
        if certificate is not None:
            encrypted = {
                "ssl": certificate.context,
                "ssl_handshake_timeout": OPEN_S,
                "ssl_shutdown_timeout": CLOSE_S,
            }
        server: Server = await serve(
            self._handle,
            self._address.host,
            self._address.port,
            process_request=self._process_request,
            compression=None,
            create_connection=partial(LimitedSocket, self._entrance),  # type: ignore[arg-type]
            max_size=MAX_MESSAGE_BYTES,
            max_queue=4,
            open_timeout=OPEN_S,
            close_timeout=1,
            ping_interval=None,
            server_header=None,
            **encrypted,
        )
        try:
            yield server.sockets[0].getsockname()[1]
        finally:
            server.close()
            if self._offer.sessions is not None:
                await self._offer.sessions.close()
            try:
                await asyncio.wait_for(asyncio.shield(server.wait_closed()), CLOSE_S)
            except TimeoutError:
                for connection in self._entrance.sockets:
                    connection.transport.abort()
                await server.wait_closed()

    async def _process_request(
        self, connection: ServerConnection, request: Request
    ) -> Response | None:
        response = await self._own_machine.answer(connection, request)
        if response is None:
            response = http.answer(
                connection, request, self._door, partial(status.of_service, self._gateway)
            )
        if response is not None and response.status_code == 403:
            self._gateway.counts["refused: origin"] += 1
        is_guess = response is not None and response.status_code == 401
        if is_guess and "Authorization" in request.headers:
            await self._handshake.slow_guess(str(connection.remote_address[0]))
        return response

    async def _handle(self, socket: ServerConnection) -> None:
        assert isinstance(socket, LimitedSocket)
        notice_dead_peers(socket)
        try:
            connection = await self._handshake.welcome(socket)
            if connection is not None:
                await self._converse(socket, connection)
        except ConnectionClosed as closed:
            if closed.sent is not None and closed.sent.code == TOO_BIG:
                self._gateway.counts["closed: message too big"] += 1

    def _stated(self) -> dict[str, str]:
        """Return what a person stated of the owner's scene, now or before, by object id."""
        owner = self._gateway.owner
        return {**self._offer.saved, **({} if owner is None else owner.stated)}

    async def _converse(self, socket: LimitedSocket, connection: Connection) -> None:
        sender = asyncio.create_task(connection.send_posted())
        refusals = TokenBucket(REFUSED, self._clock())
        try:
            async for data in socket:
                accepted = await self._receive(connection, data)
                if not accepted and not refusals.spend(1, self._clock()):
                    socket.refuse("too many refused messages")
                await asyncio.sleep(0)  # everybody has a turn, whatever this client has sent
        finally:
            self._gateway.leave(connection)
            sender.cancel()
            with contextlib.suppress(asyncio.CancelledError):
                await sender
            logger.info("%s left (%s)", connection.name, socket.close_code)

    async def _receive(self, connection: Connection, data: bytes | str) -> bool:
        """Carry out one message; return whether it was accepted."""
        now = self._clock()
        try:
            if isinstance(data, str) and len(data) > MAX_TEXT_BYTES:
                text = f"$: text messages are at most {MAX_TEXT_BYTES} bytes; send MessagePack"
                raise MessageError("limit", text, path="$")
            message = decode(data)
            if isinstance(message, Set) and message.ownership is not None:
                self._gateway.change_owner(connection, message, now)
            if isinstance(message, Scene) and connection.session.observer:
                await connection.send(self._gateway.state_materials(connection, message, now))
                return True
            if isinstance(message, Frame):
                require_header(message)
            actions = connection.session.receive(message, now)
            if isinstance(message, Scene) and message.replace:
                connection.stated.clear()
        except MessageError as error:
            self._gateway.refuse(error.code)
            reply = Error(id=error.id, code=error.code, text=error.text, path=error.path)
            await connection.send(reply)
            return False
        for answer in self._gateway.carry_out(connection, actions):
            await connection.send(answer)
        return True
