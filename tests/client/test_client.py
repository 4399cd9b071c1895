"""The Python client and the example, against the real service."""

import asyncio
import subprocess
import sys
from contextlib import suppress
from pathlib import Path
from typing import Any

import msgpack
import msgspec
import numpy as np
import pytest
from pace import PACE
from websockets.asyncio.client import connect as open_socket
from websockets.asyncio.server import serve
from websockets.exceptions import ConnectionClosed

from hapticvlm.client import Refused, connect
from hapticvlm.client.connection import Connection, Disconnected

ROOT = Path(__file__).parents[2]


async def test_a_researcher_touches_an_object_and_reads_the_decision(service):
    async with connect(service.url, name="study") as client:
        assert client.welcome["owner"]
        await client.scene([{"object_id": "pane", "name": "GlassPane"}], ambient_c=20.0)
        await client.touch("release")
        assert (await client.touch("contact", "pane", speed_mps=0.2))["type"] == "ok"
        async with asyncio.timeout(2.0 * PACE):
            while (event := await client.events.get())["type"] != "decision":
                pass
        assert event["material"] == "glass"
        assert (await client.stop())["type"] == "ok"
        await client.touch("release")


async def test_a_number_of_numpy_is_sent_as_a_number(service):
    async with connect(service.url) as client:
        speed: Any = np.float64(0.2)
        force: Any = np.float32(1.5)
        answer = await client.touch("contact", "pane", speed_mps=speed, force_n=force)
        assert answer["type"] == "ok"
        with pytest.raises(TypeError, match="ndarray: a message cannot have such a value"):
            await client.send("touch", speed_mps=np.zeros(2))


async def test_a_refused_request_raises_with_code_and_path(service):
    async with connect(service.url) as client:
        with pytest.raises(Refused) as refused:
            await client.touch("hover", "x")
    assert refused.value.path == "$.phase"
    assert "approach" in str(refused.value)


async def test_a_part_of_a_scene_that_is_left_out_is_returned_and_logged(service, caplog):
    async with connect(service.url) as client:
        answer = await client.scene([{"object_id": "x", "material": "wodo"}])
    (part,) = answer["left_out"]
    assert part["path"] == "objects[0].material"
    assert "wood" in part["text"]
    assert part["text"] in caplog.text


async def test_a_token_that_is_not_required_is_accepted(service):
    async with connect(service.url, token="anything") as client:
        assert client.welcome["type"] == "welcome"


async def test_a_request_on_a_closed_connection_raises(service):
    async with connect(service.url) as client:
        waiting = await client.send("touch", phase="release", hand="left")
        assert (await waiting)["code"] == "message"
        await client.close()
        with pytest.raises(Disconnected, match="connect again"):
            await client.stop()


async def test_a_connection_that_ends_while_its_last_bytes_leave_can_still_be_closed():
    may_read = asyncio.Event()

    async def handle(socket):
        socket.transport.pause_reading()
        await may_read.wait()
        socket.transport.resume_reading()
        await socket.wait_closed()

    async with serve(handle, "127.0.0.1", 0, max_size=None) as server:
        port = server.sockets[0].getsockname()[1]
        async with open_socket(
            f"ws://127.0.0.1:{port}/", create_connection=Connection, proxy=None
        ) as socket:
            socket.transport.write(bytes(16_000_000))
            socket.transport.close()  # as asyncio does when the other side has ended
            may_read.set()
            await socket.wait_closed()
            with pytest.raises(ConnectionClosed):
                await socket.send(b"late")
            await socket.close()


async def test_a_service_that_talks_nonsense_leaves_no_request_waiting_for_ever():
    async def handle(socket):
        await socket.recv()
        await socket.send(msgpack.packb({"type": "welcome", "id": 1}))
        await socket.send(b"\xc1")
        await socket.wait_closed()

    async with serve(handle, "127.0.0.1", 0) as server:
        url = f"ws://127.0.0.1:{server.sockets[0].getsockname()[1]}/"
        with pytest.raises(msgspec.DecodeError):
            await asking_until_closed(url)


async def asking_until_closed(url):
    async with connect(url) as client, asyncio.timeout(10.0 * PACE):
        with suppress(Disconnected):
            while True:
                await client.stop()


def test_the_scripted_example_runs_in_under_80_lines(service):
    example = ROOT / "examples/touch.py"
    assert len(example.read_text().splitlines()) < 80
    done = subprocess.run(
        [sys.executable, str(example), service.url],
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    for expected in ("table: wood", "window: glass", "curtain: fabric", "kettle: metal"):
        assert expected in done.stdout
