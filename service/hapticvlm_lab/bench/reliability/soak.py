"""An hour of everything at once: whether memory grows, and whether touches are as fast at the end.

An owner that touches, in turns with a bare echo; a scene that streams frames; an observer that
reads and one that never does; a hostile client of each kind in turn; a child killed now and then.
Memory is what each process holds for itself alone (USS), so that shared pages count for none.
"""

from __future__ import annotations

import asyncio
import contextlib
import itertools
import json
import os
import signal
import time
from dataclasses import dataclass, field
from typing import Any

import msgpack
import numpy as np
from rich.console import Console
from scipy import stats
from websockets.asyncio.client import ClientConnection
from websockets.asyncio.client import connect as open_socket

from hapticvlm import __version__
from hapticvlm.client import connect
from hapticvlm.client.connection import Client
from hapticvlm.client.local_service import Service, running
from hapticvlm_lab.bench.latency.round_trip import echo, round_trip, sockets, touch
from hapticvlm_lab.bench.rigs import helper, report_of, service_status, spread

RATE_HZ = 20.0
FRAME_RATE_HZ = 10.0
FRAME_BYTES = 40_000
SAMPLE_S = 10.0
KILL_S = 600.0  # a child each time, in turn
CHILDREN = ("speaker", "recogniser")  # of the service, as its status names them
LEAST = 30  # samples of a process after its warm-up, for a slope
# of an hour; shorter soaks have their share of them
WARM_UP_S = 600.0
WINDOW_S = 300.0
END_S = 1.0  # after the last lease


@dataclass(slots=True)
class Soak:
    """What was measured so far: (seconds since the start, figure) each."""

    started: float
    touches: list[tuple[float, float]] = field(default_factory=list)
    echoes: list[tuple[float, float]] = field(default_factory=list)
    memory_mb: dict[str, list[tuple[float, float]]] = field(default_factory=dict)
    files: list[int] = field(default_factory=list)
    threads: list[int] = field(default_factory=list)
    loads: list[tuple[float, float]] = field(default_factory=list)
    killed: list[str] = field(default_factory=list)

    @property
    def now(self) -> float:
        """Seconds since the start."""
        return time.monotonic() - self.started

    def sample(self, service: Service) -> None:
        """Note memory of each process, descriptors, threads, and the machine's load."""
        import psutil

        self.loads.append((self.now, os.getloadavg()[0]))
        gateway = psutil.Process(service.process.pid)
        found = service_status(service)
        pids = {"gateway": gateway.pid}
        pids |= {f"{part} {pid}": pid for part in CHILDREN if (pid := found[part]["pid"])}
        for name, pid in pids.items():
            with contextlib.suppress(psutil.Error):
                size = psutil.Process(pid).memory_full_info().uss / 2**20
                self.memory_mb.setdefault(name, []).append((self.now, size))
        with contextlib.suppress(psutil.Error):
            self.files.append(gateway.num_fds())
            self.threads.append(gateway.num_threads())


def run(*, minutes: float, as_json: bool) -> int:
    """Soak, print the figures and, last, one JSON object; 1 when an output is not at rest."""
    console = Console(quiet=as_json)
    seconds = minutes * 60.0
    with echo(realtime=False) as port, running() as service:
        left_s = max(1.0, seconds - 2.0)
        frames = (FRAME_RATE_HZ, FRAME_BYTES)
        with (
            console.status(f"{minutes:g} minutes"),
            helper("latency.load", service.url, frames[0], left_s, frames[1]) as load,
            helper("reliability.floods", service.url, "all", left_s) as flood,
        ):
            soak = asyncio.run(_soak(service, port, seconds))
            reports = [report_of(each) for each in (load, flood)]
        time.sleep(END_S)
        found = service_status(service)
        tracebacks = [line for line in service.printed if "Traceback" in line]
    result = {
        "measure": "soak",
        "hapticvlm": __version__,
        "minutes": minutes,
        "load": round(os.getloadavg()[0], 1),
        **summary(soak, seconds),
        "frames": reports[0],
        "hostile": reports[1],
        "owner_left_at_rest": not found["leases"] and found["speaker"]["level"] == 0.0,
        "lost_commands": found["speaker"]["lost_commands"],
        "tracebacks": len(tracebacks),
        "counts": found["counts"],
    }
    if as_json:
        print(json.dumps(result))
    for name, value in result.items():
        console.print(f"{name:<20} {value}", highlight=False)
    return 0 if result["owner_left_at_rest"] and not tracebacks else 1


def summary(soak: Soak, seconds: float) -> dict[str, Any]:
    """Return round trips at both ends, and how memory grew after the first minutes."""
    warm_up_s = min(WARM_UP_S, seconds / 6)
    window_s = min(WINDOW_S, seconds / 12)
    first = (0.0, window_s)
    last = (seconds - window_s, float("inf"))
    windows = {
        name: {
            "touch": _spread(soak.touches, *span),
            "echo": _spread(soak.echoes, *span),
            "load": _spread(soak.loads, *span),
        }
        for name, span in {"first": first, "last": last, "all": (0.0, float("inf"))}.items()
    }
    return {
        "window_s": window_s,
        "round_trip_ms": windows,
        "warm_up_s": warm_up_s,
        "memory": {
            name: growth
            for name, held in soak.memory_mb.items()
            if (growth := _growth(held, warm_up_s))
        },
        "descriptors": [soak.files[0], soak.files[-1], max(soak.files)],
        "threads": [soak.threads[0], soak.threads[-1], max(soak.threads)],
        "killed": len(soak.killed),
    }


def _spread(found: list[tuple[float, float]], begin: float, end: float) -> dict[str, float]:
    return spread([value for at, value in found if begin <= at < end])


def _growth(held: list[tuple[float, float]], warm_up_s: float) -> dict[str, Any] | None:
    """Return first and last size, MB, and the slope after warming up (Theil-Sen, 95 %), MB/h.

    A process that was killed before LEAST samples of its own after the warm-up has none.
    """
    warm = [each for each in held if each[0] >= held[0][0] + warm_up_s]
    if len(warm) < LEAST:
        return None
    hours, sizes = np.array(warm).T
    slope, _, low, high = stats.theilslopes(sizes, hours / 3600.0)
    return {
        "first_mb": round(held[0][1], 1),
        "warm_mb": round(float(sizes[0]), 1),
        "last_mb": round(float(sizes[-1]), 1),
        "slope_mb_per_h": [round(float(each), 2) for each in (slope, low, high)],
    }


async def _soak(service: Service, echo_port: int, seconds: float) -> Soak:
    soak = Soak(time.monotonic())
    async with (
        sockets(service, echo_port) as (touches, echoes),
        connect(service.url, name="reads", role="observer") as reads,
    ):
        await reads.request("set", watch=["frames", "waveform", "log"])
        meanwhile = [
            asyncio.create_task(_read_events(reads)),
            asyncio.create_task(_never_read(service.url)),
            asyncio.create_task(_sample(service, soak)),
            asyncio.create_task(_kill(service, soak)),
        ]
        try:
            await _touch(touches, echoes, soak, seconds)
        finally:
            for task in meanwhile:
                task.cancel()
            await asyncio.gather(*meanwhile, return_exceptions=True)
    return soak


async def _touch(
    touches: ClientConnection, echoes: ClientConnection, soak: Soak, seconds: float
) -> None:
    for number in itertools.count():
        due = number / RATE_HZ
        if due >= seconds:
            return
        await asyncio.sleep(max(0.0, due - soak.now))
        data = msgpack.packb(touch(number))
        soak.touches.append((soak.now, await round_trip(touches, data, number + 10)))
        await asyncio.sleep(max(0.0, due + 0.5 / RATE_HZ - soak.now))
        soak.echoes.append((soak.now, await round_trip(echoes, data, number + 10)))


async def _read_events(observer: Client) -> None:
    while True:
        await observer.events.get()


async def _never_read(url: str) -> None:
    """Ask to see everything and take nothing of it; come back when given up."""
    client = {"name": "never reads", "version": "1"}
    protocol = {"major": 1, "minor": 0}
    hello = {"type": "hello", "id": 1, "client": client, "protocol": protocol, "role": "observer"}
    watch = {"type": "set", "id": 2, "watch": ["frames", "waveform", "log"]}
    while True:
        with contextlib.suppress(OSError):
            async with open_socket(url, compression=None, proxy=None, ping_interval=None) as socket:
                for message in (hello, watch):
                    await socket.send(msgpack.packb(message))
                await socket.wait_closed()
        await asyncio.sleep(1.0)


async def _sample(service: Service, soak: Soak) -> None:
    while True:
        await asyncio.to_thread(soak.sample, service)
        await asyncio.sleep(SAMPLE_S)


async def _kill(service: Service, soak: Soak) -> None:
    for part in itertools.cycle(CHILDREN):
        await asyncio.sleep(KILL_S)
        found = await asyncio.to_thread(service_status, service)
        with contextlib.suppress(OSError, TypeError):
            os.kill(found[part]["pid"], signal.SIGKILL)
            soak.killed.append(part)
