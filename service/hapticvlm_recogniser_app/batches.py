"""Things that come while others are worked on are worked on together. Knows nothing of the work."""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import Awaitable, Callable, Sequence
from typing import Generic, TypeVar

T = TypeVar("T")
R = TypeVar("R")


class Batches(Generic[T, R]):
    """Calls `work` with at most `most` things at a time, one call after the other.

    A batch begins `wait_s` after its first thing came, or when it is full. While one is under way
    the next gathers, so under load batches grow by themselves and nothing has to wait for them.
    """

    def __init__(
        self, work: Callable[[Sequence[T]], Awaitable[Sequence[R]]], most: int, wait_s: float
    ) -> None:
        self._work = work
        self._most = most
        self._wait_s = wait_s
        self._waiting: deque[tuple[T, asyncio.Future[R]]] = deque()
        self._full = asyncio.Event()
        self._running: asyncio.Task[None] | None = None

    async def put(self, thing: T) -> R:
        """Return what `work` made of this thing. Raises what `work` raises."""
        made: asyncio.Future[R] = asyncio.get_running_loop().create_future()
        self._waiting.append((thing, made))
        if len(self._waiting) >= self._most:
            self._full.set()
        if self._running is None or self._running.done():
            self._running = asyncio.create_task(self._run())
        return await made

    async def _run(self) -> None:
        while self._waiting:
            if len(self._waiting) < self._most and self._wait_s > 0.0:
                await self._gather()
            count = min(self._most, len(self._waiting))
            batch = [self._waiting.popleft() for _ in range(count)]
            try:
                results = await self._work([thing for thing, _ in batch])
            except Exception as error:  # noqa: BLE001 - whoever put a thing in is told
                for _, made in batch:
                    if not made.done():
                        made.set_exception(error)
                continue
            for (_, made), result in zip(batch, results, strict=True):
                if not made.done():  # who put it in may have left
                    made.set_result(result)

    async def _gather(self) -> None:
        self._full.clear()
        try:
            await asyncio.wait_for(self._full.wait(), self._wait_s)
        except TimeoutError:
            return
