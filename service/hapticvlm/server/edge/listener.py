"""Accepts connections one at a time, has their requests answered, and serves those that open.

asyncio's own server takes up to a hundred connections in one turn of its loop, and a touch waited
57 ms behind them. This listener takes one a turn, at a limited rate for each address. A connection
above the rate from another machine is closed at once. One from this machine waits in the kernel,
since a hostile program cannot be told from `hapticvlm stop` before it has spoken.
"""

from __future__ import annotations

import asyncio
import errno
import logging
import os
import socket as socket_
import time
from collections import Counter, OrderedDict
from collections.abc import AsyncIterator, Awaitable, Callable, Iterable
from contextlib import asynccontextmanager, suppress
from functools import partial
from ssl import SSLContext
from typing import Any

from websockets.exceptions import ConnectionClosed
from websockets.frames import CloseCode
from websockets.http11 import Response
from websockets.protocol import State

from hapticvlm.server.addresses import is_loopback
from hapticvlm.server.counters import Count
from hapticvlm.server.edge.limiter import SocketLimiter
from hapticvlm.server.edge.limits import (
    CLOSE_S,
    CONNECTS,
    MAX_WAITING_SOCKETS,
    REQUEST_S,
    TokenBucket,
)
from hapticvlm.server.edge.request import HttpRequest, RequestError, refusal
from hapticvlm.server.edge.socket import ClientSocket

BACKLOG = 128  # connections that wait in the kernel
ADDRESSES = 256  # whose rates are remembered
PAUSE_S = 0.01
PORT_TRIES = 10  # to find a port that is free at every address
NOT_HERE = (errno.EADDRNOTAVAIL, errno.EAFNOSUPPORT)  # this machine does not have the address
NO_FILES_S = 0.5  # until the next try when the system has no descriptor left

Answer = Callable[[ClientSocket, HttpRequest], Awaitable[Response | None]]
Serve = Callable[[ClientSocket], Awaitable[None]]

logger = logging.getLogger(__name__)


class Listener:
    """Accepts clients: `answer` gives a page, a refusal or None, and `serve` takes open sockets.

    A message has at most `max_bytes`.
    """

    def __init__(
        self, limiter: SocketLimiter[ClientSocket], answer: Answer, serve: Serve, max_bytes: int
    ) -> None:
        self.limiter = limiter
        self.max_bytes = max_bytes
        self._answer = answer
        self._serve = serve
        self._tasks: set[asyncio.Task[None]] = set()
        self._connecting: dict[asyncio.Task[None], None] = {}
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
                "ssl_handshake_timeout": REQUEST_S,
                "ssl_shutdown_timeout": CLOSE_S,
            }
        admit = partial(self._admit, encrypted)
        sockets = await bind(host, port)
        rates = ConnectRates()
        tasks = [
            asyncio.create_task(accept(each, admit, self._has_room, rates, self.limiter.counts))
            for each in sockets
        ]
        try:
            yield int(sockets[0].getsockname()[1])
        finally:
            self._is_closing = True
            for task in tasks:
                task.cancel()
            await asyncio.wait(tasks)
            for each in sockets:
                each.close()
            await self._close()

    def on_request(self, socket: ClientSocket, request: HttpRequest) -> None:
        """Answer the request that begins a connection, and serve the socket that it opens."""
        if is_loopback(socket.remote_address[0]):
            self.limiter.mark_requested(socket, asyncio.get_running_loop().time())
        task = asyncio.create_task(self._open(socket, request))
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)

    def _has_room(self) -> bool:
        return self.limiter.has_room(asyncio.get_running_loop().time())

    def _admit(self, encrypted: dict[str, Any], accepted: socket_.socket) -> None:
        """Start the connection. The oldest of too many that are still agreeing on keys is ended."""
        task = asyncio.create_task(self._connect(accepted, encrypted))
        self._connecting[task] = None
        task.add_done_callback(self._connecting.pop)
        if len(self._connecting) > MAX_WAITING_SOCKETS:
            next(iter(self._connecting)).cancel()

    async def _connect(self, accepted: socket_.socket, encrypted: dict[str, Any]) -> None:
        make = partial(ClientSocket, self)
        with suppress(OSError):  # the client has gone, or speaks no TLS
            await asyncio.get_running_loop().connect_accepted_socket(make, accepted, **encrypted)

    async def _open(self, socket: ClientSocket, request: HttpRequest) -> None:
        try:
            response = await self._answer(socket, request)
        except Exception:
            logger.exception("no answer for %s", request.path[:80])
            response = refusal(RequestError(500, "internal error"))
        if response is None:
            response = socket.accept(request)
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
        """Close every socket; those that do not answer within CLOSE_S are cut off."""
        for socket in self.limiter.sockets:
            if socket.state is State.OPEN:
                socket.close(CloseCode.GOING_AWAY)
            else:
                socket.transport.abort()
        for task in self._connecting:
            task.cancel()
        if self._tasks:
            await asyncio.wait(self._tasks, timeout=CLOSE_S)
        for socket in self.limiter.sockets:
            socket.transport.abort()
        for task in self._tasks:
            task.cancel()
        await asyncio.gather(*self._tasks, return_exceptions=True)


class ConnectRates:
    """Limits the connections of each address a second; all of this machine are one address."""

    def __init__(self) -> None:
        self._buckets: OrderedDict[str, TokenBucket] = OrderedDict()

    def spend(self, address: str, now: float) -> bool:
        """Count a connection; false: the address is above its rate."""
        key = "" if is_loopback(address) else address
        bucket = self._buckets.pop(key, None) or TokenBucket(CONNECTS, now)
        self._buckets[key] = bucket
        if len(self._buckets) > ADDRESSES:
            self._buckets.popitem(last=False)
        return bucket.spend(1, now)


async def bind(host: str, port: int) -> list[socket_.socket]:
    """Return sockets that listen at every address of a host, all at one port. Raises OSError.

    At 127.0.0.1 they include ::1 where that is free. `localhost` means either of them, and there
    are clients that try only one.
    """
    sockets = await _bind_host(host, port)
    if host == "127.0.0.1":
        with suppress(OSError):
            sockets.append(_listening(socket_.AF_INET6, ("::1", sockets[0].getsockname()[1])))
    return sockets


async def _bind_host(host: str, port: int) -> list[socket_.socket]:
    loop = asyncio.get_running_loop()
    tries = PORT_TRIES if port == 0 else 1
    while True:
        rows = await loop.getaddrinfo(
            host, port, type=socket_.SOCK_STREAM, flags=socket_.AI_PASSIVE
        )
        tries -= 1
        try:
            return _listening_at(dict.fromkeys((row[0], row[4]) for row in rows))
        except OSError as error:
            # The system chose a port for the first address that is taken at another one.
            if error.errno != errno.EADDRINUSE or not tries:
                raise


def _listening_at(addresses: Iterable[tuple[int, Any]]) -> list[socket_.socket]:
    """Listen at these addresses; those after the first take its port where they name none.

    `localhost` often has an address of a family that is switched off. An address that this machine
    does not have is left out, unless it has none of them.
    """
    sockets: list[socket_.socket] = []
    missing = OSError(errno.EADDRNOTAVAIL, "the host has no address")
    try:
        for family, (address, port, *rest) in addresses:
            common_port = port or (sockets[0].getsockname()[1] if sockets else 0)
            try:
                sockets.append(_listening(family, (address, common_port, *rest)))
            except OSError as error:
                if error.errno not in NOT_HERE:
                    raise
                missing = error
        if not sockets:
            raise missing
    except OSError:
        for each in sockets:
            each.close()
        raise
    return sockets


def _listening(family: int, address: Any) -> socket_.socket:  # noqa: ANN401 - differs by family
    # The protocol is given, though there is only one: asyncio sends small answers at once
    # (TCP_NODELAY) on sockets that name it, and lets the kernel gather those of others.
    socket = socket_.socket(family, socket_.SOCK_STREAM, socket_.IPPROTO_TCP)
    try:
        socket.setblocking(False)
        if os.name == "posix":
            socket.setsockopt(socket_.SOL_SOCKET, socket_.SO_REUSEADDR, 1)
        if family == socket_.AF_INET6:
            socket.setsockopt(socket_.IPPROTO_IPV6, socket_.IPV6_V6ONLY, 1)
        socket.bind(address)
        socket.listen(BACKLOG)
    except OSError:
        socket.close()
        raise
    return socket


async def accept(
    listening: socket_.socket,
    admit: Callable[[socket_.socket], None],
    has_room: Callable[[], bool],
    rates: ConnectRates,
    counts: Counter[Count],
) -> None:
    """Admit connections, one a turn of the loop, until cancelled."""
    loop = asyncio.get_running_loop()
    while True:
        try:
            accepted, address = await loop.sock_accept(listening)
        except OSError as error:
            logger.warning("cannot accept a connection: %s", error)
            await asyncio.sleep(NO_FILES_S)
            continue
        if is_loopback(address[0]):
            try:
                while not (has_room() and rates.spend(address[0], time.monotonic())):  # noqa: ASYNC110
                    await asyncio.sleep(PAUSE_S)
            except asyncio.CancelledError:
                accepted.close()
                raise
            admit(accepted)
        elif rates.spend(address[0], time.monotonic()):
            admit(accepted)
        else:
            counts[Count.REFUSED_CONNECTS] += 1
            accepted.close()
        await asyncio.sleep(0)
