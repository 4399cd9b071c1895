"""One client sends as much as it can: it is closed with 1008, and nobody else waits for it."""

import asyncio
import contextlib
import socket
import statistics
import time
from collections import deque
from urllib.parse import urlsplit

import msgpack
import pytest
from conftest import peer, status
from scene_client import owner_of
from tiers import nightly_except
from websockets.exceptions import ConnectionClosed
from websockets.frames import Frame, Opcode

from hapticvlm.server.edge.limits import (
    CONTROL_FRAMES,
    MESSAGES,
    REFUSED,
)

pytestmark = pytest.mark.realtime

FLOOD_S = 2.0
BURST = 2000  # frames in one write


def packed(**message):
    return msgpack.packb({"id": 7, **message})


def frames(opcode, data):
    frame = Frame(opcode, data)
    return b"".join(frame.serialize(mask=True) for _ in range(BURST))


FLOODS = {
    "garbage": (frames(Opcode.BINARY, b"\xc1"), "too many"),
    "pings": (frames(Opcode.PING, b""), "too many control frames"),
    "pongs": (frames(Opcode.PONG, b""), "too many control frames"),
    "set": (frames(Opcode.BINARY, packed(type="set")), "too many messages"),
    "stops": (frames(Opcode.BINARY, packed(type="stop", scope="speaker")), "too many messages"),
    "wrong material": (
        frames(
            Opcode.BINARY,
            packed(type="scene", objects=[{"object_id": "x", "material": "wod"}], replace=False),
        ),
        "too many",
    ),
}


async def drained(client):
    """Wait until what was written has left, or cannot."""
    with contextlib.suppress(ConnectionClosed, OSError):
        await client.socket.drain()


async def flood(service, data, *, with_hello=True):
    """Write as fast as the service takes it, reading what comes; return the close it got."""
    async with peer(service) as client:
        if with_hello:
            await client.hello("observer" if b"scene" not in data else "scene")

        async def read():
            while True:
                await client.socket.recv()

        reading = asyncio.create_task(read())
        until = time.monotonic() + FLOOD_S
        while time.monotonic() < until and not reading.done():
            if client.socket.close_code is not None or client.socket.transport.is_closing():
                break
            with contextlib.suppress(RuntimeError):  # it has just been closed
                client.socket.transport.write(data)
            written = asyncio.ensure_future(drained(client))
            await asyncio.wait({reading, written}, return_when=asyncio.FIRST_COMPLETED)
        with contextlib.suppress(TimeoutError):
            async with asyncio.timeout(5.0):
                await asyncio.wait({reading})
        reading.cancel()
        with contextlib.suppress(asyncio.CancelledError, ConnectionClosed):
            await reading
        return client.socket.close_code, client.socket.close_reason


async def latencies(client, seconds):
    """Return how long touches took, s, for as long as given."""
    took, until = [], time.monotonic() + seconds
    while time.monotonic() < until:
        started = time.monotonic()
        await client.touch("contact", "table")
        took.append(time.monotonic() - started)
        await asyncio.sleep(0.01)
    return took


@pytest.mark.parametrize("kind", nightly_except(3, FLOODS))
async def test_a_flood_is_closed_with_1008_and_delays_no_touch_of_another(service, kind):
    data, reason = FLOODS[kind]
    async with peer(service) as client:
        await owner_of(client)
        alone = statistics.median(await latencies(client, 0.5))
        attack = asyncio.create_task(flood(service, data))
        beside = await latencies(client, 1.5)
        code, said = await attack
    assert code == 1008
    assert said.startswith(reason)
    assert statistics.median(beside) < alone + 0.02
    assert max(beside) < 0.25  # 0.5 to 3 s before there were budgets
    assert status(service)["counts"][f"closed: {said}"] >= 1


async def test_pings_before_hello_are_closed_before_they_cost_a_turn(service):
    async with peer(service) as client:
        await owner_of(client)
        attack = asyncio.create_task(flood(service, FLOODS["pings"][0], with_hello=False))
        beside = await latencies(client, 1.0)
        code, said = await attack
    assert (code, said) == (1008, "too much before hello")
    assert max(beside) < 0.25


async def send_frames(client, opcode, data, count):
    client.socket.transport.write(Frame(opcode, data).serialize(mask=True) * count)
    async with asyncio.timeout(20.0):
        return await client.ask(type="stop", scope="speaker")


@pytest.mark.parametrize(
    ("opcode", "data", "most"),
    [
        (Opcode.PING, b"", int(CONTROL_FRAMES.burst)),
        (Opcode.BINARY, b"\xc1", int(REFUSED.burst)),
        (Opcode.BINARY, packed(type="stop", scope="speaker"), int(MESSAGES.burst) - 2),
    ],
)
async def test_a_budget_is_kept_at_its_limit_and_closes_beyond_it(service, opcode, data, most):
    async with peer(service) as client:
        await client.hello("observer")
        assert (await send_frames(client, opcode, data, most))["type"] == "ok"
    async with peer(service) as client:
        await client.hello("observer")
        # Beyond it, with what a busy machine gains back while it takes them.
        with pytest.raises(ConnectionClosed):
            await send_frames(client, opcode, data, most * 3)
        assert client.socket.close_code == 1008


def connect_as_fast_as_it_goes(service, *, upgrades, until):
    """Connect, ask for a WebSocket or not, and say no hello; close the oldest of many."""
    url = urlsplit(service.url)
    request = (
        f"GET / HTTP/1.1\r\nHost: 127.0.0.1:{url.port}\r\nUpgrade: websocket\r\n"
        "Connection: Upgrade\r\nSec-WebSocket-Version: 13\r\n"
        "Sec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\n\r\n"
    )
    held = deque[socket.socket]()
    made = 0
    while time.monotonic() < until:
        with contextlib.suppress(OSError):
            held.append(socket.create_connection((url.hostname, url.port), timeout=1.0))
            held[-1].sendall(request.encode() if upgrades else b"")
            made += 1
        if len(held) > (200 if upgrades else 0):
            held.popleft().close()
    for each in held:
        each.close()
    return made


@pytest.mark.parametrize("upgrades", [False, True], ids=["connects", "held upgrades"])
async def test_a_flood_of_connections_delays_no_touch_and_locks_no_newcomer_out(service, upgrades):
    async with peer(service) as client:
        await owner_of(client)
        until = time.monotonic() + 1.5
        attack = asyncio.to_thread(
            connect_as_fast_as_it_goes, service, upgrades=upgrades, until=until
        )
        flooding = asyncio.create_task(attack)
        took = []
        for _ in range(3):
            took += await latencies(client, 0.2)
            async with peer(service) as newcomer:
                assert (await newcomer.hello("observer"))["type"] == "welcome"
        assert await flooding > 100
    assert max(took) < 0.25
