"""The shared recogniser in one process, on uvicorn: what a machine or a container needs.

For more cores run one process a core behind any proxy. Requests beyond the queue get 503 at once,
and a body that does not come is not waited for.
"""

from __future__ import annotations

import asyncio
import contextlib
import socket
import urllib.parse
from collections.abc import AsyncIterator, Awaitable, Callable, Iterator, MutableMapping
from pathlib import Path
from typing import Any

import uvicorn

from hapticvlm.vision.remote import contract
from hapticvlm_recogniser_app.batches import Batches
from hapticvlm_recogniser_app.recogniser import Recogniser, Reply, Request, Waiting
from hapticvlm_recogniser_app.replies import Embedded, Refusal
from hapticvlm_recogniser_app.settings import AppSettings

BODY_S = 10.0
KEEP_ALIVE_S = 90
LEAVING_S = 5
CONNECTIONS_A_REQUEST = 4  # a service holds one open, and a second while it tries again

Message = MutableMapping[str, Any]
Receive = Callable[[], Awaitable[Message]]
Send = Callable[[Message], Awaitable[None]]


class Application:
    """The ASGI application; at most `queue` requests are answered at once."""

    def __init__(self, settings: AppSettings) -> None:
        """Load encoder and galleries. Raises HapticVLMError."""
        live = settings.live
        self._recogniser = Recogniser(settings.model, self._put)
        self._recogniser.load(live)
        self._batches: Batches[Waiting, Embedded | None] = Batches(
            self._recogniser.embed, live.batch, live.batch_wait_ms / 1000.0
        )
        self._queue = settings.scale.queue
        self._under_way = 0

    async def __call__(self, scope: Message, receive: Receive, send: Send) -> None:
        """Answer one request; other kinds of traffic are not taken."""
        if scope["type"] != "http":
            return
        reply = await self._reply(scope, receive)
        headers = [(b"content-type", reply.media_type.encode())]
        await send({"type": "http.response.start", "status": reply.status, "headers": headers})
        await send({"type": "http.response.body", "body": reply.content})

    async def _put(self, waiting: Waiting) -> Embedded | None:
        return await self._batches.put(waiting)

    async def _reply(self, scope: Message, receive: Receive) -> Reply:
        is_open = scope["path"] in (contract.HEALTH, contract.READY)  # a full queue is no illness
        if self._under_way >= self._queue and not is_open:
            return self._recogniser.refuse(Refusal(503, "too many requests wait: come back later"))
        self._under_way += 1
        try:
            return await self._recogniser.answer(_request(scope, receive))
        finally:
            self._under_way -= 1


def _request(scope: Message, receive: Receive) -> Request:
    query = urllib.parse.parse_qs(scope["query_string"].decode("latin-1"))
    headers: dict[bytes, bytes] = dict(scope["headers"])
    given = headers.get(b"authorization")
    return Request(
        scope["method"],
        scope["path"],
        query.get("gallery", [contract.SHIPPED])[0],
        None if given is None else given.decode("latin-1"),
        _body(receive),
    )


async def _body(receive: Receive) -> AsyncIterator[bytes]:
    """Yield the parts of a body. Raises Refusal for one that is cut off or does not come."""
    ends_at = asyncio.get_running_loop().time() + BODY_S
    while True:
        try:
            async with asyncio.timeout_at(ends_at):
                message = await receive()
        except TimeoutError:
            raise Refusal(408, f"the body did not come within {BODY_S:.0f} s") from None
        if message["type"] == "http.disconnect":
            raise Refusal(400, "the body was cut off")
        yield message.get("body", b"")
        if not message.get("more_body"):
            return


@contextlib.contextmanager
def listening(host: str, port: int) -> Iterator[socket.socket]:
    """Listen there; port 0 takes any that is free. Raises OSError."""
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    with socket.create_server((host, port), family=family, backlog=256) as listener:
        yield listener


class Server(uvicorn.Server):
    """Answers requests from when it is run until `leave`; says when it listens."""

    def __init__(
        self,
        settings: AppSettings,
        certificate: tuple[Path, Path] | None,
        on_ready: Callable[[], None],
    ) -> None:
        """Load encoder and galleries. `certificate` is the PEM files of certificate and key.

        Raises HapticVLMError.
        """
        cert, key = certificate or (None, None)
        config = uvicorn.Config(
            Application(settings),
            loop="asyncio",
            http="h11",
            ws="none",
            lifespan="off",
            log_config=None,
            access_log=False,
            server_header=False,
            limit_concurrency=CONNECTIONS_A_REQUEST * settings.scale.queue,
            timeout_keep_alive=KEEP_ALIVE_S,
            timeout_graceful_shutdown=LEAVING_S,
            ssl_certfile=cert,
            ssl_keyfile=key,
        )
        super().__init__(config)
        self._on_ready = on_ready

    def leave(self) -> None:
        """Answer what is under way and end, also when asked before it has begun."""
        self.should_exit = True

    async def startup(self, sockets: list[socket.socket] | None = None) -> None:
        """Listen, and say so."""
        await super().startup(sockets)
        self._on_ready()
