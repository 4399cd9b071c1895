"""Tools that several rigs share: helper processes, priorities, times and their summaries."""

from __future__ import annotations

import json
import math
import os
import subprocess
import sys
import time
import urllib.request
from collections.abc import Callable, Hashable, Iterator, Mapping
from contextlib import contextmanager
from typing import Any, TypeVar

from hapticvlm.client.local_service import Service

OUR_PRIORITY = 5

K = TypeVar("K", bound=Hashable)

Process = subprocess.Popen[str]


@contextmanager
def helper(module: str, *arguments: object) -> Iterator[Process]:
    """Run a module of `bench/` in its own process for as long as the context lasts."""
    command = [sys.executable, "-m", f"hapticvlm_lab.bench.{module}", *map(str, arguments)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        try:
            yield process
        finally:
            process.kill()


def first_line(process: Process) -> str:
    """Wait for the line that a helper prints when it is ready; empty if it ended instead."""
    assert process.stdout is not None
    return process.stdout.readline().strip()


@contextmanager
def priority(realtime: bool) -> Iterator[None]:
    """Give this process real-time priority where permitted; its children start without it."""
    if not (realtime and _is_raised()):
        yield
        return
    try:
        yield
    finally:
        os.sched_setscheduler(0, os.SCHED_OTHER, os.sched_param(0))


def _is_raised() -> bool:
    """Give this process real-time priority; return whether that is permitted."""
    if not hasattr(os, "sched_setscheduler"):
        return False
    try:
        # FIFO: runs before every process of normal priority, and is not interrupted after a time
        # slice. Reset on fork: a child that computes without end must not inherit that.
        flags = os.SCHED_FIFO | os.SCHED_RESET_ON_FORK
        os.sched_setscheduler(0, flags, os.sched_param(OUR_PRIORITY))
    except OSError:
        return False
    return True


def is_priority_permitted() -> bool:
    """Return whether this system permits real-time priority."""
    is_permitted = _is_raised()
    if is_permitted:
        os.sched_setscheduler(0, os.SCHED_OTHER, os.sched_param(0))
    return is_permitted


def service_status(service: Service) -> dict[str, Any]:
    """Return the service's page `/status`."""
    with urllib.request.urlopen(service.page + "status", timeout=5) as answer:
        status: dict[str, Any] = json.load(answer)
    return status


def spent_s(pid: int) -> float:
    """Return the processor time that a process has used so far, s, in the system's steps."""
    import psutil

    spent = psutil.Process(pid).cpu_times()
    return float(spent.user + spent.system)


def core_us(work: Callable[[], object], times: int = 1) -> float:
    """Return the time of this process's core for one call, us."""
    begun = time.process_time_ns()
    for _ in range(times):
        work()
    return (time.process_time_ns() - begun) / 1e3 / times


def least_us(
    works: Mapping[K, Callable[[], object]], rounds: int, times: int = 1
) -> dict[K, float]:
    """Return the least time of this process's core for one call of each, us.

    The least of many rounds is the time without disturbance: other work only ever adds. All take
    turns, round by round, so that a machine that slows down slows all of them.
    """
    least = dict.fromkeys(works, math.inf)
    for work in works.values():
        work()
    for _ in range(rounds):
        for key, work in works.items():
            least[key] = min(least[key], core_us(work, times))
    return least
