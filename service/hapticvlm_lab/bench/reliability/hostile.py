"""Touch round trips beside one hostile client of each kind, with a bare echo in turns.

The echo is another process that nobody attacks: what it is late by is the machine's.
"""

from __future__ import annotations

import asyncio
import json
import os
import subprocess
import sys
import time
from typing import Any

import numpy as np
from rich.console import Console
from rich.table import Table
from websockets.asyncio.client import connect as open_socket

from hapticvlm import __version__
from hapticvlm.commands.local_service import Service, running
from hapticvlm_lab.bench.latency.round_trip import (
    echo,
    introduce,
    is_priority_permitted,
    priority,
)
from hapticvlm_lab.bench.latency.touch import alternate
from hapticvlm_lab.bench.reliability.floods import KINDS

MARK_MS = 10.0
NOBODY = "nobody"
MARGIN_S = 30.0


def run(*, seconds: float, as_json: bool) -> int:
    """Measure, print a table or JSON; 1 if a p99 is above the mark."""
    console = Console(quiet=as_json, width=120)
    realtime = is_priority_permitted()
    rows = []
    with priority(realtime), echo(realtime) as port, running() as service:
        for kind in (NOBODY, *KINDS):
            with console.status(kind):
                rows.append(asyncio.run(_row(kind, service, port, seconds)))
            print(json.dumps(rows[-1]), file=sys.stderr, flush=True)
    console.print(_table(rows))
    report = {"measure": "hostile", "hapticvlm": __version__, "realtime": realtime, "rows": rows}
    if as_json:
        print(json.dumps(report))
    return int(max(row["touch_ms"]["p99"] for row in rows) > MARK_MS)


async def _row(kind: str, service: Service, echo_port: int, seconds: float) -> dict[str, Any]:
    plain: dict[str, Any] = {"compression": None, "proxy": None, "ping_interval": None}
    async with (
        open_socket(service.url, **plain) as touches,
        open_socket(f"ws://127.0.0.1:{echo_port}/", **plain) as echoes,
    ):
        await introduce(touches)
        attacker = None if kind == NOBODY else await _attack(service.url, kind, seconds)
        started, used = time.monotonic(), _processor_s(service)
        try:
            touch_ms, echo_ms = await alternate(touches, echoes, seconds)
            cores = (_processor_s(service) - used) / (time.monotonic() - started)
        finally:
            if attacker is not None and attacker.returncode is None:
                attacker.kill()
                await attacker.wait()
    return {
        "hostile": kind,
        "touch_ms": _spread(touch_ms),
        "echo_ms": _spread(echo_ms),
        "gateway_cores": round(cores, 2),
        "load": round(os.getloadavg()[0], 1),
    }


async def _attack(url: str, kind: str, seconds: float) -> asyncio.subprocess.Process:
    module = "hapticvlm_lab.bench.reliability.floods"
    attacker = await asyncio.create_subprocess_exec(
        *(sys.executable, "-m", module, url, kind, str(seconds + MARGIN_S)),
        stdout=subprocess.PIPE,
    )
    assert attacker.stdout is not None
    await attacker.stdout.readline()
    return attacker


def _processor_s(service: Service) -> float:
    import psutil

    times = psutil.Process(service.process.pid).cpu_times()
    return float(times.user + times.system)


def _spread(values: list[float]) -> dict[str, float]:
    median, p99 = np.percentile(values, (50, 99))
    figures = {"median": median, "p99": p99, "max": max(values)}
    return {"n": len(values), **{name: round(float(each), 2) for name, each in figures.items()}}


def _table(rows: list[dict[str, Any]]) -> Table:
    table = Table(title="beside one hostile client, ms (median / p99 / longest)")
    for column in ("hostile client sends", "n", "touch", "bare echo", "gateway, cores", "load"):
        table.add_column(column)
    for row in rows:
        cells = (row[name] for name in ("touch_ms", "echo_ms"))
        times = [f"{each['median']} / {each['p99']} / {each['max']}" for each in cells]
        cores, load = str(row["gateway_cores"]), str(row["load"])
        table.add_row(row["hostile"], str(row["touch_ms"]["n"]), *times, cores, load)
    return table
