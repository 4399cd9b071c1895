"""Work in turns of the event loop: between two, what has come to any socket is carried out.

A callback that `call_soon` puts off runs before the sockets that became readable meanwhile: the
loop adds those behind it. So whoever wants to let a touch go first waits for a second turn.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable


def put_off(callback: Callable[..., object], *arguments: object) -> None:
    """Call this when what has come to the sockets by then is carried out; on the event loop."""
    loop = asyncio.get_running_loop()
    loop.call_soon(loop.call_soon, callback, *arguments)


async def give_way() -> None:
    """Wait until what has come to the sockets by now is carried out."""
    for _ in range(2):
        await asyncio.sleep(0)
