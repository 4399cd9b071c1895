"""Sends a long answer in pieces, so that the event loop is never held by one of megabytes.

websockets writes an answer whole. Here all but its last piece go ahead, each when the one before
has left, and the rest is what websockets still has to write.
"""

from __future__ import annotations

from contextlib import suppress

from websockets.asyncio.server import ServerConnection
from websockets.http11 import Response

PIECE = 64 * 1024


class _Rest(Response):
    """What is left of an answer whose head was sent."""

    def serialize(self) -> bytes:
        """Return the last piece, without a head."""
        return bytes(self.body)


async def send_ahead(connection: ServerConnection, answer: Response) -> Response:
    """Send what is long of the answer; return what is still to be sent."""
    if len(answer.body) <= PIECE:
        return answer
    body = memoryview(answer.body)
    last = (len(body) - 1) // PIECE * PIECE
    head = Response(answer.status_code, answer.reason_phrase, answer.headers)
    with suppress(OSError):  # the browser has gone
        connection.transport.write(head.serialize())
        for start in range(0, last, PIECE):
            connection.transport.write(body[start : start + PIECE])
            await connection.drain()
    return _Rest(answer.status_code, answer.reason_phrase, answer.headers, bytes(body[last:]))
