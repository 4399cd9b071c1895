"""The conditions of a sound measurement: a busy encoder or none, and who has real-time priority."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from hapticvlm.client.local_service import running
from hapticvlm_lab.bench.audio.sink import Recording, Server
from hapticvlm_lab.bench.rigs import first_line, helper, service_status, set_priority

SERVER_PRIORITY = 25
LOAD = ("80.0", "40000", "3")  # frames/s, bytes a frame, scenes: all that are admitted


@contextmanager
def no_load(seconds: float) -> Iterator[Callable[[], float]]:  # noqa: ARG001 - as `load`
    """Keep nothing busy."""
    yield lambda: 0.0


@contextmanager
def load(seconds: float) -> Iterator[Callable[[], float]]:
    """Keep the encoder of a service busy; what is yielded returns how long it was, s."""
    rate, size, scenes = LOAD
    with (
        running(["--no-realtime"]) as service,
        helper("latency.load", service.url, rate, seconds, size, scenes) as process,
    ):
        first_line(process)
        yield lambda: float(service_status(service)["recogniser"]["busy_s"])


def stolen_s() -> float | None:
    """Return how long the host of a virtual machine has kept its processors from it, s, if known.

    No priority helps against that: to everything within, time just jumps.
    """
    try:
        all_of_them = Path("/proc/stat").read_text(encoding="ascii").splitlines()[0].split()
        return int(all_of_them[8]) / os.sysconf("SC_CLK_TCK")
    except (OSError, IndexError, ValueError):
        return None


def raise_priority(realtime: bool, server: Server, recording: Recording) -> None:
    """Set real-time priority for the sound server and the recorder too, so that we are measured."""
    ids = [process.pid for process in (server.process, recording.process) if process is not None]
    if recording.reader is not None and recording.reader.native_id is not None:
        ids.append(recording.reader.native_id)  # a thread of ours, but it does not inherit priority
    for number in ids if realtime else ():
        set_priority(number, SERVER_PRIORITY)
