"""One WebSocket of a client: how it begins, what a server does with it, how it ends.

A socket that sends more than its budget is closed with 1008 before its excess costs the others a
turn. Any that is being closed is cut off soon, so that no client is waited for.
"""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Callable
from http import HTTPStatus
from typing import Protocol, cast

from websockets.exceptions import ConnectionClosedError
from websockets.frames import CloseCode
from websockets.http11 import Request, Response
from websockets.protocol import State

from hapticvlm.server.edge.stream import Stream
from hapticvlm.server.entrance import Entrance

OPEN_S = 5.0  # for the request and its answer
CLOSE_S = 1.0
WRITE_BYTES = 32_768  # that wait to be sent before the client counts as a slow reader
PIECE = 64 * 1024  # of a long page

logger = logging.getLogger(__name__)


class Door(Protocol):
    """What a socket came in by."""

    entrance: Entrance[EdgeSocket]
    most_bytes: int

    def requested(self, socket: EdgeSocket, request: Request) -> None:
        """Answer the request that begins a connection."""


class EdgeSocket(Stream):
    """Our end of one connection."""

    def __init__(self, door: Door) -> None:
        super().__init__(door.most_bytes)
        self.request: Request | None = None
        self._door = door
        self._next_posted: Callable[[], bytes | str | None] = _nothing
        self._is_post_due = self._is_ending = False
        self._news = asyncio.Event()
        self._deadline: asyncio.TimerHandle | None = None

    @property
    def state(self) -> State:
        """Whether it is being opened, is open, is being closed or is closed."""
        return self.protocol.state

    @property
    def close_code(self) -> int:
        """Why it is being closed: what the client said, else what we did."""
        said = self.protocol.close_rcvd or self.protocol.close_sent
        return CloseCode.ABNORMAL_CLOSURE if said is None else said.code

    @property
    def remote_address(self) -> tuple[str, int]:
        """Address and port of the client."""
        return cast("tuple[str, int]", self.transport.get_extra_info("peername") or ("", 0))

    @property
    def local_address(self) -> tuple[str, int]:
        """Address and port it was reached at."""
        return cast("tuple[str, int]", self.transport.get_extra_info("sockname") or ("", 0))

    def greeted(self) -> None:
        """Set the budgets of an admitted client."""
        self.budget.greeted()
        self._door.entrance.greeted(self)

    async def recv(self) -> bytes | str:
        """Return the next message. Raises ConnectionClosed."""
        while not self._inbox:
            if self._has_ended:
                raise ConnectionClosedError(None, None)
            await self._wait()
        return self._next()

    async def converse(
        self, receive: Callable[[bytes | str], None], left: Callable[[], None]
    ) -> None:
        """Hand over each message from now on, until the client has left; then call `left`, once.

        Neither may take long. An error of `receive` closes the socket and is raised here.
        """
        self._receive = receive
        self._left = left
        self._schedule()
        while self._left is not None:
            await self._wait()
        if self._bug is not None:
            raise self._bug

    async def send(self, data: bytes | str) -> None:
        """Send a message, waiting if the client reads slowly. Raises ConnectionClosed."""
        if self.protocol.state is not State.OPEN:
            raise ConnectionClosedError(None, None)
        self.write(data)
        await self.drain()

    async def drain(self) -> None:
        """Wait until the client has read enough of what was sent, or has gone."""
        while not (self.is_writable or self.protocol.state is State.CLOSED):
            await self._wait()

    def post_from(self, next_posted: Callable[[], bytes | str | None]) -> None:
        """Set where messages come from that wait for a slow reader; None: there is no more."""
        self._next_posted = next_posted

    def posted(self) -> None:
        """Note that there is one: it leaves after what is being answered just now."""
        if self.is_writable and not self._is_post_due:
            self._is_post_due = True
            self._loop.call_soon(self._write_posted)

    async def respond(self, response: Response) -> None:
        """Answer the request; a long page goes in pieces, each when the one before has left."""
        if self.protocol.state is not State.CONNECTING or self.protocol.close_expected():
            return  # it has gone, or what it sent is no request
        body = memoryview(response.body)
        whole = response
        if len(body) > PIECE:
            whole = Response(response.status_code, response.reason_phrase, response.headers)
        self.protocol.send_response(whole)
        if whole is not response:
            *head, end = self.protocol.data_to_send()
            self.emit(head)
            for start in range(0, len(body), PIECE):
                if self.transport.is_closing():
                    return
                self._expire(OPEN_S)  # of each piece: a slow network takes long for all of them
                self.transport.write(body[start : start + PIECE])
                await self.drain()
            self.emit([end])
        self.flush()
        if response.status_code == HTTPStatus.SWITCHING_PROTOCOLS:
            self._expire(None)
        self.expect_end()

    def close(self, code: int = CloseCode.NORMAL_CLOSURE, reason: str = "") -> None:
        """Begin to close; a client that does not answer is cut off."""
        if self.protocol.state is State.OPEN:
            self.protocol.send_close(code, reason)
            self.give_up()

    def refuse(self, what: str) -> None:
        """Close with 1008, naming what was too much; counted, and logged once a connection."""
        if self.protocol.state is State.OPEN:
            self._door.entrance.counts[f"closed: {what}"] += 1
            logger.warning("%s closed: %s", self.remote_address[0] or "a client", what)
            self.protocol.fail(CloseCode.POLICY_VIOLATION, what)
            self.give_up()

    def give_up(self) -> None:
        """Throw away what still comes: we have begun to close. Its server is told in a while."""
        self._has_ended = True
        self._inbox.clear()
        self.flush()
        self.expect_end()
        self._schedule()

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Take the transport."""
        self.transport = cast("asyncio.Transport", transport)
        self.transport.set_write_buffer_limits(WRITE_BYTES)
        self._expire(OPEN_S)
        self._door.entrance.opened(self, self._loop.time())

    def requested(self, request: Request) -> None:
        """Hand the request to the door."""
        self.request = request
        self._door.requested(self, request)

    def pause_writing(self) -> None:
        """Note that the client reads slowly."""
        self.is_writable = False

    def resume_writing(self) -> None:
        """Go on with what waited for the client to read."""
        self.is_writable = True
        self.posted()
        self._schedule()
        self.tell()

    def eof_received(self) -> None:
        """Take the end of what the client sends; asyncio closes the transport then."""
        self.protocol.receive_eof()
        self.flush()

    def connection_lost(self, _: Exception | None) -> None:
        """Forget the connection, once what it had sent is carried out."""
        self._expire(None)
        self._door.entrance.closed(self)
        self.protocol.receive_eof()
        self._has_ended = True
        self._let_go()
        self._schedule()
        self.tell()

    def expect_end(self) -> None:
        """Cut the connection off soon if it is being closed."""
        is_open = self.protocol.state is State.OPEN
        if not (is_open or self._is_ending) and self.protocol.close_expected():
            self._is_ending = True
            self._expire(CLOSE_S)

    def tell(self) -> None:
        """Wake those who wait for a message, for room to write, or for the end."""
        self._news.set()

    def _let_go(self) -> None:
        """Break the reference cycles through this socket, so that it is freed at once.

        Python collects cycles seldom here (`commands/run_service.py`), and a socket that was cut
        off in the middle of a message holds up to all of it.
        """
        self._next_posted = _nothing
        protocol = self.protocol
        protocol.parser.close()  # a generator of the protocol, which holds it
        # An error holds the frames it came through, and these the protocol.
        protocol.parser_exc = protocol.handshake_exc = None

    async def _wait(self) -> None:
        self._news.clear()
        await self._news.wait()

    def _expire(self, seconds: float | None) -> None:
        """Cut the connection off in so many seconds, or not."""
        if self._deadline is not None:
            self._deadline.cancel()
        self._deadline = None
        if seconds is not None:
            self._deadline = self._loop.call_later(seconds, self.transport.abort)

    def _write_posted(self) -> None:
        self._is_post_due = False
        while self.is_writable and (data := self._next_posted()) is not None:
            self.write(data)


def _nothing() -> None:
    """Return nothing to send: where nobody posts."""
