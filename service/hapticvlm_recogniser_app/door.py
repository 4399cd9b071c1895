"""Closes the sockets of strangers, so that they cannot keep a client of the recogniser out.

A socket is a client's while it has answered a request with a valid token and not for longer than
uvicorn keeps it open; every other one is a stranger's. A stranger's has STRANGER_S for each
request, whatever it sends, and only so many of them stay open: of one address, and in all. The
oldest makes room. Health checks come from strangers too, and are answered before that.
"""

from __future__ import annotations

import asyncio
from typing import Any

from uvicorn.protocols.http.h11_impl import H11Protocol

from hapticvlm_recogniser_app.settings import ADMITTED

STRANGER_S = 5.0  # from the connection, or the end of its last request; our choice
OF_ONE_ADDRESS = 64  # sockets of strangers; a proxy's clients are all of one address; our choice
IN_ALL = 256  # our choice: 64 KiB of input each is 16 MiB


class Strangers:
    """The sockets of strangers, the oldest first."""

    def __init__(self) -> None:
        self._sockets: dict[Door, str] = {}

    def add(self, socket: Door, address: str) -> None:
        """Keep a stranger, and close the oldest one above a limit."""
        self._sockets.pop(socket, None)
        self._sockets[socket] = address
        same = [other for other, of in self._sockets.items() if of == address]
        if len(same) > OF_ONE_ADDRESS:
            same[0].cut_off()
        if len(self._sockets) > IN_ALL:
            next(iter(self._sockets)).cut_off()

    def remove(self, socket: Door) -> None:
        """Forget one: it is closed, or a client's."""
        self._sockets.pop(socket, None)


class Door(H11Protocol):
    """One socket. uvicorn makes one for each connection, `strangers` is common to all."""

    strangers: Strangers  # set in a subclass for each server

    def __init__(self, *args: Any, **kwargs: Any) -> None:
        super().__init__(*args, **kwargs)
        self._timer: asyncio.TimerHandle | None = None

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        """Count it among the strangers."""
        super().connection_made(transport)
        self._watch()

    def connection_lost(self, exc: Exception | None) -> None:
        """Forget it."""
        self._unwatch()
        super().connection_lost(exc)

    def data_received(self, data: bytes) -> None:
        """Read what came. The first request of a client makes the socket a client's."""
        super().data_received(data)
        # The token of a request has been checked by the end of the turn in which its header is
        # complete: the application reads no body before.
        self.loop.call_soon(self._settle)

    def on_response_complete(self) -> None:
        """Wait for the next request: for long if this one was a client's."""
        super().on_response_complete()
        self.cycle.body.clear()  # a refused body was not read, and would stay with its socket
        if not self.transport.is_closing() and not self._is_client():
            self._watch()

    def cut_off(self) -> None:
        """Close it at once."""
        self._unwatch()
        self.transport.abort()

    def _is_client(self) -> bool:
        return self.scope is not None and bool(self.scope.get(ADMITTED))

    def _settle(self) -> None:
        if self._is_client():
            self._unwatch()

    def _watch(self) -> None:
        self._unwatch()
        address = self.client[0] if self.client else ""
        self._timer = self.loop.call_later(STRANGER_S, self.cut_off)
        self.strangers.add(self, address)

    def _unwatch(self) -> None:
        self.strangers.remove(self)
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None
