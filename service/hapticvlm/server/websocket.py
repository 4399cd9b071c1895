"""The port: handshake, hello, and one receive loop per connection."""

from __future__ import annotations

import asyncio
import contextlib
import hmac
import itertools
import logging
import secrets
from collections.abc import AsyncIterator, Callable, Mapping
from contextlib import asynccontextmanager
from dataclasses import dataclass
from typing import Any

from websockets.asyncio.server import Server, ServerConnection, serve
from websockets.exceptions import ConnectionClosed
from websockets.http11 import Request, Response

from hapticvlm import __version__
from hapticvlm.materials import Material
from hapticvlm.messages import (
    FRAMES_PER_S,
    LEASE_MS,
    MAX_MESSAGE_BYTES,
    MAX_SIDE_PX,
    PROTOCOL_MAJOR,
    PROTOCOL_MINOR,
    ClientMessage,
    Devices,
    Error,
    Hello,
    Limits,
    MessageError,
    Models,
    Party,
    Privacy,
    ProtocolVersion,
    SetpointRange,
    Welcome,
    decode,
    encode,
)
from hapticvlm.rendering.plate_limits import SETPOINT_MAX_C, SETPOINT_MIN_C
from hapticvlm.server import http
from hapticvlm.server.access import Address
from hapticvlm.server.connection import Connection, notice_dead_peers
from hapticvlm.server.gateway import Gateway
from hapticvlm.server.recorder import Recorder
from hapticvlm.session import recorded
from hapticvlm.session.recorded import RecordedSession
from hapticvlm.session.session import SceneSession

CLOSE_PROTOCOL = 4000
OPEN_S = 5.0
HELLO_S = 10.0
CLOSE_S = 1.0
MAX_HELLO_BYTES = 16 * 1024  # nobody unknown may keep the event loop busy with parsing
MAX_TEXT_BYTES = 1024 * 1024  # text carries no pictures, and JSON is slow to parse
MAX_CONNECTIONS = 64
TOO_BIG = 1009

logger = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True)
class Offer:
    """What `welcome` tells of this service; asks elsewhere = a VLM by url sees frames."""

    devices: Devices
    models: Models
    table: Mapping[str, Material]
    asks_elsewhere: bool = False
    recorder: Recorder | None = None
    contact_resistance: float | None = None


class WebSocketServer:
    """Speaks protocol v1 with each connection and hands messages to its session."""

    def __init__(
        self, address: Address, gateway: Gateway, offer: Offer, clock: Callable[[], float]
    ) -> None:
        self._address = address
        self._gateway = gateway
        self._offer = offer
        self._clock = clock
        self._door = address.policy()
        self._numbers = itertools.count(1)
        self._open_sockets: set[ServerConnection] = set()

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
            try:
                await asyncio.wait_for(asyncio.shield(server.wait_closed()), CLOSE_S)
            except TimeoutError:
                for connection in self._open_sockets.copy():
                    connection.transport.abort()
                await server.wait_closed()

    def _process_request(self, connection: ServerConnection, request: Request) -> Response | None:
        response = http.answer(connection, request, self._door, self._gateway.status)
        if response is not None and response.status_code == 403:
            self._gateway.counts["refused: origin"] += 1
        if response is not None and response.status_code == 401:
            self._gateway.counts["refused: token"] += "Authorization" in request.headers
        return response

    async def _handle(self, socket: ServerConnection) -> None:
        notice_dead_peers(socket)
        self._open_sockets.add(socket)
        try:
            connection = await self._welcome(socket)
            if connection is not None:
                await self._converse(socket, connection)
        except ConnectionClosed as closed:
            if closed.sent is not None and closed.sent.code == TOO_BIG:
                self._gateway.counts["closed: message too big"] += 1
        finally:
            self._open_sockets.discard(socket)

    async def _welcome(self, socket: ServerConnection) -> Connection | None:
        """Wait for hello; answer welcome, or an error and close."""
        as_text = False
        try:
            async with asyncio.timeout(HELLO_S):
                data = await socket.recv()
            as_text = isinstance(data, str)
            if len(data) > MAX_HELLO_BYTES:
                raise MessageError("protocol", f"hello is at most {MAX_HELLO_BYTES} bytes")
            hello = self._admit(decode(data))
        except TimeoutError:
            error = MessageError("protocol", f"no hello within {HELLO_S:.0f} s")
        except MessageError as refused:
            error = refused
        else:
            return await self._open(socket, hello, as_text)
        self._gateway.refuse(error.code)
        text = error.text if error.code == "protocol" else f"before hello: {error.text}"
        answer = Error(id=error.id, code="protocol", text=text, path=error.path)
        await socket.send(encode(answer, as_text=as_text))
        await socket.close(CLOSE_PROTOCOL, "hello first")
        return None

    def _admit(self, message: ClientMessage) -> Hello:
        if not isinstance(message, Hello):
            text = "say hello first: {type: hello, id, client, protocol, role}"
            raise MessageError("protocol", text, path="$.type", id=message.id)
        theirs, ours = message.protocol, f"{PROTOCOL_MAJOR}.{PROTOCOL_MINOR}"
        if theirs.major != PROTOCOL_MAJOR:
            text = (
                f"client speaks protocol {theirs.major}.{theirs.minor}, this service {ours}: "
                "use versions with the same major number"
            )
            raise MessageError("protocol", text, path="$.protocol.major", id=message.id)
        wanted = self._address.token
        given = message.token or ""
        if wanted is not None and not hmac.compare_digest(given.encode(), wanted.encode()):
            text = "wrong or missing token: send the one the service was started with"
            raise MessageError("protocol", text, path="$.token", id=message.id)
        if len(self._gateway.connections) >= MAX_CONNECTIONS:
            text = f"{MAX_CONNECTIONS} connections are open already: close one"
            raise MessageError("protocol", text, id=message.id)
        return message

    async def _open(self, socket: ServerConnection, hello: Hello, as_text: bool) -> Connection:
        observer = hello.role == "observer"
        session = self._session(observer=observer)
        name = f"{hello.client.name[:40]!r} #{next(self._numbers)}"
        connection = Connection(socket, name, session, as_text=as_text)
        self._gateway.join(connection)
        logger.info("%s connected as %s, owner: %s", name, hello.role, session.owner)
        try:
            await connection.send(self._welcome_message(hello, session))
        except ConnectionClosed:
            self._gateway.leave(connection)
            raise
        return connection

    def _session(self, *, observer: bool) -> SceneSession:
        """Begin a session; a scene's is taped when sessions are kept."""
        given: dict[str, Any] = {
            "owner": not observer and self._gateway.owner is None,
            "observer": observer,
            "hold": self._gateway.hold,
            "reading": self._gateway.reading,
            "table": self._offer.table,
            "can_ask": self._offer.models.vlm is not None,
            "contact_resistance": self._offer.contact_resistance,
        }
        if self._offer.recorder is None or observer:
            return SceneSession(**given)
        return RecordedSession(write_line=self._offer.recorder.begin(recorded.head(given)), **given)

    def _welcome_message(self, hello: Hello, session: SceneSession) -> Welcome:
        return Welcome(
            id=hello.id,
            service=Party(name="hapticvlm", version=__version__),
            protocol=ProtocolVersion(major=PROTOCOL_MAJOR, minor=PROTOCOL_MINOR),
            session=secrets.token_hex(8),
            owner=session.owner,
            limits=Limits(
                message_bytes=MAX_MESSAGE_BYTES,
                pixels=MAX_SIDE_PX,
                frames_per_s=FRAMES_PER_S,
                lease_ms=LEASE_MS,
                setpoint_c=SetpointRange(low=SETPOINT_MIN_C, high=SETPOINT_MAX_C),
            ),
            devices=self._offer.devices,
            models=self._offer.models,
            materials=list(self._offer.table),
            privacy=Privacy(
                frames_stored=self._offer.recorder is not None
                and self._offer.recorder.keeps_frames,
                frames_leave_machine=self._offer.asks_elsewhere
                or not http.is_loopback(self._address.host),
            ),
        )

    async def _converse(self, socket: ServerConnection, connection: Connection) -> None:
        sender = asyncio.create_task(connection.send_posted())
        try:
            async for data in socket:
                await self._receive(connection, data)
        finally:
            self._gateway.leave(connection)
            sender.cancel()
            with contextlib.suppress(asyncio.CancelledError):
                await sender
            logger.info("%s left (%s)", connection.name, socket.close_code)

    async def _receive(self, connection: Connection, data: bytes | str) -> None:
        now = self._clock()
        try:
            if isinstance(data, str) and len(data) > MAX_TEXT_BYTES:
                text = f"$: text messages are at most {MAX_TEXT_BYTES} bytes; send MessagePack"
                raise MessageError("limit", text, path="$")
            message = decode(data)
            actions = connection.session.receive(message, now)
        except MessageError as error:
            self._gateway.refuse(error.code)
            reply = Error(id=error.id, code=error.code, text=error.text, path=error.path)
            await connection.send(reply)
            return
        for answer in self._gateway.carry_out(connection, actions):
            await connection.send(answer)
