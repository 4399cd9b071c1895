"""`hapticvlm stability latency`: the amount of other work that makes a touch late.

Programs that compute without end, at normal priority, run beside the service: none, as many as
there are cores, and two, four and eight times as many. Beside them either nobody streams, or one
scene streams 60 frames a second. Service, echo and client all have normal or all have real-time
priority. A bare echo of the same bytes takes turns with the touches and shows the share of the
delay that the machine imposes on any program.
"""

from __future__ import annotations

import asyncio
import os
import subprocess
import sys
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from hapticvlm.client.local_service import running
from hapticvlm.commands.progress import track
from hapticvlm.palette import BLUE, SOFT, VERMILION
from hapticvlm_lab.bench import figures
from hapticvlm_lab.bench.latency.touch import echo, measured
from hapticvlm_lab.bench.printing import publish
from hapticvlm_lab.bench.rigs import is_priority_permitted, priority

if TYPE_CHECKING:
    from matplotlib.axes import Axes

NAME = "stability-latency"
SECONDS = 6.0
PER_CORE = (0, 1, 2, 4, 8)  # programs that compute without end
STREAMS_HZ = {"no frames": 0.0, "60 frames/s": 60.0}
# Our choice: a blow that is felt within this time still belongs to the picture of it. It bounds the
# round trip of a touch alone; a speaker and its driver come on top.
LATE_MS = 10.0
SETTLE_S = 1.0
SIZE_IN = (10.0, 4.2)
COLOURS = {"no frames": BLUE, "60 frames/s": VERMILION}


def run(out: Path, *, as_json: bool) -> int:
    """Measure every condition, print a table or JSON, write picture and JSON."""
    rows = measure()
    files = _draw(out / NAME, rows)
    result = {"stability": "latency", "cpus": os.cpu_count(), "late_ms": LATE_MS, "rows": rows}
    return publish(out / NAME, result, files, as_json=as_json, show=lambda: _print(rows))


def measure() -> list[dict[str, Any]]:
    """Return the figures of every condition."""
    cores = os.cpu_count() or 1
    kinds = (False, True) if is_priority_permitted() else (False,)
    conditions = [(kind, busy * cores) for kind in kinds for busy in PER_CORE]
    rows = []
    for realtime, busy in track(conditions, "touching beside other work"):
        arguments = [] if realtime else ["--no-realtime"]
        with priority(realtime), echo(realtime) as port, running(arguments) as service:
            for stream, frames_hz in STREAMS_HZ.items():
                with _burning(busy):
                    row = asyncio.run(measured(stream, service, port, SECONDS, frames_hz)).summary()
                kind = "real-time" if realtime else "normal"
                rows.append({"priority": kind, "busy": busy, "stream": stream, **row})
    return rows


@contextmanager
def _burning(count: int) -> Iterator[None]:
    """Run this many programs that compute without end, at normal priority."""
    # The scheduler gives each of them its share of a core; with more of them than cores, a process
    # of normal priority that wakes up has to wait for the end of somebody's time slice.
    command = [sys.executable, "-c", "while True: pass"]
    programs = [subprocess.Popen(command) for _ in range(count)]
    try:
        time.sleep(SETTLE_S if count else 0.0)
        yield
    finally:
        for program in programs:
            program.kill()
            program.wait()


def breaks_at(rows: Sequence[dict[str, Any]], kind: str, stream: str) -> int | None:
    """Return the least number of programs beside which p99 is late; None if it never is."""
    late = [
        row["busy"]
        for row in rows
        if (row["priority"], row["stream"]) == (kind, stream) and row["touch_p99_ms"] > LATE_MS
    ]
    return min(late, default=None)


def _print(rows: Sequence[dict[str, Any]]) -> None:
    columns = f"{'priority':<10} {'busy':>4} {'frames':<12} {'touch, ms':>14} {'echo, ms':>14}"
    print(f"{columns}  verdict")
    for row in rows:
        touch = f"{row['touch_median_ms']:.2f} / {row['touch_p99_ms']:.2f}"
        floor = f"{row['echo_median_ms']:.2f} / {row['echo_p99_ms']:.2f}"
        verdict = "breaks" if row["touch_p99_ms"] > LATE_MS else "holds"
        start = f"{row['priority']:<10} {row['busy']:>4} {row['stream']:<12}"
        print(f"{start} {touch:>14} {floor:>14}  {verdict}")
    for kind in dict.fromkeys(row["priority"] for row in rows):
        for stream in STREAMS_HZ:
            breaking = breaks_at(rows, kind, stream)
            where = "never here" if breaking is None else f"beside {breaking} busy programs"
            print(f"{kind}, {stream}: p99 above {LATE_MS:g} ms {where}")


def _draw(stem: Path, rows: Sequence[dict[str, Any]]) -> list[Path]:
    kinds = list(dict.fromkeys(row["priority"] for row in rows))
    with figures.figure(stem, SIZE_IN, len(kinds), sharey=True) as (drawn, panels):
        figures.title(drawn, "a touch's round trip beside other work: median (thin), p99 (thick)")
        for axes, kind in zip(panels, kinds, strict=True):
            _panel(axes, kind, [row for row in rows if row["priority"] == kind])
    return figures.files(stem)


def _panel(axes: Axes, kind: str, rows: Sequence[dict[str, Any]]) -> None:
    for stream, colour in COLOURS.items():
        of_it = [row for row in rows if row["stream"] == stream]
        busy = [row["busy"] for row in of_it]
        for what, style in (("touch", "-"), ("echo", ":")):
            for part, width in (("median", 0.9), ("p99", 2.2)):
                values = [row[f"{what}_{part}_ms"] for row in of_it]
                label = f"{what}, {stream}" if part == "p99" else None
                axes.plot(busy, values, style, color=colour, linewidth=width, label=label)
    figures.level(axes, LATE_MS, "late, our choice", align="left")
    axes.axvline(os.cpu_count() or 1, color=SOFT, linewidth=0.8, linestyle=":")
    axes.set(title=f"{kind} priority", xlabel="programs that compute without end", ylabel="ms")
    axes.set_yscale("log")
    axes.legend(frameon=False)
