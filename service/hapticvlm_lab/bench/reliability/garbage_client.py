"""One hostile client in a process of its own, which connects again each time it is closed.

`python -m hapticvlm_lab.bench.reliability.garbage_client URL` prints "flooding" and writes tiny
frames that are no message, each of which costs the service more to answer than it to send, until it
is killed.
"""

from __future__ import annotations

import asyncio
import contextlib
import sys

import msgspec
from websockets.asyncio.client import ClientConnection
from websockets.asyncio.client import connect as open_socket
from websockets.exceptions import ConnectionClosed, InvalidHandshake
from websockets.frames import Frame, Opcode

from hapticvlm.client.connection import Connection

BURST = 2000  # frames in one write
BACK_S = 0.01  # before it connects again
GARBAGE = Frame(Opcode.BINARY, b"\xc1").serialize(mask=True) * BURST
HELLO = {
    "type": "hello",
    "id": 7,
    "client": {"name": "flood", "version": "1"},
    "protocol": {"major": 1, "minor": 0},
    "role": "observer",
}


async def flood(url: str) -> None:
    """Write as fast as the service reads, and read its answers; connect again after each close."""
    while True:
        with contextlib.suppress(OSError, ConnectionClosed, InvalidHandshake, TimeoutError):
            await _visit(url)
        await asyncio.sleep(BACK_S)


async def _visit(url: str) -> None:
    async with open_socket(
        url,
        create_connection=Connection,
        compression=None,
        proxy=None,
        ping_interval=None,
        max_size=None,
        close_timeout=0.1,
    ) as socket:
        await socket.send(msgspec.msgpack.encode(HELLO))
        await socket.recv()
        # The client reads as well: a service whose answers nobody takes is protected by its own
        # budget of waiting bytes, and would close this connection before it has had to work.
        reading = asyncio.create_task(_read(socket))
        try:
            while not reading.done() and not socket.transport.is_closing():
                socket.transport.write(GARBAGE)
                written = asyncio.ensure_future(_drained(socket))
                await asyncio.wait({reading, written}, return_when=asyncio.FIRST_COMPLETED)
        finally:
            reading.cancel()
            with contextlib.suppress(asyncio.CancelledError, ConnectionClosed):
                await reading


async def _read(socket: ClientConnection) -> None:
    while True:
        await socket.recv()


async def _drained(socket: ClientConnection) -> None:
    with contextlib.suppress(ConnectionClosed, OSError, RuntimeError):
        await socket.drain()


if __name__ == "__main__":
    print("flooding", flush=True)
    asyncio.run(flood(sys.argv[1]))
