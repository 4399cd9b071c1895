"""Times every turn of an event loop, by the callback that ran in it."""

from __future__ import annotations

import asyncio
import time
from typing import Any

Turns = list[tuple[str, float]]  # what ran and its processor time, us, in order


def time_turns() -> Turns:
    """Time every callback of this process's loops from now on; return the list that is filled."""
    turns: Turns = []
    # asyncio has no public hook for this. Its debug mode reports slow callbacks by the wall clock,
    # which includes the time of other processes, and costs more than it would measure.
    handle: Any = asyncio.Handle
    plain = handle._run

    def timed(self: Any) -> None:  # noqa: ANN401 - a handle's fields are private
        ran = _name(self._callback)
        begun = time.thread_time_ns()
        plain(self)
        turns.append((ran, (time.thread_time_ns() - begun) / 1e3))

    handle._run = timed
    return turns


def report(turns: Turns) -> dict[str, Turns]:
    """Return the JSON object that a timed process prints at its end."""
    return {"turns": [(ran, round(us, 1)) for ran, us in turns]}


def _name(callback: Any) -> str:  # noqa: ANN401 - whatever a loop can call
    """Name a callback: a task by its coroutine, a read by the protocol that gets the bytes."""
    owner = getattr(callback, "__self__", None)
    if isinstance(owner, asyncio.Task):
        return str(getattr(owner.get_coro(), "__qualname__", "a task"))
    if isinstance(owner, asyncio.ReadTransport):
        return f"{type(owner.get_protocol()).__name__} reads"
    return str(getattr(callback, "__qualname__", type(callback).__name__))
