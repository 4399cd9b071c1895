"""Serves the shared recogniser from one process, on uvicorn: for one machine or one container.

To use more cores, run one process per core behind a proxy. Requests beyond the queue are answered
with 503 at once, and a body that does not arrive within BODY_S with 408, so that neither a burst of
requests nor a stalled client holds memory for long. Sockets of strangers are closed by `door`.
"""

from __future__ import annotations

import asyncio
import socket
import urllib.parse
from collections.abc import AsyncIterator, Awaitable, Callable, MutableMapping
from pathlib import Path
from typing import Any

import uvicorn

from hapticvlm.vision.remote import contract
from hapticvlm_recogniser_app.batches import Batches
from hapticvlm_recogniser_app.door import Door, Strangers
from hapticvlm_recogniser_app.recogniser import PendingCrop, Recogniser, Reply, Request
from hapticvlm_recogniser_app.replies import Embedded, Refusal
from hapticvlm_recogniser_app.settings import ADMITTED, BATCH, KEEP_ALIVE_S, AppSettings

BODY_S = 10.0
SHUTDOWN_S = 5

Message = MutableMapping[str, Any]
Receive = Callable[[], Awaitable[Message]]
Send = Callable[[Message], Awaitable[None]]


class Application:
    """The ASGI application; at most `queue` requests are answered at once."""

    def __init__(self, settings: AppSettings) -> None:
        """Load encoder and galleries. Raises HapticVLMError."""
        self._recogniser = Recogniser(
            settings.model, lambda crop: self._batches.put(crop), settings.scale.queue
        )
        self._recogniser.load(settings.galleries)
        self._batches: Batches[PendingCrop, Embedded | None] = Batches(
            self._recogniser.embed, BATCH
        )
        self._queue = settings.scale.queue
        self._in_progress = 0

    async def __call__(self, scope: Message, receive: Receive, send: Send) -> None:
        """Answer one HTTP request; other ASGI scopes (WebSocket, lifespan) are ignored."""
        if scope["type"] != "http":
            return
        reply = await self._reply(scope, receive)
        headers = [(b"content-type", reply.media_type.encode())]
        await send({"type": "http.response.start", "status": reply.status, "headers": headers})
        await send({"type": "http.response.body", "body": reply.content})

    async def _reply(self, scope: Message, receive: Receive) -> Reply:
        authorization = dict(scope["headers"]).get(b"authorization", b"").decode("latin-1")
        client = scope[ADMITTED] = self._recogniser.tokens.client(authorization)
        query = urllib.parse.parse_qs(scope["query_string"].decode("latin-1"))
        gallery = query.get("gallery", [contract.SHIPPED])[0]
        # A full queue does not make the process unhealthy, and a monitor that cannot ask would
        # restart it: health and readiness are answered whatever the load.
        is_exempt = scope["path"] in (contract.HEALTH, contract.READY)
        if self._in_progress >= self._queue and not is_exempt:
            return self._recogniser.refuse(Refusal(503, "the queue is full: try again later"))
        self._in_progress += 1
        try:
            request = Request(scope["method"], scope["path"], gallery, client, _body(receive))
            return await self._recogniser.answer(request)
        finally:
            self._in_progress -= 1


async def _body(receive: Receive) -> AsyncIterator[bytes]:
    """Yield the parts of a body. Raises Refusal (400 cut off, 408 not received in time)."""
    # One deadline for the whole body: a client that sends a byte now and then must not extend it.
    ends_at = asyncio.get_running_loop().time() + BODY_S
    while True:
        try:
            async with asyncio.timeout_at(ends_at):
                message = await receive()
        except TimeoutError:
            raise Refusal(408, f"the body did not arrive within {BODY_S:.0f} s") from None
        if message["type"] == "http.disconnect":
            raise Refusal(400, "the body was cut off")
        yield message.get("body", b"")
        if not message.get("more_body"):
            return


class Server(uvicorn.Server):
    """Answers requests until `leave` is called; `on_ready` is called once it listens."""

    def __init__(
        self,
        settings: AppSettings,
        certificate: tuple[Path, Path] | None,
        on_ready: Callable[[], None],
    ) -> None:
        """Load encoder and galleries. `certificate` holds the PEM files of certificate and key.

        Raises HapticVLMError.
        """
        cert, key = certificate or (None, None)
        config = uvicorn.Config(
            Application(settings),
            loop="asyncio",
            http=type("OwnDoor", (Door,), {"strangers": Strangers()}),
            ws="none",
            lifespan="off",
            log_config=None,
            access_log=False,
            server_header=False,
            timeout_keep_alive=KEEP_ALIVE_S,
            timeout_graceful_shutdown=SHUTDOWN_S,
            ssl_certfile=cert,
            ssl_keyfile=key,
        )
        super().__init__(config)
        self._on_ready = on_ready

    def leave(self) -> None:
        """Answer the requests in progress, then end. May be called before `serve`."""
        self.should_exit = True

    async def startup(self, sockets: list[socket.socket] | None = None) -> None:
        """Listen, and report it."""
        await super().startup(sockets)
        self._on_ready()
