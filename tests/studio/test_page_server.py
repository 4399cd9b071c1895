"""The door of a study's pages: whom it lets in, and what a hostile page costs the others."""

import asyncio
import json
import time
from typing import Any

import pytest
from pace import PACE
from websockets.asyncio.client import connect
from websockets.exceptions import InvalidStatus
from websockets.frames import Frame, Opcode

from hapticvlm.server.edge.limits import CONTROL_FRAMES, MESSAGES
from hapticvlm_studio.trials import page_server
from hapticvlm_studio.trials.conductor import Conductor
from hapticvlm_studio.trials.page_server import StudyServer


class Obedient(Conductor):
    """A study without devices that does whatever is asked."""

    def __init__(self) -> None:
        self.done = 0

    def view(self) -> dict[str, Any]:
        return {"phase": "choosing", "done": self.done}

    async def do(self, _command: dict[str, Any]) -> None:
        self.done += 1
        self.notify()


@pytest.mark.parametrize(
    ("flood", "said"),
    [
        (Frame(Opcode.PING, b"").serialize(mask=True) * int(CONTROL_FRAMES.burst) * 4, "control"),
        (Frame(Opcode.TEXT, b"x").serialize(mask=True) * int(MESSAGES.burst) * 2, "too many"),
    ],
    ids=["pings", "garbage"],
)
@pytest.mark.realtime
async def test_a_flood_of_tiny_messages_is_closed_with_1008_and_delays_no_other_page(flood, said):
    server = StudyServer(Obedient(), {})
    async with (
        page_server._listening(server, 0) as port,
        connect(f"ws://127.0.0.1:{port}/", max_queue=None) as hostile,
        connect(f"ws://127.0.0.1:{port}/") as page,
    ):
        for _ in range(2):
            await page.recv()
        hostile.transport.write(flood)
        began = time.monotonic()
        await page.send(json.dumps({"do": "pause"}))
        assert json.loads(await page.recv())["done"] == 1
        assert time.monotonic() - began < 0.25
        await asyncio.wait_for(hostile.wait_closed(), 5.0)
        assert hostile.close_code == 1008
        assert said in str(hostile.close_reason)


@pytest.mark.parametrize(
    ("headers", "admitted"),
    [
        ({}, True),
        ({"Origin": "http://127.0.0.1:{port}"}, True),
        ({"Origin": "http://127.0.0.1:1"}, False),
        ({"Origin": "http://localhost:{port}"}, False),
        ({"Origin": "https://127.0.0.1:{port}"}, False),
        ({"Origin": "https://evil.example"}, False),
        ({"Host": "evil.example"}, False),
    ],
)
async def test_only_the_studys_own_pages_are_let_in(headers, admitted):
    async with page_server._listening(StudyServer(Obedient(), {}), 0) as port:
        given = {name: value.format(port=port) for name, value in headers.items()}
        url = f"ws://127.0.0.1:{port}/"
        if not admitted:
            with pytest.raises(InvalidStatus, match=r"40[03]"):  # a second Host header is malformed
                await connect(url, additional_headers=given)
            return
        async with connect(url, additional_headers=given) as page:
            assert await page.recv() == "{}"


async def test_a_page_that_reads_nothing_is_closed_and_fills_no_memory():
    server = StudyServer(Obedient(), {})
    async with (
        page_server._listening(server, 0) as port,
        connect(f"ws://127.0.0.1:{port}/") as asleep,
    ):
        await asleep.recv()
        asleep.transport.pause_reading()
        piece = {"samples": [0.0] * 100_000}
        for _ in range(60):
            server.play(piece)
            await asyncio.sleep(0)
        assert (
            not server._pages
            or max(page.transport.get_write_buffer_size() for page in server._pages)
            <= page_server.MAX_UNREAD_BYTES + 500_000
        )
        async with asyncio.timeout(5.0 * PACE):
            while server._pages:  # noqa: ASYNC110 - nothing says when
                await asyncio.sleep(0.02)
        asleep.transport.abort()


async def test_what_is_no_request_is_refused_in_words_and_the_page_stays():
    server = StudyServer(Obedient(), {})
    async with (
        page_server._listening(server, 0) as port,
        connect(f"ws://127.0.0.1:{port}/") as page,
    ):
        for _ in range(2):
            await page.recv()
        for data in ("[" * 4000, "[" * 30_000, "7", "{", b"\xff"):
            await page.send(data)
            assert json.loads(await page.recv())["refused"]
