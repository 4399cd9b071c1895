"""What the dashboard's tests share: a scene whose hand never rests, and a page to watch it."""

from __future__ import annotations

import asyncio
import io
import os
import pty
import threading
import time
import tty
from collections.abc import Awaitable, Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager, suppress
from itertools import cycle
from pathlib import Path
from typing import Any

import numpy as np
from pace import PACE
from PIL import Image
from playwright.sync_api import Browser, Page, ViewportSize, expect

from hapticvlm.client import Client, Refused, connect
from hapticvlm.devices.simulated.simulated_board import SimulatedBoard

AXE = Path(__file__).parent / "node_modules" / "axe-core" / "axe.min.js"
OBJECTS: list[dict[str, Any]] = [
    {"object_id": "table", "name": "Oak_Table_02"},
    {"object_id": "kettle", "material": "metal", "temperature_c": 12.0},
    {"object_id": "window", "name": "GlassPane"},
    {"object_id": "thing", "name": "Object_07"},
]
REGION = {"x": 0.25, "y": 0.25, "w": 0.5, "h": 0.5}
SIDE = 224
STROKES = 30
FRAME_S, SLIDE_S, START_S = 0.2, 0.05, 30.0
BOARD_S = 0.01
PATIENCE_MS = 60_000 * PACE  # a loaded machine starts a service in half a minute
DESKTOP = (1280, 900)
WATCH_POLICY = """
window.violations = [];
addEventListener("securitypolicyviolation", (event) => violations.push(event.violatedDirective));
"""

Begin = Callable[[Client], Awaitable[None]]
Perform = Callable[[Client, threading.Event, threading.Event], Awaitable[None]]


@contextmanager
def dashboard(
    browser: Browser, address: str, size: tuple[int, int] = DESKTOP, **options: Any
) -> Iterator[Page]:
    """Open the dashboard in a context of its own and wait until it is connected."""
    viewport = ViewportSize(width=size[0], height=size[1])
    context = browser.new_context(viewport=viewport, **options)
    context.set_default_timeout(PATIENCE_MS)
    page = context.new_page()
    page.add_init_script(WATCH_POLICY)
    page.goto(address)
    try:
        expect(page.locator("#link")).to_contain_text("Connected to hapticvlm")
        yield page
    finally:
        # A page asks for its status all the time: a route of the test may be in the middle of an
        # answer now, and its error would be raised in whatever test comes next.
        page.unroute_all(behavior="ignoreErrors")
        context.close()


@contextmanager
def touching(
    url: str, *, only: str | None = None, lets_go: bool = True, token: str | None = None
) -> Iterator[None]:
    """Stroke the objects in turn, or only one, and show frames of them, in a thread of its own.

    A hand that never lets go rubs on through a stop.
    """
    stroke = _stroke if lets_go else _rub_on
    names = [entry["object_id"] for entry in OBJECTS if only in (None, entry["object_id"])]

    async def touch(client: Client, began: threading.Event, ending: threading.Event) -> None:
        await client.scene(OBJECTS, ambient_c=21.0)
        await client.touch("release")  # a stop of an earlier test holds until then
        frames = asyncio.create_task(_show(client, names))
        began.set()
        try:
            for name in cycle(names):
                await stroke(client, name, ending)
                if ending.is_set():
                    return
        finally:
            frames.cancel()

    with _scene(url, touch, "test scene", token):
        yield


@contextmanager
def idling(url: str, begin: Begin | None = None) -> Iterator[None]:
    """Own the outputs, do no more than what begins the scene, and go when ended."""

    async def idle(client: Client, began: threading.Event, ending: threading.Event) -> None:
        if begin is not None:
            await begin(client)
        began.set()
        ended = asyncio.create_task(asyncio.to_thread(ending.wait))
        tasks = (asyncio.create_task(client.wait_closed()), ended)
        await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
        ending.set()

    with _scene(url, idle, "idle scene"):
        yield


@contextmanager
def _scene(url: str, perform: Perform, name: str, token: str | None = None) -> Iterator[None]:
    """Let a scene perform in a thread of its own, from when it says that it has begun."""
    began, ending = threading.Event(), threading.Event()

    async def run() -> None:
        async with connect(url, name=name, token=token) as client:
            await perform(client, began, ending)

    with ThreadPoolExecutor(1, name) as threads:
        scene = threads.submit(lambda: asyncio.run(run()))
        assert began.wait(START_S), "the scene did not begin"
        try:
            yield
        finally:
            ending.set()
        scene.result(START_S)


@contextmanager
def board_on_a_port() -> Iterator[tuple[str, SimulatedBoard]]:
    """Put a simulated board behind a pseudo terminal; yield the port's name and the board."""
    master, slave = pty.openpty()
    tty.setraw(master)
    os.set_blocking(master, False)
    board, ending = SimulatedBoard(), threading.Event()

    def run() -> None:
        while not ending.wait(BOARD_S):
            try:
                data = os.read(master, 512)
            except BlockingIOError:
                data = b""
            os.write(master, board.exchange(data, time.monotonic()))

    thread = threading.Thread(target=run, name="board", daemon=True)
    thread.start()
    try:
        yield os.ttyname(slave), board
    finally:
        ending.set()
        thread.join(START_S)
        os.close(master)
        os.close(slave)


def picture(seed: int) -> bytes:
    """Return a JPEG of coloured blocks, another for each seed."""
    coarse = np.random.default_rng(seed).integers(0, 255, (8, 8, 3), np.uint8)
    buffer = io.BytesIO()
    Image.fromarray(coarse).resize((SIDE, SIDE)).save(buffer, "JPEG", quality=80)
    return buffer.getvalue()


async def _show(client: Client, names: list[str]) -> None:
    pictures = [picture(seed) for seed in range(16)]
    for name, image in zip(cycle(names), cycle(pictures), strict=False):
        await client.frame(image, SIDE, SIDE, object_id=name, region=REGION)
        await asyncio.sleep(FRAME_S)


async def _stroke(client: Client, name: str, ending: threading.Event) -> None:
    """Strike and rub for a while; a stop ends it early, as it would in a real scene."""
    with suppress(Refused):
        await client.touch("contact", name, speed_mps=0.4, force_n=2.0)
        for _ in range(STROKES):
            if ending.is_set():
                break
            await _rub(client, name)
    await client.touch("release", name)


async def _rub_on(client: Client, name: str, ending: threading.Event) -> None:
    """Rub until the end, whatever the service says, and never let go."""
    await client.touch("contact", name, speed_mps=0.4, force_n=2.0)
    while not ending.is_set():
        with suppress(Refused):
            await _rub(client, name)


async def _rub(client: Client, name: str) -> None:
    await asyncio.sleep(SLIDE_S)
    await client.touch("slide", name, speed_mps=0.2, force_n=1.5)
