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
import zlib
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
    return _once(opcode, data, BURST)


def _once(opcode: Opcode, data: bytes, count: int = 1) -> bytes:
    return b"".join(Frame(opcode, data).serialize(mask=True) for _ in range(count))


def _packed(**message: Any) -> bytes:
    packed: bytes = msgspec.msgpack.encode({"id": 7, **message})
    return packed


def _wrong_material() -> bytes:
    objects = [{"object_id": "x", "material": "wod"}]
    return _many(Opcode.BINARY, _packed(type="scene", objects=objects, replace=False))


def _large_scene() -> bytes:
    objects = [{"object_id": f"object {number}", "name": "Oak"} for number in range(4096)]
    return _once(Opcode.BINARY, _packed(type="scene", objects=objects, replace=True))


def _picture(format: str, image: bytes, side: int) -> bytes:
    fields = {"captured_at": 0.0, "origin": "top", "width": side, "height": side}
    return _once(Opcode.BINARY, _packed(type="frame", format=format, image=image, **fields))


def _jpeg_of_comments() -> bytes:
    comment = b"\xff\xfe\xff\xff" + bytes(65533)
    size = b"\xff\xc0\x00\x11\x08\x00\x40\x00\x40\x03\x01\x22\x00\x02\x11\x01\x03\x11\x01"
    return _picture("jpeg", b"\xff\xd8" + comment * 60 + size + b"\xff\xd9", 64)


def _png_of_chunks() -> bytes:
    def chunk(kind: bytes, data: bytes = b"") -> bytes:
        checksum = zlib.crc32(kind + data).to_bytes(4, "big")
        return len(data).to_bytes(4, "big") + kind + data + checksum

    header = chunk(b"IHDR", b"\0\0\0\x40\0\0\0\x40\x08\x02\0\0\0")
    pixels = chunk(b"IDAT", zlib.compress(bytes(64 * (1 + 64 * 3))))
    filler = chunk(b"tEXt") * 300_000
    return _picture("png", b"\x89PNG\r\n\x1a\n" + header + filler + pixels + chunk(b"IEND"), 64)


KINDS = {
    "garbage": Kind(lambda: _many(Opcode.BINARY, b"\xc1")),
    "pings": Kind(lambda: _many(Opcode.PING, b"")),
    "pings before hello": Kind(lambda: _many(Opcode.PING, b""), None),
    "pongs": Kind(lambda: _many(Opcode.PONG, b"")),
    "set": Kind(lambda: _many(Opcode.BINARY, _packed(type="set"))),
    "wrong material": Kind(_wrong_material, "scene"),
    "text of 1 MB": Kind(lambda: _once(Opcode.TEXT, b'"' + b"x" * 1_000_000 + b'"')),
    "deep JSON": Kind(lambda: _once(Opcode.TEXT, b"[" * 500_000)),
    "scenes of 4096 objects": Kind(_large_scene, "scene"),
    "JPEGs of 4 MB of comments": Kind(_jpeg_of_comments, "scene"),
    "PNGs of 300,000 chunks": Kind(_png_of_chunks, "scene"),
    "connections": Kind(lambda: b"", None),
    "reconnections": Kind(lambda: b""),
}
# Small frames: each costs the service more to answer than the client to send.
TINY = ("garbage", "pings", "pings before hello", "pongs", "set", "wrong material")


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
