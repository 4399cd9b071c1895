"""The floor: a bare `websockets` server that echoes every message. Prints its port, then serves.

`python -m hapticvlm_lab.bench.latency.echo [realtime]`
"""

from __future__ import annotations

import asyncio
import os
import sys
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import asynccontextmanager

from websockets.asyncio.server import ServerConnection, serve

PRIORITY = 10


async def echo(socket: ServerConnection) -> None:
    """Echo every message until the client disconnects."""
    async for data in socket:
        await socket.send(data)


@asynccontextmanager
async def listening(handler: Callable[[ServerConnection], Awaitable[None]]) -> AsyncIterator[int]:
    """Serve plain sockets for as long as the context lasts; yields the port."""
    async with serve(handler, "127.0.0.1", 0, compression=None, ping_interval=None) as server:
        yield server.sockets[0].getsockname()[1]


async def main() -> None:
    """Serve until killed."""
    if "realtime" in sys.argv[1:]:
        # The priority of the gateway: service and floor must meet the scheduler alike.
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(PRIORITY))
    async with listening(echo) as port:
        print(port, flush=True)
        await asyncio.Future()


if __name__ == "__main__":
    asyncio.run(main())
