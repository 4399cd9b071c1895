"""The port: who may connect, what browsers are answered, and who is served."""

from __future__ import annotations

from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from functools import partial

from websockets.http11 import Request, Response

from hapticvlm.messages import MAX_MESSAGE_BYTES
from hapticvlm.server import status
from hapticvlm.server.access import Address
from hapticvlm.server.connection import notice_dead_peers
from hapticvlm.server.conversation import Conversation
from hapticvlm.server.edge.front_door import FrontDoor
from hapticvlm.server.edge.socket import EdgeSocket
from hapticvlm.server.entrance import Entrance
from hapticvlm.server.gateway import Gateway
from hapticvlm.server.handshake import Handshake, ServiceInfo
from hapticvlm.server.stop_places import StopPlaces
from hapticvlm.server.web import http, scene_pages
from hapticvlm.server.web.local_pages import LoopbackPages

TOO_BIG = 1009


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
        self._stops = StopPlaces()

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
            kind = Conversation if connection.has_place else self._stops.make
            talk = kind(socket, connection, self._gateway, self._clock)
            await socket.converse(talk.receive, talk.left)
        if socket.close_code == TOO_BIG:
            self._gateway.counts["closed: message too big"] += 1

    def _stated(self) -> dict[str, str]:
        """Return what a person stated of the owner's scene, now or before, by object id."""
        owner = self._gateway.owner
        return {**self._offer.saved, **({} if owner is None else owner.stated)}
