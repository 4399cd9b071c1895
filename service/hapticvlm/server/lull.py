"""When the loop does its own work: just after a touch, as long as another is not expected.

A touch that comes while the loop works waits for the end of that. Touches of a scene come with its
frames, 8 to 14 ms apart, and at no other time; so who works in the millisecond after one holds up
none. Work is never later for it: without a touch it is done when it is due.
"""

from __future__ import annotations

import asyncio

# Our choice. Both hands of a frame come within a millisecond. Whoever touches 72 times a second or
# more often (the slowest headset) never meets the work: one touch is always within EARLY_S of it.
AFTER_S = 0.001
EARLY_S = 0.014


class Lull:
    """Lets one task wait for its time; all of it on the event loop."""

    def __init__(self) -> None:
        self._due = 0.0
        self._waiter: asyncio.Future[None] | None = None
        self._timer: asyncio.TimerHandle | None = None

    async def wait(self, longest_s: float) -> None:
        """Wait for a touch that lets work begin early, or for so long."""
        loop = asyncio.get_running_loop()
        self._waiter = loop.create_future()
        self._wake(loop, loop.time() + longest_s)
        try:
            await self._waiter
        finally:
            self._waiter = None
            self._cancel()

    def touched(self) -> None:
        """Note that a touch was answered."""
        if self._waiter is None:
            return
        loop = self._waiter.get_loop()
        now = loop.time()
        if AFTER_S < self._due - now <= EARLY_S:
            self._cancel()
            self._wake(loop, now + AFTER_S)

    def _wake(self, loop: asyncio.AbstractEventLoop, due: float) -> None:
        self._due = due
        self._timer = loop.call_at(due, self._end)

    def _end(self) -> None:
        if self._waiter is not None and not self._waiter.done():
            self._waiter.set_result(None)

    def _cancel(self) -> None:
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None
