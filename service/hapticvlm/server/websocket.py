"""The port: answers browsers, admits clients, and carries out the messages of each connection."""

from __future__ import annotations

import asyncio
import logging
import re
from collections.abc import AsyncIterator, Callable, Sequence
from contextlib import asynccontextmanager
from functools import partial

from websockets.http11 import Response

from hapticvlm.messages import (
    MAX_MESSAGE_BYTES,
    ClientMessage,
    Error,
    Frame,
    LeftOut,
    MessageError,
    Scene,
    ServiceMessage,
    Set,
    Stop,
    Touch,
    encode,
)
from hapticvlm.partial_messages import PartialMessage, decode
from hapticvlm.server import status
from hapticvlm.server.access import Address
from hapticvlm.server.connection import Connection, notice_dead_peers
from hapticvlm.server.counters import Count
from hapticvlm.server.edge.limiter import SocketLimiter
from hapticvlm.server.edge.limits import MAX_TEXT_BYTES, REFUSED, STOP_S, STOP_SLOTS, TokenBucket
from hapticvlm.server.edge.listener import Listener
from hapticvlm.server.edge.request import HttpRequest
from hapticvlm.server.edge.socket import ClientSocket
from hapticvlm.server.gateway import Gateway
from hapticvlm.server.handshake import SERVER_FULL, Handshake, ServiceInfo
from hapticvlm.server.web import http, scene_pages
from hapticvlm.server.web.local_pages import LoopbackPages
from hapticvlm.session.overrides import MaterialOverrides
from hapticvlm.vision.pictures import PictureError, check_header

CLOSE_SERVER_FULL = 4003
TOO_BIG = 1009
REPAIR_BYTES = 4096  # of a message that is taken in part, which cost as much as one refusal
MAX_LOGGED = 100  # refused origins; kinds of parts left out, of one connection

logger = logging.getLogger(__name__)


class WebSocketServer:
    """Speaks protocol v1 with each connection and hands messages to its session."""

    def __init__(
        self,
        address: Address,
        gateway: Gateway,
        service_info: ServiceInfo,
        clock: Callable[[], float],
    ) -> None:
        self._address = address
        self._gateway = gateway
        self._service_info = service_info
        self._clock = clock
        self._policy = address.policy()
        self._local_pages = LoopbackPages(self._policy, self._overrides)
        limiter: SocketLimiter[ClientSocket] = SocketLimiter(gateway.counts)
        self._listener = Listener(limiter, self._answer, self._serve, MAX_MESSAGE_BYTES)
        self._handshake = Handshake(address, gateway, service_info)
        self._stop_slots = StopOnlySlots()
        self._refused_origins: set[str] = set()

    @asynccontextmanager
    async def listen(self) -> AsyncIterator[int]:
        """Accept connections while the context lasts; yields the port."""
        address, certificate = self._address, self._address.certificate
        tls = None if certificate is None else certificate.context
        async with self._listener.listen(address.host, address.port, tls) as port:
            yield port

    async def _answer(self, socket: ClientSocket, request: HttpRequest) -> Response | None:
        """Return a page or a refusal; None lets the WebSocket open."""
        response = self._local_pages.answer(socket, request)
        if response is None:
            response = await scene_pages.answer(socket, request, self._policy)
        if response is None:
            response = http.answer(
                socket, request, self._policy, partial(status.of_service, self._gateway)
            )
        if response is not None and response.status_code == 403:
            self._gateway.counts[Count.REFUSED_ORIGIN] += 1
            self._log_refused(request)
        is_guess = response is not None and response.status_code == 401
        if is_guess and request.authorization is not None:
            await self._handshake.slow_guess(socket.remote_address[0])
        return response

    def _log_refused(self, request: HttpRequest) -> None:
        """Log each refused origin once; a browser does not show its page why it was refused."""
        reason, origin = self._policy.refusal(request), request.origin
        if reason is None or origin is None or origin in self._refused_origins:
            return
        if len(self._refused_origins) < MAX_LOGGED:
            self._refused_origins.add(origin)
            logger.warning("refused a page: %s", reason)

    async def _serve(self, socket: ClientSocket) -> None:
        """Serve an open socket from its hello to its end."""
        notice_dead_peers(socket)
        connection = await self._handshake.welcome(socket)
        if connection is not None:
            make = MessageHandler if connection.has_slot else self._stop_slots.make
            handler = make(socket, connection, self._gateway, self._clock)
            await socket.run(handler.receive, handler.on_closed)
        if socket.close_code == TOO_BIG:
            self._gateway.counts[Count.CLOSED_MESSAGE_SIZE] += 1

    def _overrides(self) -> MaterialOverrides:
        """Return the owner's material overrides; without an owner those of the earlier run."""
        owner = self._gateway.owner
        return (
            MaterialOverrides(self._service_info.saved_materials)
            if owner is None
            else owner.session.overrides
        )


class MessageHandler:
    """Carries out the messages of one connection, one by one, and answers them."""

    def __init__(
        self,
        socket: ClientSocket,
        connection: Connection,
        gateway: Gateway,
        clock: Callable[[], float],
    ) -> None:
        self.socket = socket
        self._connection = connection
        self._gateway = gateway
        self._clock = clock
        self._refusals = TokenBucket(REFUSED, clock())
        self._logged: set[str] = set()  # kinds of parts left out

    def receive(self, data: bytes | str) -> None:
        """Carry out one message and answer it."""
        now = self._clock()
        self._connection.has_spoken = True
        message: ClientMessage | None = None
        pieces = 1 + len(data) // REPAIR_BYTES  # a repair costs more than a refusal
        try:
            partial = _read(data, self._connection.session.materials)
            message = partial.message
            answers = self.carry_out(partial, now)
            if partial.left_out and not self._refusals.spend(pieces, now):
                self.socket.refuse(Count.CLOSED_REFUSED_MESSAGES)
        except MessageError as error:
            self._gateway.refuse(error.code)
            refusal = Error(id=error.id, code=error.code, text=error.text, path=error.path)
            answers = [refusal]
            if not self._refusals.spend(1, now):
                self.socket.refuse(Count.CLOSED_REFUSED_MESSAGES)
        for answer in answers:
            self.socket.write(encode(answer, as_text=self._connection.as_text))
        if isinstance(message, Touch):
            self._gateway.scheduler.touched()

    def on_closed(self) -> None:
        """Forget the client; the outputs that it drove rest."""
        self._gateway.leave(self._connection)
        logger.info("%s left (%s)", self._connection.name, self.socket.close_code)

    def carry_out(self, partial: PartialMessage, now: float) -> list[ServiceMessage]:
        """Carry out one message; return its answers. Raises MessageError."""
        connection = self._connection
        message = partial.message
        if isinstance(message, Set) and message.ownership is not None:
            self._gateway.ownership.change(connection, message, now)
        if isinstance(message, Scene) and connection.session.observer:
            for part in partial.left_out:  # a person's choice is taken whole or not at all
                raise MessageError("message", part.text, path=f"$.{part.path}", id=message.id)
            return [self._gateway.override_materials(connection, message, now)]
        if isinstance(message, Frame):
            require_header(message)
        if partial.left_out:
            self._log(partial.left_out)
        actions = connection.session.receive(message, now, partial.left_out)
        return self._gateway.carry_out(connection, actions)

    def _log(self, left_out: Sequence[LeftOut]) -> None:
        """Log what was left out, each kind once for a connection."""
        for part in left_out:
            kind = re.sub(r"\[\d+\]", "[]", part.path)
            if kind not in self._logged and len(self._logged) < MAX_LOGGED:
                self._logged.add(kind)
                logger.warning("%s sent %s: %s", self._connection.name, part.path, part.text)


class StopOnlyHandler(MessageHandler):
    """Takes one `stop`, refuses every other message, and closes."""

    is_over = False

    def carry_out(self, partial: PartialMessage, now: float) -> list[ServiceMessage]:
        """Carry out a stop. Raises MessageError for every other message."""
        if not isinstance(partial.message, Stop):
            raise MessageError("protocol", SERVER_FULL, path="$.type", id=partial.message.id)
        return super().carry_out(partial, now)

    def receive(self, data: bytes | str) -> None:
        """Answer the first message, and close."""
        if not self.is_over:
            self.is_over = True
            super().receive(data)
            self.end()

    def on_closed(self) -> None:
        """Do nothing: this client never joined the gateway."""

    def end(self) -> None:
        """Close the connection."""
        self.socket.close(CLOSE_SERVER_FULL, "no place")


class StopOnlySlots:
    """Clients beyond the limit of connections: each may stop the outputs, and is closed then.

    `hapticvlm stop` must reach a service that a crowd has filled. A client cannot be known for it
    before it has sent its message, so a few more are admitted than there are slots, for STOP_S
    each; the oldest makes room for a newcomer.
    """

    def __init__(self) -> None:
        self._open: list[StopOnlyHandler] = []

    def make(
        self,
        socket: ClientSocket,
        connection: Connection,
        gateway: Gateway,
        clock: Callable[[], float],
    ) -> StopOnlyHandler:
        """Return the handler of a client that found no slot."""
        handler = StopOnlyHandler(socket, connection, gateway, clock)
        self._open.append(handler)
        if len(self._open) > STOP_SLOTS:
            self._open.pop(0).end()
        asyncio.get_running_loop().call_later(STOP_S, self._expire, handler)
        return handler

    def _expire(self, handler: StopOnlyHandler) -> None:
        if handler in self._open:
            self._open.remove(handler)
            handler.end()


def require_header(frame: Frame) -> None:
    """Compare size, format and region with the picture's header; decodes no pixel.

    A session is pure and knows no picture format, so a frame reaches it only when its picture has
    the size that it claims. Raises MessageError.
    """
    try:
        check_header(frame)
    except PictureError as error:
        raise MessageError("message", str(error), path=error.path, id=frame.id) from None


def _read(data: bytes | str, materials: tuple[str, ...]) -> PartialMessage:
    """Decode a message, a scene in part. Raises MessageError."""
    # A character has at least one byte, and text without others than ASCII exactly one.
    if isinstance(data, str) and (
        len(data) > MAX_TEXT_BYTES or (not data.isascii() and len(data.encode()) > MAX_TEXT_BYTES)
    ):
        text = f"$: text messages are at most {MAX_TEXT_BYTES} bytes; send MessagePack"
        raise MessageError("limit", text, path="$")
    return decode(data, materials)
