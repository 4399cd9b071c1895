"""How much slower this machine is than the one that the tests' waits were chosen on.

A wait is for something that comes: it fails a test only when nothing comes at all, and costs
nothing otherwise. On a slow machine, or one that others use too, everything comes later, so every
such wait is multiplied by `PACE`. It is measured once a run, before the first test, with all cores
computing at once, and handed to every worker: never below 1, and at most 8, so that a test which
hangs still ends. How often something must at least have come is divided by it. What a test
*claims* about time (a limit of the product, a mark) is never multiplied.
"""

from __future__ import annotations

import os
import subprocess
import sys
import time
from collections.abc import Callable
from typing import TypeVar

REFERENCE_S = 0.3  # of `_WORK` on two quiet cores of the machine where the waits were chosen
SLOWEST = 8.0
VARIABLE = "HAPTICVLM_TEST_PACE"
T = TypeVar("T")
_WORK = "sum(n * n for n in range(6_000_000))"


def measure() -> float:
    """Return how much slower this machine computes than the reference, on all cores at once."""
    command = [sys.executable, "-c", _WORK]
    started = time.perf_counter()
    running = [subprocess.Popen(command) for _ in range(os.cpu_count() or 1)]
    for process in running:
        process.wait()
    return min(max((time.perf_counter() - started) / REFERENCE_S, 1.0), SLOWEST)


def measured_once() -> float:
    """Return the pace that this run's first process measured."""
    if VARIABLE not in os.environ:
        os.environ[VARIABLE] = str(measure())
    return float(os.environ[VARIABLE])


PACE = measured_once()


def until(claim: Callable[[], T | None], seconds: float = 60.0 * PACE) -> T:
    """Wait until the claim holds, and return what it returned; fail if it does not in time."""
    gives_up_at = time.monotonic() + seconds
    while not (value := claim()):
        assert time.monotonic() < gives_up_at, "it never happened"
        time.sleep(0.01)
    return value
