"""The service with each turn of its event loop timed; told as JSON when it ends.

`python -m hapticvlm_lab.bench.latency.timed_service serve ...` is `hapticvlm serve ...` whose last
line is {"turns": {what ran: [us of processor time, in order]}}.
"""

from __future__ import annotations

import asyncio
import json
import sys
import time
from collections import defaultdict
from typing import Any

Turns = dict[str, list[float]]


def time_turns() -> Turns:
    """Time every callback that a loop of this process runs from now on; return where to find it."""
    turns: Turns = defaultdict(list)
    # asyncio has no public place for this: its debug mode tells slow callbacks by the wall clock,
    # in which other processes take part, and costs more than what it would measure.
    handle: Any = asyncio.Handle
    plain = handle._run

    def timed(self: Any) -> None:  # noqa: ANN401 - a handle's fields are private
        ran = _name(self._callback)
        begun = time.thread_time_ns()
        plain(self)
        turns[ran].append((time.thread_time_ns() - begun) / 1e3)

    handle._run = timed
    return turns


def _name(callback: Any) -> str:  # noqa: ANN401 - whatever a loop can call
    """Name what runs: a task by its coroutine, reading by who is given what was read."""
    owner = getattr(callback, "__self__", None)
    if isinstance(owner, asyncio.Task):
        return str(getattr(owner.get_coro(), "__qualname__", "a task"))
    if isinstance(owner, asyncio.ReadTransport):
        return f"{type(owner.get_protocol()).__name__} reads"
    return str(getattr(callback, "__qualname__", type(callback).__name__))


if __name__ == "__main__":  # the children of the service import this file, and time nothing
    from hapticvlm.commands.main import main

    found = time_turns()
    status = main()
    print(
        json.dumps({"turns": {ran: [round(us, 1) for us in took] for ran, took in found.items()}})
    )
    sys.exit(status)
