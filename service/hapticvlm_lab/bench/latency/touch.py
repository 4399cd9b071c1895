"""Round trip of a touch against a bare echo of the same bytes, by the same client in the same run.

Touches of a known object and echoes take turns, 100 of each a second. Both meet the same machine in
the same second, so their ratio says what the service adds, and stays the same when the machine is
slow. Conditions: no other load; a second process that streams 60 different frames a second; two
scenes of 90, so that the recogniser is never idle. Service, echo and client all have normal or all
have real-time priority.

The service answers a touch after its command is in the audio ring.
"""

from __future__ import annotations

import asyncio
import json
import os
import platform
import time
from contextlib import AbstractContextManager, ExitStack
from dataclasses import dataclass
from typing import Any

import msgspec
import numpy as np
import websockets.version
from rich.console import Console
from rich.table import Table
from websockets.asyncio.client import ClientConnection

from hapticvlm import __version__
from hapticvlm.client.local_service import Service, running
from hapticvlm_lab.bench.latency.round_trip import echo, round_trip, sockets, touch
from hapticvlm_lab.bench.rigs import (
    Process,
    first_line,
    helper,
    is_priority_permitted,
    priority,
    report_of,
    service_status,
)

SECONDS = 6.0  # of a row
RATE_HZ = 100.0
FRAME_BYTES = 40_000
WARM_UP = 100
SETTLE_S = 0.5
MARGIN_S = SETTLE_S + WARM_UP / RATE_HZ + 1.0
# Scenes that stream, and frames/s of each: two are admitted beside an owner, and each is answered
# `skipped` for what is above 90 a second.
LOADS = {"idle": (0, 0.0), "60 frames/s": (1, 60.0), "2 x 90 frames/s": (2, 90.0)}


@dataclass(frozen=True, slots=True)
class Row:
    """One condition: round trips in ms, and the load beside them."""

    name: str
    touch_ms: list[float]
    echo_ms: list[float]
    load: float
    frames: dict[str, Any] | None
    recogniser_busy: float

    def summary(self) -> dict[str, Any]:
        """Return the figures of this row."""
        touches = np.array(self.touch_ms)
        echoes = np.array(self.echo_ms)
        touch_99 = np.percentile(touches, 99)
        echo_99 = np.percentile(echoes, 99)
        return {
            "condition": self.name,
            "n": touches.size,
            "touch_median_ms": round(float(np.median(touches)), 3),
            "touch_p99_ms": round(float(touch_99), 3),
            "echo_median_ms": round(float(np.median(echoes)), 3),
            "echo_p99_ms": round(float(echo_99), 3),
            "median_ratio": round(float(np.median(touches) / np.median(echoes)), 2),
            "p99_ratio": round(float(touch_99 / echo_99), 2),
            "load": round(self.load, 2),
            "recogniser_busy": round(self.recogniser_busy, 2),
            "frames": self.frames,
        }


def run(*, as_json: bool) -> int:
    """Measure, and print a table or JSON."""
    console = Console(quiet=as_json, width=150)
    rows: list[Row] = []
    for realtime in (False, True) if is_priority_permitted() else (False,):
        kind = "real-time" if realtime else "normal"
        arguments = [] if realtime else ["--no-realtime"]
        with priority(realtime), echo(realtime) as port, running(arguments) as service:
            for what, frames in LOADS.items():
                name = f"{kind}, {what}"
                with console.status(f"{name}: {SECONDS:.0f} s"):
                    rows.append(asyncio.run(measured(name, service, port, SECONDS, frames)))
    summaries = [row.summary() for row in rows]
    console.print(_table(summaries))
    if len(rows) < 2 * len(LOADS):
        console.print("real-time priority is not permitted here: its rows are missing")
    if as_json:
        report = {"measure": "latency", **_versions(), "rows": summaries}
        print(json.dumps(report))
    return 0


async def measured(
    name: str, service: Service, echo_port: int, seconds: float, frames: tuple[int, float]
) -> Row:
    """Measure one condition; `frames` are the number of streaming scenes, and frames/s of each."""
    with ExitStack() as stack:
        load = None
        if frames[0]:
            load = stack.enter_context(streaming(service.url, seconds + MARGIN_S, *frames))
        async with sockets(service, echo_port) as (touches, echoes):
            if load is not None:
                await asyncio.to_thread(first_line, load)
                await asyncio.sleep(SETTLE_S)
            # The recogniser's busy time and the round trips cover the same seconds.
            started = time.monotonic()
            busy_s = service_status(service)["recogniser"]["busy_s"]
            touch_ms, echo_ms = await alternate(touches, echoes, seconds)
            busy_s = service_status(service)["recogniser"]["busy_s"] - busy_s
            busy = busy_s / (time.monotonic() - started)
        result = None if load is None else await asyncio.to_thread(report_of, load)
    return Row(name, touch_ms, echo_ms, os.getloadavg()[0], result, busy)


async def alternate(
    touches: ClientConnection, echoes: ClientConnection, seconds: float
) -> tuple[list[float], list[float]]:
    """Return round trips of touches and of echoes, ms, in turns at RATE_HZ each."""
    # Each round trip has a due time of its own. A client that sent the next one when the last
    # answer came would send less to a slow service, and miss just the moments that are slow. The
    # echo comes half a period after the touch, so that neither meets the other's work.
    touch_ms: list[float] = []
    echo_ms: list[float] = []
    started = time.perf_counter()
    for number in range(int(seconds * RATE_HZ) + WARM_UP):
        due = started + number / RATE_HZ
        await asyncio.sleep(max(0.0, due - time.perf_counter()))
        data = msgspec.msgpack.encode(touch(number))
        touch_ms.append(await round_trip(touches, data, number + 10))
        await asyncio.sleep(max(0.0, due + 0.5 / RATE_HZ - time.perf_counter()))
        echo_ms.append(await round_trip(echoes, data, number + 10))
    return touch_ms[WARM_UP:], echo_ms[WARM_UP:]


def streaming(
    url: str, seconds: float, scenes: int, rate: float
) -> AbstractContextManager[Process]:
    """Let `scenes` stream at `rate` each from a process of their own."""
    return helper("latency.load", url, rate, seconds, FRAME_BYTES, scenes)


def _table(rows: list[dict[str, Any]]) -> Table:
    columns = ("condition", "n", "touch median / p99", "echo median / p99", "ratio median / p99")
    title = "touch round trip, ms (floor: bare websockets echo of the same bytes)"
    table = Table(*columns, "busy", "load", "frames", title=title)
    for row in rows:
        table.add_row(
            row["condition"],
            str(row["n"]),
            f"{row['touch_median_ms']:.3f} / {row['touch_p99_ms']:.3f}",
            f"{row['echo_median_ms']:.3f} / {row['echo_p99_ms']:.3f}",
            f"{row['median_ratio']:.2f} / {row['p99_ratio']:.2f}",
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
