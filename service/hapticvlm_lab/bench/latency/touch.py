"""Touch round trip against a bare echo of the same bytes, same client, same load, same run.

Touches of a known object and echoes take turns, 100 of each a second: while nothing else happens,
while a second process streams 60 different frames a second, and while it streams 240, so that the
recogniser is never idle; with normal and with real-time priority, which service, echo and client
have alike. The answer to a touch is sent after its command is in
the audio ring; how long the command then waits for its first block is read from the engine.
"""

from __future__ import annotations

import asyncio
import json
import os
import platform
import subprocess
import sys
import time
import urllib.request
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import msgpack
import numpy as np
import websockets.version
from rich.console import Console
from rich.table import Table
from websockets.asyncio.client import ClientConnection
from websockets.asyncio.client import connect as open_socket

from hapticvlm import __version__
from hapticvlm.commands.local_service import Service, running

RATE_HZ = 100.0
FRAME_RATE_HZ = 60.0
FRAME_BYTES = 40_000
WARM_UP = 100
SETTLE_S = 0.5
MARGIN_S = SETTLE_S + WARM_UP / RATE_HZ + 1.0
CLIENT_PRIORITY = 5
LOADS = {0: "idle", 1: "60 frames/s", 4: "4 x 60 frames/s"}  # scenes that stream frames
BURNING = "VLM flat out"
BURN_END_S = 60.0  # a pass under way may take some seconds
BLOCK_MS = 128 / 48.0


@dataclass(frozen=True, slots=True)
class Row:
    """One condition: round trips in ms, and what went on meanwhile."""

    name: str
    touch_ms: list[float]
    echo_ms: list[float]
    load: float
    frames: dict[str, Any] | None
    command_wait_ms: dict[str, float]
    recogniser_busy: float

    def summary(self) -> dict[str, Any]:
        """Return the figures of this row."""
        touch, echo = np.array(self.touch_ms), np.array(self.echo_ms)
        touch_99, echo_99 = np.percentile(touch, 99), np.percentile(echo, 99)
        return {
            "condition": self.name,
            "n": touch.size,
            "touch_median_ms": round(float(np.median(touch)), 3),
            "touch_p99_ms": round(float(touch_99), 3),
            "echo_median_ms": round(float(np.median(echo)), 3),
            "echo_p99_ms": round(float(echo_99), 3),
            "median_ratio": round(float(np.median(touch) / np.median(echo)), 2),
            "p99_ratio": round(float(touch_99 / echo_99), 2),
            "load": round(self.load, 2),
            "recogniser_busy": round(self.recogniser_busy, 2),
            "frames": self.frames,
            "command_to_block_median": round(self.command_wait_ms["median"] / BLOCK_MS, 2),
            "command_to_block_p99": round(self.command_wait_ms["p99"] / BLOCK_MS, 2),
        }


def run(*, seconds: float, as_json: bool, with_vlm: bool = False) -> int:
    """Measure, print a table and, last, one JSON object; with a VLM busy on every core too."""
    console = Console(quiet=as_json, width=150)
    rows: list[Row] = []
    vlm: dict[str, dict[str, Any]] = {}
    for realtime in (False, True) if _may_take_priority() else (False,):
        priority = "real-time" if realtime else "normal"
        arguments = [] if realtime else ["--no-realtime"]
        with _priority(realtime), _echo(realtime) as port, running(arguments) as service:
            for scenes, what in LOADS.items():
                name = f"{priority}, {what}"
                with console.status(f"{name}: {seconds:.0f} s"):
                    rows.append(asyncio.run(_row(name, service, port, seconds, scenes)))
            if with_vlm:
                with console.status(f"{priority}, {BURNING}"), _burning(seconds) as burnt:
                    name = f"{priority}, {BURNING}"
                    rows.append(asyncio.run(_row(name, service, port, seconds, 0)))
                vlm[priority] = burnt
    summaries = [row.summary() for row in rows]
    console.print(_table(summaries))
    for priority, burnt in vlm.items():
        console.print(f"{priority}: the VLM ({burnt['model']}) kept {burnt['cores']} cores busy")
    if len(rows) < 2 * (len(LOADS) + with_vlm):
        console.print("real-time priority is not permitted here: those rows are missing")
    told = {"measure": "latency", **_versions(), "block_ms": BLOCK_MS, "rows": summaries}
    print(json.dumps({**told, "vlm": vlm or None}))
    return 0


async def _row(name: str, service: Service, echo: int, seconds: float, scenes: int) -> Row:
    load = await _start_load(service.url, seconds + MARGIN_S, scenes) if scenes else None
    async with (
        open_socket(service.url, compression=None, proxy=None, ping_interval=None) as touches,
        open_socket(
            f"ws://127.0.0.1:{echo}/", compression=None, proxy=None, ping_interval=None
        ) as echoes,
    ):
        await _introduce(touches)
        if load is not None and load.stdout is not None:
            await load.stdout.readline()
            await asyncio.sleep(SETTLE_S)
        started, busy_s = time.monotonic(), _status(service)["recogniser"]["busy_s"]
        touch_ms, echo_ms = await _take_turns(touches, echoes, seconds)
        status = _status(service)
        busy = (status["recogniser"]["busy_s"] - busy_s) / (time.monotonic() - started)
        waits = status["speaker"]["command_wait_ms"]
    result = None
    if load is not None:
        out, _ = await load.communicate()
        result = json.loads(out)
    return Row(name, touch_ms, echo_ms, os.getloadavg()[0], result, waits, busy)


async def _take_turns(
    touches: ClientConnection, echoes: ClientConnection, seconds: float
) -> tuple[list[float], list[float]]:
    touch_ms: list[float] = []
    echo_ms: list[float] = []
    started = time.perf_counter()
    for number in range(int(seconds * RATE_HZ) + WARM_UP):
        due = started + number / RATE_HZ
        await asyncio.sleep(max(0.0, due - time.perf_counter()))
        data = msgpack.packb(_touch(number))
        touch_ms.append(await _round_trip(touches, data, number + 10))
        await asyncio.sleep(max(0.0, due + 0.5 / RATE_HZ - time.perf_counter()))
        echo_ms.append(await _round_trip(echoes, data, number + 10))
    return touch_ms[WARM_UP:], echo_ms[WARM_UP:]


def _touch(number: int) -> dict[str, Any]:
    """Contact, 18 slides and a release, over and over."""
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


async def _round_trip(socket: ClientConnection, data: bytes, id: int) -> float:
    """Return the time in ms until the message with this id comes back."""
    started = time.perf_counter()
    await socket.send(data)
    while True:
        answer = msgpack.unpackb(await socket.recv())
        if answer["id"] == id:
            if answer["type"] == "error":
                raise RuntimeError(answer["text"])
            return (time.perf_counter() - started) * 1000.0


async def _introduce(socket: ClientConnection) -> None:
    client = {"name": "measure latency", "version": __version__}
    protocol = {"major": 1, "minor": 0}
    table = {"object_id": "table", "material": "wood"}
    for message in (
        {"type": "hello", "id": 1, "client": client, "protocol": protocol, "role": "scene"},
        {"type": "scene", "id": 2, "objects": [table], "replace": True},
    ):
        await _round_trip(socket, msgpack.packb(message), int(str(message["id"])))


async def _start_load(url: str, seconds: float, scenes: int) -> asyncio.subprocess.Process:
    return await asyncio.create_subprocess_exec(
        *(sys.executable, "-m", "hapticvlm_lab.bench.latency.load", url),
        *(str(FRAME_RATE_HZ), str(seconds), str(FRAME_BYTES), str(scenes)),
        stdout=subprocess.PIPE,
    )


@contextmanager
def _burning(seconds: float) -> Iterator[dict[str, Any]]:
    """Keep a VLM busy on every core meanwhile; what it did is told when the context ends."""
    told: dict[str, Any] = {}
    command = [
        sys.executable,
        "-m",
        "hapticvlm_lab.bench.latency.burn",
        str(seconds + MARGIN_S + 1.0),
    ]
    command.append(str(os.cpu_count() or 1))
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        try:
            if process.stdout.readline() != "burning\n":
                raise RuntimeError("the VLM did not start; it needs the extra `models`")
            yield told
            told |= json.loads(process.communicate(timeout=BURN_END_S)[0])
        finally:
            process.kill()


@contextmanager
def _echo(realtime: bool) -> Iterator[int]:
    command = [sys.executable, "-m", "hapticvlm_lab.bench.latency.echo", *(["realtime"] * realtime)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        try:
            yield int(process.stdout.readline())
        finally:
            process.kill()


@contextmanager
def _priority(realtime: bool) -> Iterator[None]:
    """Give the measuring client the same kind of priority; children start without it."""
    if not realtime:
        yield
        return
    flags = os.SCHED_FIFO | os.SCHED_RESET_ON_FORK
    os.sched_setscheduler(0, flags, os.sched_param(CLIENT_PRIORITY))
    try:
        yield
    finally:
        os.sched_setscheduler(0, os.SCHED_OTHER, os.sched_param(0))


def _may_take_priority() -> bool:
    if not hasattr(os, "sched_setscheduler"):
        return False
    try:
        with _priority(True):
            return True
    except OSError:
        return False


def _status(service: Service) -> dict[str, Any]:
    with urllib.request.urlopen(service.page + "status", timeout=5) as answer:
        status: dict[str, Any] = json.load(answer)
    return status


def _table(rows: list[dict[str, Any]]) -> Table:
    table = Table(title="touch round trip, ms (floor: bare websockets echo of the same bytes)")
    for column in ("condition", "n", "touch median / p99", "echo median / p99"):
        table.add_column(column)
    for column in ("ratio median / p99", "to block, blocks", "busy", "load", "frames"):
        table.add_column(column)
    for row in rows:
        table.add_row(
            row["condition"],
            str(row["n"]),
            f"{row['touch_median_ms']:.3f} / {row['touch_p99_ms']:.3f}",
            f"{row['echo_median_ms']:.3f} / {row['echo_p99_ms']:.3f}",
            f"{row['median_ratio']:.2f} / {row['p99_ratio']:.2f}",
            f"{row['command_to_block_median']:.2f} / {row['command_to_block_p99']:.2f}",
            f"{row['recogniser_busy']:.0%}",
            f"{row['load']:.1f}",
            _frames(row["frames"]),
        )
    return table


def _frames(frames: dict[str, Any] | None) -> str:
    if frames is None:
        return "none"
    answers = ", ".join(f"{count} {name}" for name, count in frames["answers"].items())
    return f"{frames['sent']} sent: {answers}, {frames['unanswered']} unanswered"


def _versions() -> dict[str, Any]:
    return {
        "hapticvlm": __version__,
        "python": platform.python_version(),
        "websockets": websockets.version.version,
        "cpus": os.cpu_count(),
    }
