"""A client of protocol v1: plain websockets and msgpack, nothing of the service's own code.

    async with connect("ws://127.0.0.1:8790/", name="my study") as client:
        await client.scene([{"object_id": "table", "name": "Oak_Table_02"}], ambient_c=21.0)
        await client.touch("contact", "table", speed_mps=0.3, force_n=1.0)

Messages are the dictionaries of schemas/messages.schema.json. A refused request raises Refused.
"""

from __future__ import annotations

import asyncio
import itertools
import ssl
import time
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager, suppress
from pathlib import Path
from typing import Any

import msgpack
from websockets.asyncio.client import ClientConnection
from websockets.asyncio.client import connect as open_socket
from websockets.exceptions import ConnectionClosed

from hapticvlm import __version__
from hapticvlm.errors import HapticVLMError

Message = dict[str, Any]
MAX_EVENTS = 4096


class Connection(ClientConnection):
    """A WebSocket that may end while its last bytes leave.

    asyncio does not mark a transport that ends so, and the `abort` that websockets calls at the end
    of `send` and `close` would raise AttributeError (CPython gh-156512).
    """

    def connection_lost(self, exc: Exception | None) -> None:
        """Note the end; there is nothing to abort any more."""
        super().connection_lost(exc)
        self.transport.abort = lambda: None  # type: ignore[method-assign]


class Refused(HapticVLMError):
    """The service answered `error`: its code, text and path."""

    def __init__(self, answer: Message) -> None:
        super().__init__(f"{answer['code']}: {answer['text']}")
        self.code: str = answer["code"]
        self.path: str | None = answer.get("path")


class Client:
    """One connection after its welcome; open it with `connect`."""

    def __init__(self, socket: ClientConnection, welcome: Message) -> None:
        self.welcome = welcome
        self.events: asyncio.Queue[Message] = asyncio.Queue(MAX_EVENTS)
        self.events_lost = 0
        self._socket = socket
        self._ids = itertools.count(2)
        self._waiting: dict[int, asyncio.Future[Message]] = {}

    async def send(self, type: str, **fields: Any) -> asyncio.Future[Message]:
        """Send one message without waiting; the future gives its answer."""
        id = next(self._ids)
        answer: asyncio.Future[Message] = asyncio.get_running_loop().create_future()
        self._waiting[id] = answer
        given = {name: value for name, value in fields.items() if value is not None}
        try:
            await self._socket.send(msgpack.packb({"type": type, "id": id, **given}))
        except ConnectionClosed:
            del self._waiting[id]
            raise
        return answer

    async def request(self, type: str, **fields: Any) -> Message:
        """Send one message and return its answer. Raises Refused."""
        answer = await (await self.send(type, **fields))
        if answer["type"] == "error":
            raise Refused(answer)
        return answer

    async def scene(
        self, objects: list[Message], *, replace: bool = True, **fields: Any
    ) -> Message:
        """Describe the scene's objects; fields: ambient_c, materials."""
        return await self.request("scene", objects=objects, replace=replace, **fields)

    async def touch(
        self,
        phase: str,
        object_id: str | None = None,
        *,
        speed_mps: float = 0.0,
        force_n: float = 0.0,
        **fields: Any,
    ) -> Message:
        """Send what a hand does; fields: hand, interaction, region, captured_at."""
        given = {"hand": "right", "captured_at": time.monotonic(), **fields}
        return await self.request(
            "touch",
            phase=phase,
            object_id=object_id,
            speed_mps=speed_mps,
            force_n=force_n,
            **given,
        )

    async def frame(self, image: bytes, width: int, height: int, **fields: Any) -> Message:
        """Send a frame and return its `decision` or `skipped`; fields: format, object_id, ..."""
        given = {"format": "jpeg", "origin": "top", "captured_at": time.monotonic(), **fields}
        return await self.request("frame", image=image, width=width, height=height, **given)

    async def set(self, **fields: Any) -> Message:
        """Change settings: ambient_c, vibration_gain, thermal_gain, watch, feel."""
        return await self.request("set", **fields)

    async def stop(self, scope: str = "all") -> Message:
        """Rest the outputs at once."""
        return await self.request("stop", scope=scope)

    async def close(self) -> None:
        """Close the connection; the outputs rest if it owned them."""
        await self._socket.close()

    async def wait_closed(self) -> None:
        """Wait until the connection has ended."""
        await self._socket.wait_closed()

    async def listen(self) -> None:
        """Sort answers from events until the connection ends."""
        try:
            async for data in self._socket:
                self._deliver(msgpack.unpackb(data))
        except ConnectionClosed:
            pass
        finally:
            for answer in self._waiting.values():
                if not answer.done():
                    answer.set_exception(ConnectionError("the service closed the connection"))
                    answer.exception()
            self._waiting.clear()
            await self._socket.close()  # whoever still sends must not wait for ever

    def _deliver(self, message: Message) -> None:
        answer = self._waiting.pop(message["id"], None) if message["id"] else None
        if answer is not None:
            if not answer.done():
                answer.set_result(message)
            return
        if self.events.full():
            self.events.get_nowait()
            self.events_lost += 1
        self.events.put_nowait(message)


def trusting(ca: Path) -> ssl.SSLContext:
    """Return what to give `connect` as `tls` for a service certified by this CA, a PEM file.

    Raises OSError.
    """
    return ssl.create_default_context(cafile=ca)


@asynccontextmanager
async def connect(
    url: str = "ws://127.0.0.1:8790/",
    *,
    name: str = "hapticvlm-python",
    role: str = "scene",
    token: str | None = None,
    tls: ssl.SSLContext | None = None,
) -> AsyncIterator[Client]:
    """Connect and send hello; `tls` names whom to trust for wss, by default whom the system does.

    Raises Refused, OSError when nobody listens or its certificate is not trusted.
    """
    encrypted: dict[str, Any] = {} if tls is None else {"ssl": tls}
    async with open_socket(
        url,
        create_connection=Connection,
        compression=None,
        max_size=None,
        ping_interval=None,
        proxy=None,
        **encrypted,
    ) as socket:
        hello = {
            "type": "hello",
            "id": 1,
            "client": {"name": name, "version": __version__},
            "protocol": {"major": 1, "minor": 0},
            "role": role,
            **({"token": token} if token else {}),
        }
        await socket.send(msgpack.packb(hello))
        welcome = msgpack.unpackb(await socket.recv())
        if welcome["type"] == "error":
            raise Refused(welcome)
        client = Client(socket, welcome)
        listener = asyncio.create_task(client.listen())
        try:
            yield client
        finally:
            await socket.close()
            listener.cancel()
            with suppress(asyncio.CancelledError):
                await listener
