"""A service behind the edge of sockets that keeps what it is told, in order."""

import asyncio
from collections import Counter
from contextlib import asynccontextmanager

from pace import PACE

from hapticvlm.server.edge.limiter import SocketLimiter
from hapticvlm.server.edge.listener import Listener
from hapticvlm.server.edge.socket import ClientSocket


class Service:
    """Keeps what is said, in order, with the turn of the loop it was said in; and who left."""

    def __init__(self, answer=lambda _: None):
        self.said: list[bytes | str] = []
        self.turns: list[int] = []
        self.turn = 0
        self.log: list[str] = []
        self.sockets: list[ClientSocket] = []
        self._answer = answer

    async def serve(self, edge):
        edge.mark_admitted()
        self.sockets.append(edge)

        def receive(data):
            self.said.append(data)
            self.turns.append(self.turn)
            answer = self._answer(data)
            if answer is not None:
                edge.write(answer)

        await edge.run(receive, lambda: self.log.append("left"))

    async def count_turns(self):
        while True:
            self.turn += 1
            await asyncio.sleep(0)


async def open_websocket(*_):
    """Answer no request: a WebSocket is opened."""


@asynccontextmanager
async def listening(service, limiter=None, answer=open_websocket):
    listener = Listener(limiter or SocketLimiter(Counter()), answer, service.serve, 4 * 1024 * 1024)
    async with listener.listen("127.0.0.1", 0) as port:
        counting = asyncio.create_task(service.count_turns())
        yield port
        counting.cancel()


async def until(claim):
    async with asyncio.timeout(5.0 * PACE):
        while not claim():  # noqa: ASYNC110 - nothing says when
            await asyncio.sleep(0.005)
