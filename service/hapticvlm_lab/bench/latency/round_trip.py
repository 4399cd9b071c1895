"""One client that measures round trips of touches, and of echoes as their floor."""

from __future__ import annotations

import time
from collections.abc import AsyncIterator, Iterator
from contextlib import asynccontextmanager, contextmanager
from typing import Any

import msgspec
from websockets.asyncio.client import ClientConnection
from websockets.asyncio.client import connect as open_socket

from hapticvlm import __version__
from hapticvlm.client.local_service import Service
from hapticvlm_lab.bench.rigs import first_line, helper


def touch(number: int) -> dict[str, Any]:
    """Return touch `number` of a hand: contact, 18 slides and a release, again and again."""
    step = number % 20
    phase = "contact" if step == 0 else "release" if step == 19 else "slide"
    return {
        "type": "touch",
        "id": number + 10,
        "phase": phase,
        "object_id": "table",
        "hand": "right",
        "speed_mps": 0.1 + 0.01 * step,
        "force_n": 1.5,
        "captured_at": time.monotonic(),
    }


async def round_trip(socket: ClientConnection, data: bytes, id: int) -> float:
    """Return the time in ms until the message with this id comes back."""
    # Events come in between on the same socket; only the answer with this id ends the round trip.
    started = time.perf_counter()
    await socket.send(data)
    while True:
        answer = msgspec.msgpack.decode(await socket.recv(decode=False))
        if answer["id"] == id:
            if answer["type"] == "error":
                raise RuntimeError(answer["text"])
            return (time.perf_counter() - started) * 1000.0


async def introduce(socket: ClientConnection) -> None:
    """Send hello as a scene with one wooden table."""
    client = {"name": "round trip", "version": __version__}
    protocol = {"major": 1, "minor": 0}
    table = {"object_id": "table", "material": "wood"}
    for message in (
        {"type": "hello", "id": 1, "client": client, "protocol": protocol, "role": "scene"},
        {"type": "scene", "id": 2, "objects": [table], "replace": True},
    ):
        await round_trip(socket, msgspec.msgpack.encode(message), int(str(message["id"])))


@asynccontextmanager
async def sockets(
    service: Service, echo_port: int
) -> AsyncIterator[tuple[ClientConnection, ClientConnection]]:
    """Open a scene with one table at the service, and a socket to the echo."""
    plain: dict[str, Any] = {"compression": None, "proxy": None, "ping_interval": None}
    async with (
        open_socket(service.url, **plain) as touches,
        open_socket(f"ws://127.0.0.1:{echo_port}/", **plain) as echoes,
    ):
        await introduce(touches)
        yield touches, echoes


@contextmanager
def echo(realtime: bool) -> Iterator[int]:
    """Run a bare echo in its own process; yields its port."""
    with helper("latency.echo", *(["realtime"] * realtime)) as process:
        yield int(first_line(process))
