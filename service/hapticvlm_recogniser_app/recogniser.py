"""Answers one HTTP request to the shared recogniser, whichever engine serves it.

It holds the encoder and every gallery. The engine (uvicorn or Ray) delivers the requests and groups
the crops of several requests into a batch; the answers are the same with either engine.
"""

from __future__ import annotations

import asyncio
import logging
import os
import time
from collections import Counter
from collections.abc import AsyncIterable, Awaitable, Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import msgspec

from hapticvlm.errors import HapticVLMError, UsageError
from hapticvlm.processes import priority
from hapticvlm.vision.encoders import living
from hapticvlm.vision.loading import load_encoder
from hapticvlm.vision.pictures import Crop
from hapticvlm.vision.remote import contract
from hapticvlm_recogniser_app import replies
from hapticvlm_recogniser_app.replies import Embedded, Named, Refusal, load_galleries
from hapticvlm_recogniser_app.settings import TOKEN, TOKENS, Model
from hapticvlm_recogniser_app.tokens import Tokens

HUNG_S = 10.0  # a batch that runs for longer counts as hung
JSON = "application/json"

logger = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True)
class Request:
    """One HTTP request; the body arrives in parts and is read only where the path needs it.

    `client` has the token that came with it; None: no token, or an unknown one.
    """

    verb: str
    path: str
    gallery: str
    client: str | None
    body: AsyncIterable[bytes]


@dataclass(frozen=True, slots=True)
class Reply:
    """The HTTP response to a request."""

    status: int
    content: bytes
    media_type: str = JSON


@dataclass(frozen=True, slots=True)
class PendingCrop:
    """One crop that waits for its batch.

    `since` and `until` are in seconds of time.monotonic: its arrival, and the end of its caller's
    patience, after which it is not embedded any more.
    """

    crop: Crop
    since: float
    until: float


Gather = Callable[[PendingCrop], Awaitable[Embedded | None]]


class Recogniser:
    """Encoder, galleries and counts of one process; `gather` puts a crop into the next batch.

    It answers `places` requests at once, and where clients have tokens of their own, one of them
    has half of these at most.
    """

    def __init__(self, model: Model, gather: Gather, places: int) -> None:
        """Load the encoder. Raises HapticVLMError."""
        self.tokens = Tokens(os.environ)
        if self.tokens.is_open and not model.is_open:
            raise UsageError(f"set {TOKEN} or {TOKENS} where it runs, or `is_open: true`")
        self._share = max(1, places // 2) if self.tokens.are_many else places
        self._in_progress: Counter[str] = Counter()
        self._gather = gather
        self._encoder = load_encoder(model.encoder, device=model.device)
        self._galleries: dict[str, Named] = {}
        self._began: float | None = None
        self._counts: Counter[str] = Counter()
        self._batches: Counter[int] = Counter()

    def load(self, galleries: Mapping[str, str]) -> None:
        """Replace the galleries by these, all or none. Raises HapticVLMError."""
        self._galleries = load_galleries(galleries, self._encoder)

    @property
    def hangs(self) -> bool:
        """Whether a batch has been running for longer than HUNG_S."""
        return self._began is not None and time.monotonic() - self._began > HUNG_S

    async def answer(self, request: Request) -> Reply:
        """Answer one request; a fault of the request becomes a reply, never an exception."""
        try:
            return await self._answer(request)
        except Refusal as refusal:
            return self.refuse(refusal)
        except HapticVLMError:
            logger.exception("a recognition failed")
            return Reply(500, msgspec.json.encode({"error": "recognising failed"}))

    def refuse(self, refusal: Refusal) -> Reply:
        """Count a refusal and return the reply that reports it."""
        self._counts[f"refused: {refusal.status}"] += 1
        return Reply(refusal.status, msgspec.json.encode({"error": str(refusal)}))

    async def embed(self, pending: Sequence[PendingCrop]) -> list[Embedded | None]:
        """Embed a batch; None for each crop whose caller has stopped waiting."""
        self._began = began = time.monotonic()
        wanted = [item for item in pending if item.until > began]
        try:
            # In a thread, so that health checks and further requests are answered meanwhile.
            embeddings, alive = await asyncio.to_thread(
                living.embed, self._encoder, [item.crop for item in wanted]
            )
        finally:
            self._began = None
        took_ms = (time.monotonic() - began) * 1000.0
        self._batches[len(wanted)] += 1
        rows = iter(zip(embeddings, map(float, alive), strict=True))

        def embedded(item: PendingCrop) -> Embedded:
            embedding, belief = next(rows)
            queue_ms = (began - item.since) * 1000.0
            return Embedded(embedding, len(wanted), queue_ms, took_ms, belief)

        return [embedded(item) if item.until > began else None for item in pending]

    async def _answer(self, request: Request) -> Reply:
        path = request.path
        verb = "POST" if path == contract.RECOGNISE else "GET"
        if path not in (contract.RECOGNISE, contract.IDENTITY, contract.HEALTH, contract.READY):
            raise Refusal(404, f"unknown path; use {contract.RECOGNISE} or {contract.IDENTITY}")
        if request.verb != verb:
            raise Refusal(405, f"{path} takes {verb}")
        if path in (contract.HEALTH, contract.READY):
            status = 503 if self.hangs else 200
            return Reply(status, msgspec.json.encode(self._health()))
        client = request.client
        if client is None:
            raise Refusal(401, "send the token of this recogniser as `Authorization: Bearer TOKEN`")
        if path == contract.IDENTITY:
            gallery = replies.find(self._galleries, request.gallery)
            return Reply(200, msgspec.json.encode(gallery.identity))
        if self._in_progress[client] >= self._share:
            raise Refusal(503, f"{self._share} requests with this token wait: try again later")
        self._in_progress[client] += 1
        try:
            return await self._recognise(request)
        finally:
            self._in_progress[client] -= 1

    async def _recognise(self, request: Request) -> Reply:
        now = time.monotonic()
        body = await self._read(request.body)
        job = replies.read_job(body, self._galleries, now)
        pending = [PendingCrop(crop, now, job.until) for crop in job.crops]
        embedded = await asyncio.gather(*map(self._gather, pending))
        self._counts["late"] += sum(result is None for result in embedded)
        answer = replies.write_answer(job, embedded)
        self._counts["crops"] += len(embedded)
        return Reply(200, answer, contract.MESSAGEPACK)

    async def _read(self, body: AsyncIterable[bytes]) -> bytes:
        """Read the body. Raises Refusal as soon as it is larger than any valid request."""
        most = replies.most_bytes(self._encoder.side)
        data = bytearray()
        async for part in body:
            data += part
            if len(data) > most:
                raise Refusal(413, f"a request has at most {most} bytes")
        return bytes(data)

    def _health(self) -> dict[str, Any]:
        return {
            "status": "a batch hangs" if self.hangs else "ok",
            "pid": os.getpid(),
            "nice": priority.niceness(),
            "counts": dict(self._counts),
            "batches": {str(size): count for size, count in sorted(self._batches.items())},
        }
