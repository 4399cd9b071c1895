"""`hapticvlm measure marks`: the figures that the project has a mark for, in one table.

Each row is measured on this machine, beside its mark. `--write` puts the table at the head of
FIGURES.md, so that nobody types it by hand.
"""

from __future__ import annotations

import asyncio
import itertools
import json
import os
import time
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from hapticvlm import __version__
from hapticvlm.client.local_service import Service, running
from hapticvlm.errors import UsageError
from hapticvlm.messages import Scene, SceneObject, Touch
from hapticvlm.session.session import SceneSession
from hapticvlm.session.settings import SessionSettings
from hapticvlm_lab.bench.latency.touch import SECONDS, echo, measured
from hapticvlm_lab.bench.rigs import (
    is_priority_permitted,
    least_us,
    priority,
    service_status,
    spent_s,
)

DOCUMENT = Path(__file__).parents[1] / "FIGURES.md"
BEGIN = "<!-- marks: `hapticvlm measure marks --write` writes what stands from here -->"
END = "<!-- to here -->"
REST_S = 5.0
STARTS = 3
MOST_OBJECTS = 8192
ROUNDS = 200


@dataclass(frozen=True, slots=True)
class Mark:
    """One figure: its name, its unit, its greatest permitted value, and its value now."""

    what: str
    unit: str
    most: float
    now: float

    @property
    def is_met(self) -> bool:
        """Whether the figure keeps its mark."""
        return self.now <= self.most


def run(*, write: bool, as_json: bool) -> int:
    """Measure and print a table or JSON. Returns 0 even if a mark is missed: that is a finding."""
    if write and not DOCUMENT.is_file():
        raise UsageError("--write needs FIGURES.md: run this in a checkout")
    marks = list(measure())
    if write:
        text = DOCUMENT.read_text(encoding="utf-8")
        DOCUMENT.write_text(put(text, as_table(marks)), encoding="utf-8")
    if as_json:
        rows = [{**asdict(mark), "met": mark.is_met} for mark in marks]
        print(json.dumps({"measure": "marks", "hapticvlm": __version__, "rows": rows}))
    else:
        print(as_table(marks))
    return 0


def measure() -> Iterator[Mark]:
    """Yield every mark. The machine should be idle otherwise."""
    yield from _latencies()
    yield from _at_rest()
    yield from _of_a_session()


def _latencies() -> Iterator[Mark]:
    """Measure touches in turns with a bare echo, at real-time priority where permitted."""
    realtime = is_priority_permitted()
    arguments = [] if realtime else ["--no-realtime"]
    with priority(realtime), echo(realtime) as port, running(arguments) as service:
        for name, frames_hz in (("idle", 0.0), ("beside 60 frames/s", 60.0)):
            row = asyncio.run(measured(name, service, port, SECONDS, frames_hz)).summary()
            yield Mark(f"touch over a bare echo, {name}: median", "", 1.15, row["median_ratio"])
            yield Mark(f"touch over a bare echo, {name}: p99", "", 1.2, row["p99_ratio"])
        yield Mark(
            "recogniser beside 60 frames/s", "% of a core", 30.0, 100 * row["recogniser_busy"]
        )


def _at_rest() -> Iterator[Mark]:
    """Start the service, and leave it idle."""
    ready: list[float] = []
    while len(ready) < STARTS:
        with running() as service:
            ready.append(service.seconds_to_ready)
            if len(ready) == STARTS:
                yield Mark(f"start until ready, best of {STARTS}", "s", 0.9, min(ready))
                yield from _resting(service)


def _resting(service: Service) -> Iterator[Mark]:
    import psutil

    gateway = psutil.Process(service.process.pid)
    pids = gateway.pid, int(service_status(service)["speaker"]["pid"])
    time.sleep(1.0)
    before = [spent_s(pid) for pid in pids]
    time.sleep(REST_S)
    spent = [(spent_s(pid) - was) / REST_S for pid, was in zip(pids, before, strict=True)]
    yield Mark("gateway at rest", "ms of a core a second", 15.0, 1e3 * spent[0])
    yield Mark("audio engine at rest", "% of a core", 2.0, 100.0 * spent[1])
    family = (gateway, *gateway.children(recursive=True))
    held = sum(each.memory_full_info().uss for each in family) / 2**20
    yield Mark("memory of all processes at rest, their own", "MB", 300.0, held)


def _of_a_session() -> Iterator[Mark]:
    """Change one object of many, and renew a touch, in this process."""
    session = SceneSession(SessionSettings(owner=True))
    many = [SceneObject(object_id=f"o{n}", material="wood") for n in range(MOST_OBJECTS)]
    for begin in range(0, MOST_OBJECTS, 1024):
        part = many[begin : begin + 1024]
        session.receive(Scene(id=1, objects=part, replace=False), 0.0)
    one = itertools.cycle([10.0, 30.0])
    clock = itertools.count(1)

    def change() -> None:
        warmed = SceneObject(object_id="o7", material="metal", temperature_c=next(one))
        session.receive(Scene(id=1, objects=[warmed], replace=False), next(clock) * 1e-3)

    motion: dict[str, Any] = {"hand": "right", "speed_mps": 0.1, "force_n": 1.0}
    slide = Touch(id=2, phase="slide", object_id="o7", captured_at=0.0, **motion)

    def renew() -> None:
        session.receive(slide, next(clock) * 1e-3)

    # A renewal takes a few microseconds, and reading the clock takes one: a hundred are timed at
    # once. So their code and data are in the processor's cache, as the mark means it. After the
    # renewals the changed object is the one under the hand, which costs more than another.
    least = least_us({"renew": renew}, ROUNDS, times=100) | least_us({"change": change}, ROUNDS)
    yield Mark(
        f"changing one of {MOST_OBJECTS} objects", "ms of a core", 0.1, least["change"] / 1e3
    )
    yield Mark("renewing a touch, hot, in the session", "us of a core", 4.0, least["renew"])


def as_table(marks: list[Mark]) -> str:
    """Return the table as Markdown; a figure above its mark is bold."""
    kind = "real-time priority" if is_priority_permitted() else "normal priority"
    rows = ["| measure | mark | now |", "|---|---|---|"]
    for mark in marks:
        now = f"{mark.now:.3g}" if mark.is_met else f"**{mark.now:.3g}**"
        what = f"{mark.what}, {mark.unit}" if mark.unit else mark.what
        rows.append(f"| {what} | {mark.most:g} | {now} |")
    machine = f"version {__version__}, {os.cpu_count()} cores, {kind}"
    head = f"**Marks** (`hapticvlm measure marks`; {machine}; a figure above its mark is bold):"
    return "\n".join((head, "", *rows))


def put(text: str, table: str) -> str:
    """Put the table between its two comments. Raises UsageError if the comments are missing."""
    before, begin, rest = text.partition(BEGIN)
    _, end, after = rest.partition(END)
    if not begin or not end:
        raise UsageError(f"FIGURES.md lacks the comments {BEGIN} and {END}")
    return f"{before}{BEGIN}\n{table}\n{END}{after}"
