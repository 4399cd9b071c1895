"""The conditions of a sound measurement: a busy encoder or none, and who has real-time priority."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import urllib.request
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from hapticvlm.commands.local_service import Service, running
from hapticvlm_lab.bench.audio.sink import Recording, Server

OUR_PRIORITY, SERVER_PRIORITY = 5, 25
LOAD = ("80.0", "40000", "3")  # frames/s, bytes a frame, scenes: all that are admitted


@contextmanager
def no_load(seconds: float) -> Iterator[Callable[[], float]]:  # noqa: ARG001 - as `load`
    """Keep nothing busy."""
    yield lambda: 0.0


@contextmanager
def load(seconds: float) -> Iterator[Callable[[], float]]:
    """Keep the encoder of a service busy; what is yielded returns how long it was, s."""
    rate, size, scenes = LOAD
    for_s = str(seconds)
    with running(["--no-realtime"]) as service:
        command = [
            sys.executable,
            "-m",
            "hapticvlm_lab.bench.latency.load",
            service.url,
            rate,
            for_s,
            size,
        ]
        with subprocess.Popen([*command, scenes], stdout=subprocess.PIPE, text=True) as process:
            assert process.stdout is not None
            try:
                process.stdout.readline()
                yield lambda: _busy_s(service)
            finally:
                process.kill()


def _busy_s(service: Service) -> float:
    with urllib.request.urlopen(service.page + "status", timeout=5) as answer:
        return float(json.load(answer)["recogniser"]["busy_s"])


@contextmanager
def priority(realtime: bool) -> Iterator[None]:
    """Set real-time priority for this process where permitted; its children start without."""
    if not (realtime and _set_priority(0, OUR_PRIORITY)):
        yield
        return
    try:
        yield
    finally:
        os.sched_setscheduler(0, os.SCHED_OTHER, os.sched_param(0))


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
        _set_priority(number, SERVER_PRIORITY)


def _set_priority(pid: int, priority: int) -> bool:
    if not hasattr(os, "sched_setscheduler"):
        return False
    try:
        flags = os.SCHED_FIFO | os.SCHED_RESET_ON_FORK
        os.sched_setscheduler(pid, flags, os.sched_param(priority))
    except OSError:
        return False
    return True
