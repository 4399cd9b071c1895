"""How long each turn of the gateway's loop holds it, beside touches and 60 frames a second.

What comes while a callback runs waits for its end, so the dearest kind of turn is what a touch in
a hundred meets. A turn is timed by the processor time of the loop's thread: how long other
processes kept it waiting is no fault of the callback. What runs only at the start and at the end
is left out.
"""

from __future__ import annotations

import asyncio
import json
from dataclasses import asdict, dataclass

import numpy as np
from rich.console import Console
from rich.table import Table

from hapticvlm import __version__
from hapticvlm.client.local_service import Service, running
from hapticvlm_lab.bench.latency.round_trip import echo
from hapticvlm_lab.bench.latency.touch import LOADS, measured

MODULE = "hapticvlm_lab.bench.latency.timed_service"
LOAD = "60 frames/s"
WARM_UP = 0.1  # of the turns of each kind
LEAST_HZ = 5.0  # what runs more seldom is no part of the steady state


@dataclass(frozen=True, slots=True)
class Turn:
    """One kind of turn: how often it ran, and how long it took, us."""

    what: str
    n: int
    median_us: float
    p99_us: float
    longest_us: float


def run(*, seconds: float, as_json: bool) -> int:
    """Measure and print a table, dearest first, or JSON."""
    console = Console(quiet=as_json, width=120)
    with console.status(f"{LOAD} beside touches: {seconds:.0f} s"):
        turns = measure(seconds)
    console.print(_table(turns))
    if as_json:
        rows = [asdict(turn) for turn in turns]
        print(json.dumps({"measure": "turns", "hapticvlm": __version__, "rows": rows}))
    return 0


def measure(seconds: float) -> list[Turn]:
    """Return every kind of turn beside touches and frames, the dearest at p99 first."""
    with echo(realtime=False) as port, running(["--no-realtime"], module=MODULE) as service:
        asyncio.run(measured(LOAD, service, port, seconds, LOADS[LOAD]))
    took = _told(service).items()
    found = [_turn(what, us) for what, us in took if len(us) >= LEAST_HZ * seconds]
    return sorted(found, key=lambda turn: -turn.p99_us)


def _told(service: Service) -> dict[str, list[float]]:
    """Return what the service printed at its end, us of each turn by what ran."""
    last = next(line for line in reversed(service.printed) if line.startswith('{"turns"'))
    turns: dict[str, list[float]] = json.loads(last)["turns"]
    return turns


def _turn(what: str, took_us: list[float]) -> Turn:
    steady = np.array(took_us[int(len(took_us) * WARM_UP) :])
    median, p99, longest = (round(float(us), 1) for us in np.percentile(steady, (50, 99, 100)))
    return Turn(what, len(steady), median, p99, longest)


def _table(turns: list[Turn]) -> Table:
    title = f"turns of the gateway's loop beside touches and {LOAD}, us of processor time"
    table = Table("what runs", "n", "median", "p99", "longest", title=title)
    for turn in turns:
        figures = (turn.median_us, turn.p99_us, turn.longest_us)
        table.add_row(turn.what, str(turn.n), *(f"{us:.0f}" for us in figures))
    return table
