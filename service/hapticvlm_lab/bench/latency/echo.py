"""The floor: a bare `websockets` server that echoes every message. Prints its port, then serves.

`python -m hapticvlm_lab.bench.latency.echo [realtime | timed]`. With `timed` each turn of its loop
is timed, for one client; the turns are printed as JSON when that client has disconnected.
"""

from __future__ import annotations

import asyncio
import json
import os
import sys

from websockets.asyncio.server import ServerConnection, serve

from hapticvlm_lab.bench.latency.timed_loop import report, time_turns

PRIORITY = 10


async def main(*, only_one: bool) -> None:
    """Serve plain sockets until killed, or until the first client disconnects."""
    has_left = asyncio.Event()

    async def echo(socket: ServerConnection) -> None:
        try:
            async for data in socket:
                await socket.send(data)
        finally:
            has_left.set()

    async with serve(echo, "127.0.0.1", 0, compression=None, ping_interval=None) as server:
        print(server.sockets[0].getsockname()[1], flush=True)
        await (has_left.wait() if only_one else asyncio.Future())


if __name__ == "__main__":
    if "realtime" in sys.argv[1:]:
        # The priority of the gateway: service and floor must meet the scheduler alike.
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(PRIORITY))
    if "timed" in sys.argv[1:]:
        turns = time_turns()
        asyncio.run(main(only_one=True))
        print(json.dumps(report(turns)))
    else:
        asyncio.run(main(only_one=False))
