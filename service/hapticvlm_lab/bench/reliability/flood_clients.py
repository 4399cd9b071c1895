"""One hostile client in a process of its own, which connects again each time it is closed.

`python -m hapticvlm_lab.bench.reliability.flood_clients URL KIND SECONDS` prints "flooding" when it
begins and one JSON object at the end. KIND is a name of KINDS.
"""

from __future__ import annotations

import asyncio
import contextlib
import json
import sys
import time
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import msgspec
from websockets.asyncio.client import ClientConnection
from websockets.asyncio.client import connect as open_socket
from websockets.exceptions import ConnectionClosed, InvalidHandshake
from websockets.frames import Frame, Opcode

from hapticvlm.client.connection import Connection

BURST = 2000  # small frames in one write
BACK_S = 0.01  # before it connects again


@dataclass(frozen=True, slots=True)
class Kind:
    """Bytes that a hostile client writes over and over, and its role (None: it sends no hello)."""

    data: Callable[[], bytes]
    role: str | None = "observer"


def _many(opcode: Opcode, data: bytes) -> bytes:
    return b"".join(Frame(opcode, data).serialize(mask=True) for _ in range(BURST))


def _packed(**message: Any) -> bytes:
    packed: bytes = msgspec.msgpack.encode({"id": 7, **message})
    return packed


def _wrong_material() -> bytes:
    objects = [{"object_id": "x", "material": "wod"}]
    return _many(Opcode.BINARY, _packed(type="scene", objects=objects, replace=False))


RECONNECTIONS = "reconnections"
KINDS = {  # each frame costs the service more to answer than the client to send
    "garbage": Kind(lambda: _many(Opcode.BINARY, b"\xc1")),
    "pings": Kind(lambda: _many(Opcode.PING, b"")),
    "pings before hello": Kind(lambda: _many(Opcode.PING, b""), None),
    "pongs": Kind(lambda: _many(Opcode.PONG, b"")),
    "set": Kind(lambda: _many(Opcode.BINARY, _packed(type="set"))),
    "wrong material": Kind(_wrong_material, "scene"),
    RECONNECTIONS: Kind(lambda: b""),
}


async def flood(url: str, name: str, seconds: float, counts: Counter[str]) -> None:
    """Write as fast as the service reads, and read its answers; connect again after each close."""
    kind = KINDS[name]
    until = time.monotonic() + seconds
    data = kind.data()
    while (left := until - time.monotonic()) > 0.0:
        with contextlib.suppress(OSError, ConnectionClosed, InvalidHandshake, TimeoutError):
            async with asyncio.timeout(left):
                await _visit(url, kind.role, data, counts)
        await asyncio.sleep(BACK_S)


async def _visit(url: str, role: str | None, data: bytes, counts: Counter[str]) -> None:
    async with open_socket(
        url,
        create_connection=Connection,
        compression=None,
        proxy=None,
        ping_interval=None,
        max_size=None,
        close_timeout=0.1,
    ) as socket:
        counts["connections"] += 1
        if role is not None:
            await _send_hello(socket, role)
        if not data:
            socket.transport.abort()
            await socket.wait_closed()
            return
        # The client reads as well: a service whose answers nobody takes is protected by its own
        # budget of waiting bytes, and would close this connection before it has had to work.
        reading = asyncio.create_task(_read(socket))
        try:
            while not reading.done() and not socket.transport.is_closing():
                socket.transport.write(data)
                counts["bytes"] += len(data)
                written = asyncio.ensure_future(_drained(socket))
                await asyncio.wait({reading, written}, return_when=asyncio.FIRST_COMPLETED)
        finally:
            reading.cancel()
            with contextlib.suppress(asyncio.CancelledError, ConnectionClosed):
                await reading
            counts[f"closed {socket.close_code} {socket.close_reason}"] += 1


async def _send_hello(socket: ClientConnection, role: str) -> None:
    client = {"name": "flood", "version": "1"}
    protocol = {"major": 1, "minor": 0}
    await socket.send(_packed(type="hello", client=client, protocol=protocol, role=role))
    await socket.recv()


async def _read(socket: ClientConnection) -> None:
    while True:
        await socket.recv()


async def _drained(socket: ClientConnection) -> None:
    with contextlib.suppress(ConnectionClosed, OSError, RuntimeError):
        await socket.drain()


async def _run(url: str, name: str, seconds: float) -> Counter[str]:
    counts: Counter[str] = Counter()
    print("flooding", flush=True)
    await flood(url, name, seconds, counts)
    return counts


if __name__ == "__main__":
    url, name, seconds = sys.argv[1:]
    print(json.dumps(asyncio.run(_run(url, name, float(seconds)))))
