"""The conditions of a stop: loads, floods, dying children, an unread log, a button in a browser."""

from __future__ import annotations

import os
import shutil
import signal
import tempfile
import time
from collections.abc import AsyncIterator, Awaitable, Callable, Iterator
from contextlib import (
    AbstractAsyncContextManager,
    AbstractContextManager,
    asynccontextmanager,
    contextmanager,
)
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import soundfile

from hapticvlm.client import connect
from hapticvlm.client.local_service import Service, running
from hapticvlm.materials import MATERIALS
from hapticvlm.rendering.vibration.vibration import RATE_HZ
from hapticvlm_lab.bench.reliability.flood_clients import KINDS, RECONNECTIONS
from hapticvlm_lab.bench.rigs import first_line, helper, service_status

LOAD_S = 3600.0  # more than a condition lasts
LOAD = ("120", "40000", "2")  # frames/s, bytes a frame, scenes: all that are admitted
RECORDINGS = 30
RECORDING_S = 10.0
RECORDED = ("carve", "slide", "swing")  # a recorded impact may not last as long
PATIENCE_MS = 120_000.0  # of a browser on a busy machine
FILL_S = 4.0  # some hundred lines a second: more than a pipe of 64 KiB holds

Press = Callable[[], Awaitable[tuple[float, float]]]
Start = Callable[[list[str]], AbstractContextManager[Service]]


@contextmanager
def _nothing(_: Service) -> Iterator[None]:
    yield


@contextmanager
def _plain(arguments: list[str]) -> Iterator[Service]:
    with running(arguments) as service:
        yield service


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
    """The service, the load beside it, the source of the stop, and an event just before it."""

    service: Start = _plain
    load: Callable[[Service], AbstractContextManager[None]] = _nothing
    presser: Callable[[Service], AbstractAsyncContextManager[Press]] = _observer
    strike: Callable[[Service], None] | None = None
    struck_s: float = 0.0  # the stop comes within this after the strike
    watched_s: float = 0.35
    steady_s: float = 0.0  # before the strike: a child that dies again soon is restarted late
    most: int | None = None  # number of stops, if each takes long


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


def _flooded(kind: str) -> Condition:
    @contextmanager
    def flooding(service: Service) -> Iterator[None]:
        with _process("reliability.flood_clients", service.url, kind, LOAD_S):
            yield

    return Condition(load=flooding)


@contextmanager
def _unread(arguments: list[str]) -> Iterator[Service]:
    """Run a service that logs into a pipe without a reader."""
    reading, writing = os.pipe()
    try:
        with running(arguments, log=writing) as service:
            yield service
    finally:
        os.close(writing)
        os.close(reading)


@contextmanager
def _fill(service: Service) -> Iterator[None]:
    """Log more than the pipe holds, and keep logging."""
    with _process("reliability.flood_clients", service.url, RECONNECTIONS, LOAD_S):
        time.sleep(FILL_S)
        yield


def write_recordings(folder: Path, seconds: float) -> None:
    """Write recordings of noise in the form that `serve --patterns` takes."""
    noise = np.random.default_rng(0).normal(0.0, 0.1, round(seconds * RATE_HZ))
    names = [f"{material}-{kind}" for material in MATERIALS for kind in RECORDED][:RECORDINGS]
    for name in names:
        soundfile.write(folder / f"{name}.wav", noise, RATE_HZ)


@contextmanager
def _with_recordings(arguments: list[str]) -> Iterator[Service]:
    with tempfile.TemporaryDirectory(prefix="hapticvlm-patterns-") as folder:
        write_recordings(Path(folder), RECORDING_S)
        with running([*arguments, "--patterns", folder]) as service:
            yield service


def _kill(part: str) -> Callable[[Service], None]:
    def strike(service: Service) -> None:
        pid = service_status(service)[part]["pid"]
        if pid is not None:
            os.kill(pid, signal.SIGKILL)

    return strike


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
    **{f"flood: {kind}": _flooded(kind) for kind in KINDS if kind != RECONNECTIONS},
    "log without a reader": Condition(service=_unread, load=_fill),
    "recogniser killed before, 30 recordings": Condition(
        service=_with_recordings,
        strike=_kill("recogniser"),
        struck_s=1.0,
        watched_s=1.0,
        steady_s=12.0,
        most=8,
    ),
    "engine killed before, 30 recordings": Condition(
        service=_with_recordings,
        strike=_kill("speaker"),
        struck_s=1.5,
        watched_s=2.5,
        steady_s=12.0,
        most=8,
    ),
    "dashboard's button": Condition(presser=_button),
}
