"""Touch round trips beside one hostile client of each kind, with a bare echo in turns.

The echo is another process that nobody attacks: what it is late by is the machine's.
"""

from __future__ import annotations

import asyncio
import json
import os
import sys
import time
from contextlib import ExitStack
from typing import Any

from rich.console import Console
from rich.table import Table

from hapticvlm import __version__
from hapticvlm.client.local_service import Service, running
from hapticvlm_lab.bench.latency.round_trip import echo, sockets
from hapticvlm_lab.bench.latency.touch import alternate
from hapticvlm_lab.bench.reliability.floods import KINDS
from hapticvlm_lab.bench.rigs import (
    first_line,
    helper,
    is_priority_permitted,
    priority,
    spent_s,
    spread,
)

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
    with ExitStack() as stack:
        async with sockets(service, echo_port) as (touches, echoes):
            if kind != NOBODY:
                flood = helper("reliability.floods", service.url, kind, seconds + MARGIN_S)
                await asyncio.to_thread(first_line, stack.enter_context(flood))
            started = time.monotonic()
            used = spent_s(service.process.pid)
            touch_ms, echo_ms = await alternate(touches, echoes, seconds)
            cores = (spent_s(service.process.pid) - used) / (time.monotonic() - started)
    return {
        "hostile": kind,
        "touch_ms": spread(touch_ms),
        "echo_ms": spread(echo_ms),
        "gateway_cores": round(cores, 2),
        "load": round(os.getloadavg()[0], 1),
    }


def _table(rows: list[dict[str, Any]]) -> Table:
    columns = ("hostile client sends", "n", "touch", "bare echo", "gateway, cores", "load")
    table = Table(*columns, title="beside one hostile client, ms (median / p99 / longest)")
    for row in rows:
        cells = (row[name] for name in ("touch_ms", "echo_ms"))
        times = [f"{each['median']} / {each['p99']} / {each['max']}" for each in cells]
        cores = str(row["gateway_cores"])
        load = str(row["load"])
        table.add_row(row["hostile"], str(row["touch_ms"]["n"]), *times, cores, load)
    return table
