"""Real-time priority for a thread that may not come late: audio blocks and the serial line."""

from __future__ import annotations

import os

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
