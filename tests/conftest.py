"""Shared by test modules: a running service, a raw MessagePack client and a browser."""

from __future__ import annotations

import asyncio
import itertools
import json
import logging
import signal
import time
import urllib.request
from collections.abc import AsyncIterator, Iterator
from contextlib import asynccontextmanager
from typing import TYPE_CHECKING, Any

import msgpack
import pytest
from hypothesis import settings
from pace import PACE
from toolchains import require
from websockets.asyncio.client import ClientConnection
from websockets.asyncio.client import connect as open_socket

from hapticvlm.client.connection import Connection
from hapticvlm.client.local_service import Service, running
from hapticvlm.server.log_writer import LogWriter

if TYPE_CHECKING:
    from playwright.sync_api import Browser

# A shell's background job ignores Ctrl-C, and so would what tests start and then interrupt.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)

# A busy machine must not fail a property: what they cost is measured elsewhere.
settings.register_profile("project", deadline=None)
settings.load_profile("project")

pytest_plugins = ("lengths",)
Message = dict[str, Any]
ANSWER_S = 10.0 * PACE  # telemetry comes ten times a second: silence this long is a failure
EVENT_S = 60.0 * PACE  # telemetry goes on while an event never comes


@pytest.hookimpl(tryfirst=True)
def pytest_runtest_setup(item: pytest.Item) -> None:
    """Skip or fail a test whose toolchain is absent before its fixtures are built."""
    for marker in item.iter_markers("needs_toolchain"):
        require(*marker.args)


def pytest_runtest_teardown() -> None:
    """Take the log back from a service that a test began here: its writer ends with its process."""
    root = logging.getLogger()
    for writer in [each for each in root.handlers if isinstance(each, LogWriter)]:
        root.removeHandler(writer)
        writer.close()


@pytest.fixture(scope="module")
def service() -> Iterator[Service]:
    """A real service on simulated devices, shared by the tests of one module."""
    with running() as service:
        yield service


@pytest.fixture(scope="module")
def browser(request: pytest.FixtureRequest) -> Iterator[Browser]:
    """A headless Chromium; a file adds flags to its command line as `CHROMIUM_FLAGS`."""
    require("playwright", "chromium", "axe-core")
    from headless import chromium
    from playwright.sync_api import expect

    expect.set_options(timeout=60_000 * PACE)  # a loaded machine starts a service in half a minute
    with chromium(*getattr(request.module, "CHROMIUM_FLAGS", ())) as browser:
        yield browser


class Peer:
    """A scripted client: sends maps, sorts answers by id from events."""

    def __init__(self, socket: ClientConnection, *, as_text: bool = False) -> None:
        self.socket = socket
        self.events: list[Message] = []
        self.as_text = as_text
        self.welcome: Message = {}
        self._ids = itertools.count(1)

    async def send(self, **message: Any) -> int:
        message = {"id": next(self._ids), **message}
        data = json.dumps(message) if self.as_text else msgpack.packb(message)
        await self.socket.send(data)
        return int(message["id"])

    async def read(self) -> Message:
        async with asyncio.timeout(ANSWER_S):
            data = await self.socket.recv()
        message: Message = json.loads(data) if isinstance(data, str) else msgpack.unpackb(data)
        return message

    async def ask(self, **message: Any) -> Message:
        """Send and return the answer with the same id; keep events that come before it."""
        id = await self.send(**message)
        async with asyncio.timeout(ANSWER_S):
            while (answer := await self.read())["id"] != id:
                self.events.append(answer)
        return answer

    async def event(self, type: str, **wanted: Any) -> Message:
        """Return the next event of this type with these values."""
        async with asyncio.timeout(EVENT_S):
            while True:
                for event in self.events:
                    if event["type"] == type and wanted.items() <= event.items():
                        self.events.remove(event)
                        return event
                self.events.append(await self.read())

    async def hello(self, role: str = "scene", **fields: Any) -> Message:
        client = {"name": "test", "version": "1"}
        protocol = {"major": 1, "minor": 0}
        hello = {"type": "hello", "client": client, "protocol": protocol, "role": role}
        self.welcome = await self.ask(**{**hello, **fields})
        return self.welcome

    async def touch(self, phase: str, object_id: str | None = None, **fields: Any) -> Message:
        given = {"hand": "right", "speed_mps": 0.3, "force_n": 1.5, "captured_at": time.monotonic()}
        target = {} if object_id is None else {"object_id": object_id}
        return await self.ask(type="touch", phase=phase, **target, **{**given, **fields})

    async def telemetry(self) -> Message:
        """Return telemetry newer than this call."""
        self.events = [event for event in self.events if event["type"] != "telemetry"]
        return await self.event("telemetry")


@asynccontextmanager
async def peer(service: Service, *, as_text: bool = False, **options: Any) -> AsyncIterator[Peer]:
    """Open a raw connection to the service, without hello."""
    async with open_socket(
        service.url,
        create_connection=Connection,
        compression=None,
        proxy=None,
        ping_interval=None,
        max_size=None,
        max_queue=None,  # a test that does not read for a while must still see the close
        **options,
    ) as socket:
        yield Peer(socket, as_text=as_text)


def status(service: Service) -> dict[str, Any]:
    with urllib.request.urlopen(service.page + "status", timeout=5 * PACE) as answer:
        found: dict[str, Any] = json.load(answer)
    return found
