"""The floor: a bare `websockets` server that echoes every message. Prints its port, then serves.

`python -m hapticvlm_lab.bench.latency.echo [realtime]`.
"""

from __future__ import annotations

import asyncio
import os
import sys

from websockets.asyncio.server import ServerConnection, serve

PRIORITY = 10


async def main() -> None:
    """Serve plain sockets until killed."""

    async def echo(socket: ServerConnection) -> None:
        async for data in socket:
            await socket.send(data)

    async with serve(echo, "127.0.0.1", 0, compression=None, ping_interval=None) as server:
        print(server.sockets[0].getsockname()[1], flush=True)
        await asyncio.Future()


if __name__ == "__main__":
    if "realtime" in sys.argv[1:]:
        # The priority of the gateway: service and floor must meet the scheduler alike.
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(PRIORITY))
    asyncio.run(main())
