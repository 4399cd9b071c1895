"""Groups items that arrive close together into batches. Knows nothing of the work done on them."""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import Awaitable, Callable, Sequence
from typing import Generic, TypeVar

T = TypeVar("T")
R = TypeVar("R")


class Batches(Generic[T, R]):
    """Calls `work` with at most `most` items at a time, one call after the other.

    No batch waits for further items: while one runs, the next one fills, so batches grow with load.
    """

    def __init__(self, work: Callable[[Sequence[T]], Awaitable[Sequence[R]]], most: int) -> None:
        self._work = work
        self._most = most
        self._queue: deque[tuple[T, asyncio.Future[R]]] = deque()
        self._running: asyncio.Task[None] | None = None

    async def put(self, item: T) -> R:
        """Return the result of `work` for this item. Raises what `work` raises."""
        result: asyncio.Future[R] = asyncio.get_running_loop().create_future()
        self._queue.append((item, result))
        # The task that runs batches lives only while there is something to run. Everything here
        # happens on one event loop without an await in between, so no item can be appended after
        # the task has found the queue empty and before it is done.
        if self._running is None or self._running.done():
            self._running = asyncio.create_task(self._run())
        return await result

    async def _run(self) -> None:
        while self._queue:
            count = min(self._most, len(self._queue))
            batch = [self._queue.popleft() for _ in range(count)]
            try:
                values = await self._work([item for item, _ in batch])
            except Exception as error:  # noqa: BLE001 - every caller of this batch receives it
                for _, result in batch:
                    if not result.done():
                        result.set_exception(error)
                continue
            for (_, result), value in zip(batch, values, strict=True):
                if not result.done():  # its caller may have been cancelled meanwhile
                    result.set_result(value)
