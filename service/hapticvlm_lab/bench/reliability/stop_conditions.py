"""The conditions of a stop: frames, a client that sends garbage, a button in a browser."""

from __future__ import annotations

import shutil
import time
from collections.abc import AsyncIterator, Awaitable, Callable, Iterator
from contextlib import (
    AbstractAsyncContextManager,
    AbstractContextManager,
    asynccontextmanager,
    contextmanager,
)
from dataclasses import dataclass

from hapticvlm.client import connect
from hapticvlm.client.local_service import Service
from hapticvlm_lab.bench.rigs import first_line, helper

LOAD_S = 3600.0  # more than a condition lasts
LOAD = ("120", "40000", "2")  # frames/s, bytes a frame, scenes: all that are admitted
PATIENCE_MS = 120_000.0  # of a browser on a busy machine

Press = Callable[[], Awaitable[tuple[float, float]]]


@contextmanager
def _nothing(_: Service) -> Iterator[None]:
    yield


@asynccontextmanager
async def _observer(service: Service) -> AsyncIterator[Press]:
    """Stop from another connection; yields a press that returns when it was sent and answered."""
    async with connect(service.url, name="stops", role="observer") as client:

        async def press() -> tuple[float, float]:
            pressed = time.monotonic()
            await client.stop()
            return pressed, time.monotonic()

        yield press


@dataclass(frozen=True, slots=True)
class Condition:
    """The load beside the service, and the source of the stop."""

    load: Callable[[Service], AbstractContextManager[None]] = _nothing
    presser: Callable[[Service], AbstractAsyncContextManager[Press]] = _observer


@contextmanager
def _process(module: str, *arguments: object) -> Iterator[None]:
    with helper(module, *arguments) as process:
        first_line(process)
        yield


@contextmanager
def _frames(service: Service) -> Iterator[None]:
    rate, size, scenes = LOAD
    with _process("latency.load", service.url, rate, LOAD_S, size, scenes):
        yield


@contextmanager
def _garbage(service: Service) -> Iterator[None]:
    with _process("reliability.garbage_client", service.url):
        yield


@asynccontextmanager
async def _button(service: Service) -> AsyncIterator[Press]:
    """Stop by the dashboard's button in Chromium, whose clock is the wall clock."""
    from playwright.async_api import async_playwright

    async with async_playwright() as playwright:
        browser = await playwright.chromium.launch(
            executable_path=shutil.which("chromium"), args=["--no-sandbox"]
        )
        page = await browser.new_page()
        page.set_default_timeout(PATIENCE_MS)
        await page.goto(service.page)
        await page.wait_for_selector("#owner[data-owned=true]")

        async def press() -> tuple[float, float]:
            # performance.timeOrigin is of the wall clock, the other times are monotonic: the offset
            # between the two is taken at the press itself, since the wall clock may be set.
            script = """() => { const at = performance.timeOrigin + performance.now();
                document.getElementById("stopped").textContent = "";
                document.getElementById("stop").click(); return at; }"""
            at = await page.evaluate(script)
            pressed = at / 1000.0 - (time.time() - time.monotonic())
            await page.locator("#stopped", has_text="Stopped at").wait_for()
            return pressed, time.monotonic()

        try:
            yield press
        finally:
            await browser.close()


CONDITIONS = {
    "idle": Condition(),
    "2 x 120 frames/s": Condition(load=_frames),
    "garbage": Condition(load=_garbage),
    "dashboard's button": Condition(presser=_button),
}
