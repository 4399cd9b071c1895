"""The bare echo with each turn of its loop timed, for one client.

Prints its port when it is ready, and the turns as JSON when the client has disconnected, as
`timed_service` does.
"""

from __future__ import annotations

import asyncio
import json

from websockets.asyncio.server import ServerConnection

from hapticvlm_lab.bench.latency.echo import echo, listening
from hapticvlm_lab.bench.latency.timed_loop import report, time_turns


async def main() -> None:
    """Serve one client."""
    has_gone = asyncio.Event()

    async def serve(socket: ServerConnection) -> None:
        try:
            await echo(socket)
        finally:
            has_gone.set()

    async with listening(serve) as port:
        print(port, flush=True)
        await has_gone.wait()


if __name__ == "__main__":
    turns = time_turns()
    asyncio.run(main())
    print(json.dumps(report(turns)))
