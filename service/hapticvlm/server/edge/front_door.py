"""Where connections come in: listens, has requests answered, and serves the sockets that open."""

from __future__ import annotations

import asyncio
import http
import logging
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import asynccontextmanager
from functools import partial
from ssl import SSLContext
from typing import Any

from websockets.exceptions import ConnectionClosed
from websockets.frames import CloseCode
from websockets.http11 import Request, Response
from websockets.protocol import State

from hapticvlm.server.edge.socket import CLOSE_S, OPEN_S, EdgeSocket
from hapticvlm.server.entrance import Entrance

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
        loop = asyncio.get_running_loop()
        server = await loop.create_server(partial(EdgeSocket, self), host, port, **encrypted)
        try:
            yield server.sockets[0].getsockname()[1]
        finally:
            self._is_closing = True
            server.close()
            await self._close()

    def requested(self, socket: EdgeSocket, request: Request) -> None:
        """Answer the request that begins a connection, and serve what it opens."""
        task = asyncio.create_task(self._open(socket, request))
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)

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
        if self._tasks:
            await asyncio.wait(self._tasks, timeout=CLOSE_S)
        for socket in self.entrance.sockets:
            socket.transport.abort()
        for task in self._tasks:
            task.cancel()
        await asyncio.gather(*self._tasks, return_exceptions=True)
