"""Duration of each turn of the gateway's loop, beside touches and 60 frames a second.

An event loop runs one callback at a time, and whatever arrives meanwhile waits for its end; so one
touch in a hundred meets the longest kind of turn. A turn is timed by the processor time of the
loop's thread: a callback is not to blame for the time that other processes keep the thread waiting.
Callbacks that run only at the start and at the end are left out. The floor is all that a bare
echo's loop does for one message of the same bytes, in turns with the touches of the same run.
"""

from __future__ import annotations

import asyncio
import json
from collections import defaultdict
from dataclasses import asdict, dataclass

import numpy as np
from rich.console import Console
from rich.table import Table

from hapticvlm import __version__
from hapticvlm.client.local_service import running
from hapticvlm_lab.bench.latency.timed_loop import Turns
from hapticvlm_lab.bench.latency.touch import LOADS, measured
from hapticvlm_lab.bench.rigs import first_line, helper, report_of

MODULE = "hapticvlm_lab.bench.latency.timed_service"
LOAD = "60 frames/s"
WARM_UP = 0.1  # of the turns of each kind
LEAST_HZ = 5.0  # a rarer callback does not belong to the steady state


@dataclass(frozen=True, slots=True)
class Turn:
    """One kind of turn: the number of times it ran, and its duration, us."""

    what: str
    n: int
    median_us: float
    p99_us: float
    longest_us: float


@dataclass(frozen=True, slots=True)
class TurnTimes:
    """Every kind of turn of the gateway, the longest at p99 first, and the floor."""

    turns: list[Turn]
    echo: Turn


def run(*, seconds: float, as_json: bool) -> int:
    """Measure and print a table, longest first, or JSON."""
    console = Console(quiet=as_json, width=120)
    with console.status(f"{LOAD} beside touches: {seconds:.0f} s"):
        figures_found = measure(seconds)
    console.print(_table(figures_found))
    if as_json:
        rows = [asdict(turn) for turn in figures_found.turns]
        figures = {"rows": rows, "floor": asdict(figures_found.echo)}
        print(json.dumps({"measure": "turns", "hapticvlm": __version__, **figures}))
    return 0


def measure(seconds: float) -> TurnTimes:
    """Measure while touches, echoes and frames run."""
    with (
        helper("latency.echo", "timed") as echoing,
        running(["--no-realtime"], module=MODULE) as service,
    ):
        port = int(first_line(echoing))
        asyncio.run(measured(LOAD, service, port, seconds, LOADS[LOAD]))
        echoed: Turns = report_of(echoing)["turns"]
    last = next(line for line in reversed(service.printed) if line.startswith('{"turns"'))
    took = by_kind(json.loads(last)["turns"]).items()
    turns = [_turn(what, us) for what, us in took if len(us) >= LEAST_HZ * seconds]
    turns.sort(key=lambda turn: -turn.p99_us)
    return TurnTimes(turns, _turn("a bare echo, read and answered", by_message(echoed)))


def by_kind(turns: Turns) -> dict[str, list[float]]:
    """Return the durations of each kind of turn, us."""
    kinds: dict[str, list[float]] = defaultdict(list)
    for what, us in turns:
        kinds[what].append(us)
    return kinds


def by_message(turns: Turns) -> list[float]:
    """Return the duration of each read together with all turns until the next read, us."""
    # A bare echo answers within one read and a few short callbacks after it. All of them delay the
    # next message, so they count as one.
    messages: list[float] = []
    for what, us in turns:
        if what.endswith(" reads"):
            messages.append(us)
        elif messages:
            messages[-1] += us
    return messages


def _turn(what: str, took_us: list[float]) -> Turn:
    # The first turns fill the caches of processor and interpreter, and are several times as long.
    steady = np.array(took_us[int(len(took_us) * WARM_UP) :])
    median, p99, longest = (round(float(us), 1) for us in np.percentile(steady, (50, 99, 100)))
    return Turn(what, len(steady), median, p99, longest)


def _table(result: TurnTimes) -> Table:
    title = f"turns of the gateway's loop beside touches and {LOAD}, us of processor time"
    table = Table("callback", "n", "median", "p99", "longest", title=title)
    for turn in result.turns:
        table.add_row(*_figures(turn))
    table.add_section()
    table.add_row(*_figures(result.echo))
    return table


def _figures(turn: Turn) -> tuple[str, ...]:
    took = (turn.median_us, turn.p99_us, turn.longest_us)
    return turn.what, str(turn.n), *(f"{us:.0f}" for us in took)
