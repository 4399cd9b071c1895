"""Contact to sound: from a command put in the ring to the first sample at a recorded sink.

Strikes through the audio engine and clicks of a bare audio program take turns on the same null sink
of a private PulseAudio, so that the sound server's own delay is measured beside ours, in the same
run and with the same blocks and priorities: while nothing else happens, and while a service with
three scenes of 80 frames a second keeps its encoder busy. Gaps are runs of exact zeros in what was
recorded of a held slide. The virtual clock and a JACK server's dummy are counted by themselves.
"""

from __future__ import annotations

import json
import os
import random
import subprocess
import time
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from rich.console import Console
from rich.table import Table

from hapticvlm import __version__
from hapticvlm.devices.speaker.engine import AudioSettings
from hapticvlm.devices.speaker.speaker import Speaker
from hapticvlm.rendering.vibration.vibration import RATE_HZ
from hapticvlm_lab.bench.audio import clock, jack
from hapticvlm_lab.bench.audio.click import Clicker, clicker
from hapticvlm_lab.bench.audio.clock import command
from hapticvlm_lab.bench.audio.conditions import load, no_load, raise_priority
from hapticvlm_lab.bench.audio.sink import NAME, Recording, Server, null_sink, recording
from hapticvlm_lab.bench.rigs import priority

BLOCKS = (64, 128, 256, 512)
STRIKE_LEASE_S = 0.03
APART_S = 0.15  # a strike's fade and the longest buffers are over by then
ARRIVES_WITHIN_S = 0.14
SLIDE_S = 5.0
SETTLE_S = 2.0
ROW_S = 60.0  # most that starting and stopping the parts of a row takes
GAP_SAMPLES = 16
GOAL_MS = 10.0


@dataclass(frozen=True, slots=True)
class Plan:
    """What to measure: seconds per row, block sizes, seconds of clock and JACK, priority.

    No seconds, no measurement.
    """

    seconds: float
    blocks: Sequence[int]
    clock_s: float
    jack_s: float
    realtime: bool


@dataclass(frozen=True, slots=True)
class Delays:
    """Delays in ms of those that arrived, and how many did not."""

    delays_ms: NDArray[np.float64]
    missed: int

    def summary(self, name: str) -> dict[str, Any]:
        """Return the figures, None where nothing arrived."""
        some = self.delays_ms.size > 0
        return {
            f"{name}_n": self.delays_ms.size,
            f"{name}_missed": self.missed,
            f"{name}_median_ms": round(float(np.median(self.delays_ms)), 2) if some else None,
            f"{name}_p99_ms": round(float(np.percentile(self.delays_ms, 99)), 2) if some else None,
        }


def run(plan: Plan, *, as_json: bool) -> int:
    """Measure, print a table or JSON. Raises SinkError, DeviceError."""
    console = Console(quiet=as_json, width=150)
    with console.status("virtual clock"):
        ticked = clock.underruns(plan.clock_s, realtime=plan.realtime) if plan.clock_s else None
    with console.status("JACK dummy"):
        dummies = _jack(plan) if plan.jack_s else []
    rows = _sinks(plan, console) if plan.seconds else []
    if rows:
        console.print(_table(rows))
    for line in ([clock.line(ticked)] if ticked else []) + [_jack_line(each) for each in dummies]:
        console.print(line)
    versions = {"hapticvlm": __version__, "cpus": os.cpu_count(), "server": _server_version()}
    if as_json:
        report = {"measure": "speaker", **versions, "rows": rows, "clock": ticked, "jack": dummies}
        print(json.dumps(report))
    return 0


def _sinks(plan: Plan, console: Console) -> list[dict[str, Any]]:
    rows = []
    longest_s = (plan.seconds + SLIDE_S + ROW_S) * len(plan.blocks)
    with null_sink() as server, priority(plan.realtime):
        for name, during in (("idle", no_load), ("encoder flat out", load)):
            with console.status(name), during(longest_s) as busy_s:
                for block in plan.blocks:
                    started = time.monotonic()
                    before = busy_s()
                    row = _row(server, block, plan)
                    busy = (busy_s() - before) / (time.monotonic() - started)
                    rows.append({"condition": name, **row, "recogniser_busy": round(busy, 2)})
    return rows


def _jack(plan: Plan) -> list[dict[str, Any]]:
    return [jack.underruns(plan.jack_s, block, realtime=plan.realtime) for block in plan.blocks]


def _jack_line(found: dict[str, Any]) -> str:
    counts = f"{found['seconds']:.0f} s: {found['underruns']} underruns"
    return f"JACK dummy, blocks of {found['block']}, {counts}"


def late(chunks: Sequence[tuple[float, bytes]], moments: Sequence[float]) -> Delays:
    """Return how long after each moment the first chunk that is not silent arrived.

    A moment at which something still sounded shows nothing and counts as missed.
    """
    arrivals = np.array([arrived for arrived, _ in chunks])
    sounds = np.array([np.frombuffer(data, np.float32).any() for _, data in chunks])
    delays = []
    for moment in moments:
        first = int(np.searchsorted(arrivals, moment, "right"))
        hits = np.flatnonzero(sounds[first:])
        is_clear = first > 0 and not sounds[first - 1] and hits.size > 0
        if is_clear and (delay := arrivals[first + hits[0]] - moment) <= ARRIVES_WITHIN_S:
            delays.append(delay * 1000.0)
    return Delays(np.array(delays), len(moments) - len(delays))


def gaps(samples: NDArray[np.float32]) -> tuple[int, float]:
    """Return how many runs of exact zeros lie within what sounds, and their length in ms."""
    sounding = np.flatnonzero(samples)
    lengths = np.diff(sounding) - 1
    long = lengths[lengths >= GAP_SAMPLES]
    return long.size, float(long.sum() * 1000.0 / RATE_HZ)


def _row(server: Server, block: int, plan: Plan) -> dict[str, Any]:
    speaker = Speaker(AudioSettings(NAME, block, realtime=plan.realtime))
    with clicker(block, plan.realtime) as floor, recording() as recorded:
        speaker.start()
        try:
            raise_priority(plan.realtime, server, recorded)
            time.sleep(SETTLE_S)
            before = speaker.underruns
            strikes, clicks = _alternate(speaker, floor, plan.seconds)
            holes, hole_ms = gaps(_slide(speaker, recorded))
            status = speaker.status()
            underruns = speaker.underruns - before
        finally:
            speaker.close()
    ours = late(recorded.chunks, strikes)
    bare = late(recorded.chunks, clicks)
    row = {"block": block, **ours.summary("touch"), **bare.summary("floor")}
    some = ours.delays_ms.size and bare.delays_ms.size
    beyond = round(row["touch_p99_ms"] - row["floor_p99_ms"], 2) if some else None
    counts: dict[str, Any] = {"underruns": underruns, "gaps": holes, "gaps_ms": round(hole_ms, 1)}
    counts |= {"realtime": status.realtime, "load": round(os.getloadavg()[0], 1)}
    return {**row, "beyond_p99_ms": beyond, **counts}


def _alternate(speaker: Speaker, floor: Clicker, seconds: float) -> tuple[list[float], list[float]]:
    rng = random.Random(0)
    strikes = []
    clicks = []
    ends_at = time.monotonic() + seconds
    while time.monotonic() < ends_at:
        strikes.append(time.monotonic())
        speaker.play(command("strike", len(strikes), STRIKE_LEASE_S))
        time.sleep(APART_S + rng.uniform(0.0, 0.02))
        clicks.append(time.monotonic())
        floor.click()
        time.sleep(APART_S + rng.uniform(0.0, 0.02))
    return strikes, clicks


def _slide(speaker: Speaker, recorded: Recording) -> NDArray[np.float32]:
    """Hold a slide, and return what was recorded of it."""
    begun = len(recorded.chunks)
    ends_at = time.monotonic() + SLIDE_S
    while time.monotonic() < ends_at:
        speaker.play(command("slide", 1, 0.5))
        time.sleep(0.05)
    data = b"".join(chunk for _, chunk in recorded.chunks[begun:])
    return np.frombuffer(data, np.float32)


def _server_version() -> str:
    command = ["pulseaudio", "--version"]
    return subprocess.run(command, capture_output=True, text=True, check=False).stdout.strip()


def _table(rows: list[dict[str, Any]]) -> Table:
    goal = f"goal: {GOAL_MS:.0f} beyond the floor"
    columns = ("condition", "block", "n", "touch median / p99", "floor median / p99")
    further = ("p99 beyond", "missed", "underruns", "gaps", "busy", "load")
    title = f"contact to first sample heard at a null sink, ms ({goal})"
    table = Table(*columns, *further, title=title)
    for row in rows:
        table.add_row(
            *(row["condition"], str(row["block"]), str(row["touch_n"])),
            f"{row['touch_median_ms']} / {row['touch_p99_ms']}",
            f"{row['floor_median_ms']} / {row['floor_p99_ms']}",
            str(row["beyond_p99_ms"]),
            f"{row['touch_missed']}, floor {row['floor_missed']}",
            str(row["underruns"]),
            f"{row['gaps']}, {row['gaps_ms']} ms",
            f"{row['recogniser_busy']:.0%}",
            str(row["load"]),
        )
    return table
