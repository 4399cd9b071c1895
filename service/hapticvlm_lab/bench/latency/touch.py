"""Round trip of a touch against a bare echo of the same bytes, by the same client in the same run.

Touches of a known object and echoes take turns, 100 of each a second. Both meet the same machine in
the same second, so their ratio says what the service adds, and stays the same when the machine is
slow. Beside them a second process may stream different frames.

The service answers a touch after its command is in the audio ring.
"""

from __future__ import annotations

import asyncio
import os
import time
from collections.abc import AsyncIterator, Iterator
from contextlib import ExitStack, asynccontextmanager, contextmanager
from dataclasses import dataclass
from typing import Any

import msgspec
import numpy as np
from websockets.asyncio.client import ClientConnection
from websockets.asyncio.client import connect as open_socket

from hapticvlm import __version__
from hapticvlm.client.local_service import Service
from hapticvlm_lab.bench.rigs import first_line, helper, service_status

SECONDS = 6.0  # of a row
RATE_HZ = 100.0
FRAME_BYTES = 40_000
WARM_UP = 100
SETTLE_S = 0.5
MARGIN_S = SETTLE_S + WARM_UP / RATE_HZ + 1.0


@dataclass(frozen=True, slots=True)
class Row:
    """One condition: round trips in ms, and the load beside them."""

    name: str
    touch_ms: list[float]
    echo_ms: list[float]
    load: float
    recogniser_busy: float

    def summary(self) -> dict[str, Any]:
        """Return the figures of this row."""
        touches = np.array(self.touch_ms)
        echoes = np.array(self.echo_ms)
        touch_99 = np.percentile(touches, 99)
        echo_99 = np.percentile(echoes, 99)
        return {
            "condition": self.name,
            "n": touches.size,
            "touch_median_ms": round(float(np.median(touches)), 3),
            "touch_p99_ms": round(float(touch_99), 3),
            "echo_median_ms": round(float(np.median(echoes)), 3),
            "echo_p99_ms": round(float(echo_99), 3),
            "median_ratio": round(float(np.median(touches) / np.median(echoes)), 2),
            "p99_ratio": round(float(touch_99 / echo_99), 2),
            "load": round(self.load, 2),
            "recogniser_busy": round(self.recogniser_busy, 2),
        }


async def measured(
    name: str, service: Service, echo_port: int, seconds: float, frames_hz: float
) -> Row:
    """Measure one condition; a second process streams `frames_hz`, or nothing at 0."""
    with ExitStack() as stack:
        load = None
        if frames_hz:
            arguments = (service.url, frames_hz, seconds + MARGIN_S, FRAME_BYTES)
            load = stack.enter_context(helper("latency.load", *arguments))
        async with sockets(service, echo_port) as (touches, echoes):
            if load is not None:
                await asyncio.to_thread(first_line, load)
                await asyncio.sleep(SETTLE_S)
            # The recogniser's busy time and the round trips cover the same seconds.
            started = time.monotonic()
            busy_s = service_status(service)["recogniser"]["busy_s"]
            touch_ms, echo_ms = await alternate(touches, echoes, seconds)
            busy_s = service_status(service)["recogniser"]["busy_s"] - busy_s
            busy = busy_s / (time.monotonic() - started)
    return Row(name, touch_ms, echo_ms, os.getloadavg()[0], busy)


async def alternate(
    touches: ClientConnection, echoes: ClientConnection, seconds: float
) -> tuple[list[float], list[float]]:
    """Return round trips of touches and of echoes, ms, in turns at RATE_HZ each."""
    # Each round trip has a due time of its own. A client that sent the next one when the last
    # answer came would send less to a slow service, and miss just the moments that are slow. The
    # echo comes half a period after the touch, so that neither meets the other's work.
    touch_ms: list[float] = []
    echo_ms: list[float] = []
    started = time.perf_counter()
    for number in range(int(seconds * RATE_HZ) + WARM_UP):
        due = started + number / RATE_HZ
        await asyncio.sleep(max(0.0, due - time.perf_counter()))
        data = msgspec.msgpack.encode(touch(number))
        touch_ms.append(await round_trip(touches, data, number + 10))
        await asyncio.sleep(max(0.0, due + 0.5 / RATE_HZ - time.perf_counter()))
        echo_ms.append(await round_trip(echoes, data, number + 10))
    return touch_ms[WARM_UP:], echo_ms[WARM_UP:]


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
