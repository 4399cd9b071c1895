"""Decides when the event loop does work that touches must not wait for.

A touch that arrives while the loop works waits for the end of that work. Two tools keep that wait
short. `IdleScheduler` moves work that is due soon (ticks, telemetry, checks of children) to the
millisecond after a touch: touches of a scene come with its frames, 8 to 14 ms apart, so no other
touch is expected then. Work is never later for it: without a touch it is done when it is due.
`call_after_io` and `yield_to_io` split long work into turns of the loop and let sockets that have
become readable go first. A callback given to `call_soon` runs before those sockets, since the loop
appends their callbacks behind it; so both wait for a second turn.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable

# Our choice. Both hands of a frame come within a millisecond. A client that touches 72 times a
# second or more often (the slowest headset) never meets the work: a touch is always within EARLY_S
# of it.
AFTER_S = 0.001
EARLY_S = 0.014


class IdleScheduler:
    """Lets one task wait until its work is due, or until a touch lets it begin early."""

    def __init__(self) -> None:
        self._is_due = asyncio.Event()
        self._timer: asyncio.TimerHandle | None = None  # of the wait, or of the last one

    async def wait(self, longest_s: float) -> None:
        """Wait for a touch that lets work begin early, or for so long."""
        self._is_due.clear()
        loop = asyncio.get_running_loop()
        self._timer = loop.call_later(longest_s, self._is_due.set)
        await self._is_due.wait()

    def touched(self) -> None:
        """Note that a touch was answered."""
        if self._timer is None:
            return
        loop = asyncio.get_running_loop()
        if AFTER_S < self._timer.when() - loop.time() <= EARLY_S:
            self._timer.cancel()
            self._timer = loop.call_later(AFTER_S, self._is_due.set)


def call_after_io(callback: Callable[..., object], *arguments: object) -> None:
    """Call this when what has come to the sockets by then is carried out; on the event loop."""
    loop = asyncio.get_running_loop()
    loop.call_soon(loop.call_soon, callback, *arguments)


async def yield_to_io() -> None:
    """Wait until what has come to the sockets by now is carried out."""
    for _ in range(2):
        await asyncio.sleep(0)
