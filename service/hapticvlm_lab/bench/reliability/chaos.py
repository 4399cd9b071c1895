"""What each dying part does to the outputs, with times: kill or freeze it while something is felt.

A scene in a process of its own slides over something cold and sends frames; the plate is a board
behind a terminal. Seconds are counted from the blow until, each if it happens: the scene's leases
and the vibration have ended, an observer is told, it works again, the board leaves its setpoint,
its bridge is open. `python -m hapticvlm_lab.bench.reliability.chaos URL` is the scene.
"""

from __future__ import annotations

import asyncio
import contextlib
import itertools
import json
import os
import signal
import statistics
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from rich.console import Console
from rich.table import Table
from websockets.exceptions import ConnectionClosed

from hapticvlm import __version__
from hapticvlm.client import connect
from hapticvlm.client.connection import Client, Refused
from hapticvlm.client.local_service import Service, running
from hapticvlm_lab.bench.latency.load import SIDE, pictures
from hapticvlm_lab.bench.reliability.board import PtyBoard, board_on_a_terminal
from hapticvlm_lab.bench.rigs import Process, helper, service_status

PATIENCE_S = 180.0
WATCHED_S = 15.0
# a frame with every tenth slide
POLL_S = 0.01
SLIDE_S = 0.02
FRAME_EVERY = 10
FROZEN_S = 3.0  # then a frozen board goes on
KETTLE = {"object_id": "kettle", "material": "wood", "temperature_c": 5.0}
SEEN = ("rest", "told", "works again", "board leaves the setpoint", "bridge open")

Status = dict[str, Any]


@dataclass(slots=True)
class Scenario:
    """Everything that may be hit, and what was seen since: s after the blow."""

    service: Service
    board: PtyBoard
    scene: Process
    before: Status
    hit_at: float = 0.0
    seen: dict[str, float] = field(default_factory=dict)

    def note(self, what: str, at: float) -> None:
        """Note the first time that something was seen."""
        self.seen.setdefault(what, at - self.hit_at)


@dataclass(frozen=True, slots=True)
class Row:
    """What is hit, by which signal, and what has to be seen."""

    target: Callable[[Scenario], int]
    number: int
    awaited: tuple[str, ...]


def _part(name: str) -> Callable[[Scenario], int]:
    return lambda scenario: int(scenario.before[name]["pid"])


def _service(scenario: Scenario) -> int:
    return scenario.service.process.pid


def _scene(scenario: Scenario) -> int:
    return scenario.scene.pid


def _board(scenario: Scenario) -> int:
    return scenario.board.pid


KILL = signal.SIGKILL
STOP = getattr(signal, "SIGSTOP", signal.SIGTERM)
REST, TOLD, AGAIN, LEAVES, OPEN = SEEN
ROWS = {
    "audio engine killed": Row(_part("speaker"), KILL, (TOLD, AGAIN)),
    "audio engine frozen": Row(_part("speaker"), STOP, (TOLD, AGAIN)),
    "recogniser killed": Row(_part("recogniser"), KILL, (TOLD, AGAIN)),
    "recogniser frozen": Row(_part("recogniser"), STOP, (TOLD, AGAIN)),
    "scene killed": Row(_scene, KILL, (REST, LEAVES, OPEN)),
    "scene frozen": Row(_scene, STOP, (REST,)),  # the plate is kept neutral for half a minute
    "board frozen for 3 s": Row(_board, STOP, (TOLD, AGAIN)),
    "board unplugged": Row(_board, KILL, (TOLD,)),
    "service killed": Row(_service, KILL, (LEAVES, OPEN)),
    "service frozen": Row(_service, STOP, (LEAVES, OPEN)),
    "service ended by SIGTERM": Row(_service, signal.SIGTERM, (OPEN,)),
}


def run(*, trials: int, only: list[str], as_json: bool) -> int:
    """Measure, print a table or JSON; 1 if something awaited did not come within WATCHED_S."""
    console = Console(quiet=as_json, width=150)
    rows: list[dict[str, Any]] = []
    for name, row in ROWS.items():
        if only and name not in only:
            continue
        with console.status(name):
            found = [asyncio.run(_trial(row)) for _ in range(trials)]
        rows.append({"row": name, "n": trials, **summary(row, found), "load": os.getloadavg()[0]})
        print(json.dumps(rows[-1]), file=sys.stderr, flush=True)
    title = "seconds after the blow (median / longest)"
    table = Table("hit", "n", *SEEN, "load", title=title)
    for each in rows:
        cells = [f"{each[what][0]} / {each[what][1]}" if what in each else "" for what in SEEN]
        table.add_row(each["row"], str(each["n"]), *cells, f"{each['load']:.1f}")
    console.print(table)
    if as_json:
        print(json.dumps({"measure": "chaos", "hapticvlm": __version__, "rows": rows}))
    return int(any(each[what][1] == float("inf") for each in rows for what in SEEN if what in each))


def summary(row: Row, found: list[dict[str, float]]) -> dict[str, tuple[float, float]]:
    """Return median and longest time of what was awaited, s; inf for what did not come."""
    times = {what: [seen.get(what, float("inf")) for seen in found] for what in row.awaited}
    return {
        what: (round(statistics.median_high(each), 2), round(max(each), 2))
        for what, each in times.items()
    }


async def _trial(row: Row) -> dict[str, float]:
    with (
        board_on_a_terminal() as board,
        running(["--peltier", board.port]) as service,
        helper("reliability.chaos", service.url) as scene,
    ):
        async with connect(service.url, name="chaos", role="observer") as observer:
            before = await _driven(service, board)
            scenario = Scenario(service, board, scene, before)
            scenario.hit_at = time.monotonic()
            target = row.target(scenario)
            os.kill(target, row.number)
            try:
                await _watch(scenario, row, observer)
            finally:
                with contextlib.suppress(ProcessLookupError):
                    os.kill(target, signal.SIGCONT)
    return scenario.seen


async def _driven(service: Service, board: PtyBoard) -> Status:
    """Wait until both outputs are driven and the recogniser is busy with frames."""
    async with asyncio.timeout(PATIENCE_S):
        while True:
            found = await asyncio.to_thread(service_status, service)
            if found["speaker"]["level"] > 0.0 and board.state == "HOLDING":
                return found
            await asyncio.sleep(POLL_S)


async def _watch(scenario: Scenario, row: Row, observer: Client) -> None:
    """Look until all that is awaited was seen, or for WATCHED_S."""
    telling = asyncio.create_task(_hear(scenario, observer))
    until = scenario.hit_at + WATCHED_S
    answers = row.target is not _service
    while set(row.awaited) - scenario.seen.keys() and (now := time.monotonic()) < until:
        if row.target is _board and now - scenario.hit_at > FROZEN_S:
            with contextlib.suppress(ProcessLookupError):
                os.kill(scenario.board.pid, signal.SIGCONT)
        if answers:
            _note(scenario, row, await asyncio.to_thread(service_status, scenario.service))
        for at, state in list(scenario.board.events):
            if at > scenario.hit_at and state in ("RETURNING", "OFF"):
                scenario.note(LEAVES, at)
                if state == "OFF":
                    scenario.note(OPEN, at)
        await asyncio.sleep(POLL_S)
    telling.cancel()
    with contextlib.suppress(asyncio.CancelledError):
        await telling


def _note(scenario: Scenario, row: Row, found: Status) -> None:
    now = time.monotonic()
    if not found["leases"] and found["speaker"]["level"] == 0.0:
        scenario.note(REST, now)
    if TOLD not in scenario.seen:
        return
    speaker = found["speaker"]
    works = {
        "speaker": speaker["plays"] and speaker["level"] > 0.0,
        "recogniser": found["recogniser"]["ready"],
    }
    for name, is_working in works.items():
        before = scenario.before[name]["pid"]
        is_new = found[name]["pid"] not in (None, before)
        if row.target(scenario) == before and is_new and is_working:
            scenario.note(AGAIN, now)
    if row.target is _board and not found["plate"]["faults"]:
        scenario.note(AGAIN, now)


async def _hear(scenario: Scenario, observer: Client) -> None:
    while True:
        if (await observer.events.get())["type"] == "error":
            scenario.note(TOLD, time.monotonic())


async def _slide(url: str) -> None:
    """Slide over something cold, and touch it anew after whatever ended the touch."""
    frames = itertools.cycle(pictures(12, 40_000))
    async with connect(url, name="chaos scene") as client:
        await client.scene([KETTLE, {"object_id": "thing"}])
        for number in range(1_000_000):
            phase = "slide"
            while not client.events.empty():
                if client.events.get_nowait()["type"] == "error":
                    phase = "contact"
            with contextlib.suppress(Refused):
                if phase == "contact" or not number:
                    await client.touch("release")
                    phase = "contact"
                await client.touch(phase, "kettle", speed_mps=0.3, force_n=1.5)
            if number % FRAME_EVERY == 0:
                fields = {"captured_at": time.monotonic(), "format": "jpeg", "origin": "top"}
                size = {"width": SIDE, "height": SIDE, "object_id": "thing"}
                await client.send("frame", image=next(frames), **size, **fields)
            await asyncio.sleep(SLIDE_S)


if __name__ == "__main__":
    with contextlib.suppress(ConnectionError, ConnectionClosed):  # the service was hit
        asyncio.run(_slide(sys.argv[1]))
