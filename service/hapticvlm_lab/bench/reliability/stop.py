"""`hapticvlm measure stop`: the time until the sink is silent and the plate's bridge is open.

A scene touches something cold, so that speaker and plate are both driven; another connection (or
the dashboard's button) stops at a random moment. Both outputs are watched from outside. Sound is
recorded at a null sink, which includes the delay of the sound server. OFF is observed on the serial
line and at a simulated board behind a terminal.
"""

from __future__ import annotations

import asyncio
import json
import os
import random
import sys
import time
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager, suppress
from dataclasses import dataclass
from typing import Any

import numpy as np
from null_sink import Recording, Server, null_sink, recording
from rich.console import Console
from rich.table import Table

from hapticvlm import __version__
from hapticvlm.client import connect
from hapticvlm.client.connection import Client, Refused
from hapticvlm.client.local_service import Service, running
from hapticvlm_lab.bench.reliability.board import OFF, PtyBoard, board_on_a_terminal
from hapticvlm_lab.bench.reliability.stop_conditions import CONDITIONS, Condition, Press
from hapticvlm_lab.bench.rigs import priority, set_priority

MARK_MS = 50.0
TRIALS = 20  # stops for each condition
SERVER_PRIORITY = 25
DRIVEN_WITHIN_S = 180.0  # from the contact to vibration and a driven plate, on a busy machine
DRIVEN_FOR_S = (0.1, 0.4)  # random, so that no stop falls in step with anything
SLIDE_S = 0.02
WATCHED_S = 0.35  # from a stop on
CLEAR_S = 0.3
KETTLE = {"object_id": "kettle", "material": "wood", "temperature_c": 5.0}


@dataclass(frozen=True, slots=True)
class Outputs:
    """Both outputs as observed from outside."""

    recording: Recording
    board: PtyBoard

    def are_driven(self, now: float) -> bool:
        """Return whether sound was just recorded and the plate holds a setpoint."""
        newest = self.recording.chunks[-100:]
        sounds = any(np.frombuffer(data, "f4").any() for at, data in newest if at > now - 0.05)
        return sounds and self.board.state == "HOLDING"

    def silent_after(self, moment: float, until: float) -> float:
        """Return the time in s until the last chunk with a sound arrived; inf if it goes on."""
        chunks = [
            each for each in list(self.recording.chunks[-20_000:]) if moment < each[0] <= until
        ]
        last = next((at for at, data in reversed(chunks) if np.frombuffer(data, "f4").any()), None)
        if last is None:
            return 0.0
        # A sound that close to the end of the window has not ended within it.
        return float("inf") if until - last < 0.05 else last - moment


@dataclass(frozen=True, slots=True)
class Trial:
    """One stop: ms until answer, silence, OFF on the line and open bridge."""

    answered: float
    silent: float
    off: float
    bridge: float


def run(*, as_json: bool) -> int:
    """Measure, print a table or JSON. Returns 1 if a p99 is above the mark or a condition failed.

    A condition that fails is reported with its reason, and the others are measured. Raises
    SinkError, ServiceError.
    """
    console = Console(quiet=as_json, width=150)
    rows: list[dict[str, Any]] = []
    with null_sink() as server, priority(realtime=True), recording() as recorded:
        _raise_priority(server, recorded)
        devices = ["--speaker", "Palm", "--peltier"]
        with board_on_a_terminal() as board, running([*devices, board.port]) as service:
            for name, condition in CONDITIONS.items():
                with console.status(name):
                    row = _row(condition, Outputs(recorded, board), service)
                rows.append({"condition": name, **row})
                recorded.chunks.clear()
                print(json.dumps(rows[-1]), file=sys.stderr, flush=True)
    console.print(_table(rows))
    if as_json:
        print(json.dumps({"measure": "stop", "hapticvlm": __version__, "rows": rows}))
    return int(not all(_holds(row) for row in rows))


def _raise_priority(server: Server, recording: Recording) -> None:
    """Give real-time priority to the sound server and the recorder too.

    Otherwise their waiting for the processor would count as delay of the audio engine.
    """
    ids = [process.pid for process in (*server.processes, recording.process)]
    if recording.reader is not None and recording.reader.native_id is not None:
        ids.append(recording.reader.native_id)  # a thread of ours, which does not inherit priority
    for number in ids:
        set_priority(number, SERVER_PRIORITY)


def summary(trials: list[Trial]) -> dict[str, Any]:
    """Return median, p99 and the longest of each time, ms."""

    def spread(values: list[float]) -> dict[str, float]:
        # A stop that never came is infinite. "higher" takes a measured value, where interpolation
        # between a figure and infinity would give no number.
        median, p99 = np.percentile(values, (50, 99), method="higher")
        return {"median": round(median, 1), "p99": round(p99, 1), "max": round(max(values), 1)}

    names = ("answered", "silent", "off", "bridge")
    return {
        "n": len(trials),
        **{name: spread([getattr(each, name) for each in trials]) for name in names},
    }


def _holds(row: dict[str, Any]) -> bool:
    """Return whether both outputs of a condition were at rest within the mark."""
    return "failed" not in row and max(row[what]["p99"] for what in ("silent", "bridge")) <= MARK_MS


def _row(condition: Condition, outputs: Outputs, service: Service) -> dict[str, Any]:
    """Measure one condition: its figures, or the reason why there are none."""
    try:
        with condition.load(service):
            figures = summary(asyncio.run(_measure(condition, outputs, service)))
    except Exception as error:  # noqa: BLE001 - a browser's or a client's; the other rows go on
        figures = {"failed": f"{type(error).__name__}: {error}"}
    return {**figures, "load": round(os.getloadavg()[0], 1)}


async def _measure(condition: Condition, outputs: Outputs, service: Service) -> list[Trial]:
    async with _touching(service.url) as hand, condition.presser(service) as press:
        return [await _trial(outputs, hand, press) for _ in range(TRIALS)]


async def _trial(outputs: Outputs, hand: _Hand, press: Press) -> Trial:
    hand.touch()
    await _driven(outputs)
    await asyncio.sleep(random.uniform(*DRIVEN_FOR_S))
    pressed, answered = await press()
    until = pressed + WATCHED_S
    await asyncio.sleep(until - time.monotonic())
    await hand.lift()
    await asyncio.sleep(CLEAR_S)  # the board's diary and the last sounds are still on their way
    off = outputs.board.first(OFF, pressed, until)
    opened = outputs.board.first("OFF", pressed, until)
    return Trial(
        (answered - pressed) * 1000.0,
        outputs.silent_after(pressed, until) * 1000.0,
        _ms_between(pressed, off),
        _ms_between(pressed, opened),
    )


def _ms_between(begin: float, end: float | None) -> float:
    return float("inf") if end is None else (end - begin) * 1000.0


async def _driven(outputs: Outputs) -> None:
    """Wait until vibration is recorded and the plate is driven."""
    async with asyncio.timeout(DRIVEN_WITHIN_S):
        while not outputs.are_driven(time.monotonic()):  # noqa: ASYNC110 - there is no event
            await asyncio.sleep(0.01)


class _Hand:
    """A hand that slides over something cold, stops or not, until it is lifted."""

    def __init__(self, client: Client) -> None:
        self._client = client
        self._sliding: asyncio.Task[None] | None = None

    def touch(self) -> None:
        """Touch, and slide on in a task."""
        self._sliding = asyncio.create_task(self._slide())

    async def lift(self) -> None:
        """End the touch; the service has received it when this returns."""
        if self._sliding is None:
            return
        self._sliding.cancel()
        with suppress(asyncio.CancelledError):
            await self._sliding
        await self._client.touch("release", "kettle")

    async def _slide(self) -> None:
        phase = "contact"
        while True:
            with suppress(Refused):  # after a stop every touch is refused until the release
                await self._client.touch(phase, "kettle", speed_mps=0.3, force_n=1.5)
            phase = "slide"
            await asyncio.sleep(SLIDE_S)


@asynccontextmanager
async def _touching(url: str) -> AsyncIterator[_Hand]:
    async with connect(url, name="measure stop") as client:
        await client.scene([KETTLE])
        hand = _Hand(client)
        try:
            yield hand
        finally:
            await hand.lift()


def _table(rows: list[dict[str, Any]]) -> Table:
    columns = ("answered", "silent", "OFF on the line", "bridge open", "load")
    title = "stop, ms until (median / p99 / longest)"
    table = Table("condition", "n", *columns, title=title)
    for row in rows:
        if "failed" in row:
            table.add_row(row["condition"], "failed", row["failed"])
            continue
        times = (row[name] for name in ("answered", "silent", "off", "bridge"))
        cells = (f"{each['median']} / {each['p99']} / {each['max']}" for each in times)
        table.add_row(row["condition"], str(row["n"]), *cells, str(row["load"]))
    return table
