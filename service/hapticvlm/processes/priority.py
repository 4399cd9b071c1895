"""Who goes first: audio blocks and the serial line in real time, a model that computes last."""

from __future__ import annotations

import os
from contextlib import suppress

FIFO_PRIORITY = 20


def request_priority(priority: int = FIFO_PRIORITY) -> bool:
    """Ask for real-time priority for the calling thread; return whether it was permitted."""
    if not hasattr(os, "sched_setscheduler"):
        return False
    try:
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(priority))
    except OSError:
        return False
    return True


def lower_priority(nice: int) -> None:
    """Let this process, which only computes, go behind the audio engine and the gateway.

    It leaves the real-time priority that a child inherits. On Linux it also becomes a batch
    process: one that is woken never puts another aside. The gateway wakes a model in the middle of
    a turn of its loop, whenever it hands a frame over; put aside there, it let every hundredth
    touch wait 3 ms instead of 1.6 (docs/MEASURED.md), and `nice` alone does not prevent it.
    """
    if hasattr(os, "sched_setscheduler"):
        with suppress(OSError):
            os.sched_setscheduler(0, getattr(os, "SCHED_BATCH", os.SCHED_OTHER), os.sched_param(0))
    if hasattr(os, "nice"):
        os.nice(nice)


def niceness() -> int | None:
    """Return how far this process stands behind others, 0: not at all; None where none is told."""
    return os.getpriority(os.PRIO_PROCESS, 0) if hasattr(os, "getpriority") else None
