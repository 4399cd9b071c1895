"""Sets the priorities of threads and processes.

The audio thread and the serial line run in real time, and a process that computes with a model
runs behind all others.
"""

from __future__ import annotations

import os
from contextlib import suppress

FIFO_PRIORITY = 20


def request_priority(priority: int = FIFO_PRIORITY) -> bool:
    """Request real-time priority (SCHED_FIFO) for the calling thread; return whether granted.

    Linux grants it only to a user with the right to it; without it everything works, less evenly.
    """
    if not hasattr(os, "sched_setscheduler"):
        return False
    try:
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(priority))
    except OSError:
        return False
    return True


def lower_priority(nice: int) -> None:
    """Put this process, which only computes, behind the audio engine and the gateway.

    It gives up the real-time priority that a child inherits. On Linux it also becomes a batch
    process, which never preempts another process when it wakes. The gateway wakes a model in the
    middle of a turn of its event loop, whenever it hands over a frame. If the model preempted it
    there, one in a hundred touches would wait 3 ms instead of 1.6 (hapticvlm_lab/LOG.md), and a
    higher `nice` value alone does not prevent that.
    """
    if hasattr(os, "sched_setscheduler"):
        with suppress(OSError):
            os.sched_setscheduler(0, getattr(os, "SCHED_BATCH", os.SCHED_OTHER), os.sched_param(0))
    if hasattr(os, "nice"):
        os.nice(nice)


def niceness() -> int | None:
    """Return the nice value of this process; None where the operating system has none."""
    return os.getpriority(os.PRIO_PROCESS, 0) if hasattr(os, "getpriority") else None
