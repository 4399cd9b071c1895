"""Groups items that arrive close together into batches. Knows nothing of the work done on them."""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import Awaitable, Callable, Sequence
from contextlib import suppress
from typing import Generic, TypeVar

T = TypeVar("T")
R = TypeVar("R")


class Batches(Generic[T, R]):
    """Calls `work` with at most `most` items at a time, one call after the other.

    A batch starts `wait_s` after its first item arrived, or when it is full. While one batch runs,
    the next one fills, so batches grow with the load and `wait_s` may be 0.
    """

    def __init__(
        self, work: Callable[[Sequence[T]], Awaitable[Sequence[R]]], most: int, wait_s: float
    ) -> None:
        self._work = work
        self._most = most
        self._wait_s = wait_s
        self._queue: deque[tuple[T, asyncio.Future[R]]] = deque()
        self._full = asyncio.Event()
        self._running: asyncio.Task[None] | None = None

    async def put(self, item: T) -> R:
        """Return the result of `work` for this item. Raises what `work` raises."""
        result: asyncio.Future[R] = asyncio.get_running_loop().create_future()
        self._queue.append((item, result))
        if len(self._queue) >= self._most:
            self._full.set()
        # The task that runs batches lives only while there is something to run. Everything here
        # happens on one event loop without an await in between, so no item can be appended after
        # the task has found the queue empty and before it is done.
        if self._running is None or self._running.done():
            self._running = asyncio.create_task(self._run())
        return await result

    async def _run(self) -> None:
        while self._queue:
            if len(self._queue) < self._most and self._wait_s > 0.0:
                self._full.clear()
                with suppress(TimeoutError):
                    await asyncio.wait_for(self._full.wait(), self._wait_s)
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
