"""Where connections come in: listens, has requests answered, and serves the sockets that open."""

from __future__ import annotations

import asyncio
import http
import logging
import socket as socket_
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import asynccontextmanager, suppress
from functools import partial
from ssl import SSLContext
from typing import Any

from websockets.exceptions import ConnectionClosed
from websockets.frames import CloseCode
from websockets.http11 import Request, Response
from websockets.protocol import State

from hapticvlm.server.budgets import MAX_WAITING_SOCKETS
from hapticvlm.server.edge import accepting
from hapticvlm.server.edge.socket import CLOSE_S, OPEN_S, EdgeSocket
from hapticvlm.server.entrance import Entrance
from hapticvlm.server.web.http import is_loopback

Answer = Callable[[EdgeSocket, Request], Awaitable[Response | None]]
Serve = Callable[[EdgeSocket], Awaitable[None]]

logger = logging.getLogger(__name__)


class FrontDoor:
    """Lets clients in: `answer` gives a page, a refusal or None, and `serve` has what is open.

    A message has at most `most_bytes`.
    """

    def __init__(
        self, entrance: Entrance[EdgeSocket], answer: Answer, serve: Serve, most_bytes: int
    ) -> None:
        self.entrance = entrance
        self.most_bytes = most_bytes
        self._answer = answer
        self._serve = serve
        self._tasks: set[asyncio.Task[None]] = set()
        self._arriving: dict[asyncio.Task[None], None] = {}
        self._is_closing = False

    @asynccontextmanager
    async def listen(
        self, host: str, port: int, tls: SSLContext | None = None
    ) -> AsyncIterator[int]:
        """Accept connections while the context lasts, encrypted with `tls`; yields the port."""
        encrypted: dict[str, Any] = {}
        if tls is not None:
            encrypted = {
                "ssl": tls,
                "ssl_handshake_timeout": OPEN_S,
                "ssl_shutdown_timeout": CLOSE_S,
            }
        admit = partial(self._admit, encrypted)
        doors = await accepting.bind(host, port)
        accept = partial(accepting.accept, admit=admit, has_room=self._has_room)
        tasks = [asyncio.create_task(accept(each, counts=self.entrance.counts)) for each in doors]
        try:
            yield int(doors[0].getsockname()[1])
        finally:
            self._is_closing = True
            for task in tasks:
                task.cancel()
            await asyncio.wait(tasks)
            for each in doors:
                each.close()
            await self._close()

    def requested(self, socket: EdgeSocket, request: Request) -> None:
        """Answer the request that begins a connection, and serve what it opens."""
        if is_loopback(socket.remote_address[0]):
            self.entrance.asked(socket, asyncio.get_running_loop().time())
        task = asyncio.create_task(self._open(socket, request))
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)

    def _has_room(self) -> bool:
        return self.entrance.has_room(asyncio.get_running_loop().time())

    def _admit(self, encrypted: dict[str, Any], taken: socket_.socket) -> None:
        """Make a socket of it. One that is long in agreeing on keys makes room as well."""
        task = asyncio.create_task(self._connect(taken, encrypted))
        self._arriving[task] = None
        task.add_done_callback(self._arriving.pop)
        if len(self._arriving) > MAX_WAITING_SOCKETS:
            next(iter(self._arriving)).cancel()

    async def _connect(self, taken: socket_.socket, encrypted: dict[str, Any]) -> None:
        made = partial(EdgeSocket, self)
        with suppress(OSError):  # it has gone, or speaks no TLS
            await asyncio.get_running_loop().connect_accepted_socket(made, taken, **encrypted)

    async def _open(self, socket: EdgeSocket, request: Request) -> None:
        try:
            response = await self._answer(socket, request)
        except Exception:
            logger.exception("no answer for %s", request.path[:80])
            response = socket.protocol.reject(http.HTTPStatus.INTERNAL_SERVER_ERROR, "a bug\n")
        if response is None:
            response = socket.protocol.accept(request)
        if self._is_closing:
            socket.transport.abort()
            return
        await socket.respond(response)
        if socket.state is not State.OPEN:
            return
        try:
            await self._serve(socket)
        except ConnectionClosed:
            pass
        except Exception:
            logger.exception("%s is closed", socket.remote_address[0])
            socket.close(CloseCode.INTERNAL_ERROR)
        socket.close()

    async def _close(self) -> None:
        """Say goodbye to all; who does not answer is cut off."""
        for socket in self.entrance.sockets:
            if socket.state is State.OPEN:
                socket.close(CloseCode.GOING_AWAY)
            else:
                socket.transport.abort()
        for task in self._arriving:
            task.cancel()
        if self._tasks:
            await asyncio.wait(self._tasks, timeout=CLOSE_S)
        for socket in self.entrance.sockets:
            socket.transport.abort()
        for task in self._tasks:
            task.cancel()
        await asyncio.gather(*self._tasks, return_exceptions=True)
