"""The deployment on Ray Serve: HTTP in, crops of many scenes batched, answers out.

The only modules that import Ray are this one and `local`. A replica holds the encoder and every
gallery; a batch is embedded in a thread, so that the replica answers its health checks meanwhile.
"""

from __future__ import annotations

import asyncio
import logging
import os
import time
from collections import Counter
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

import msgspec
from ray import serve
from starlette.requests import Request
from starlette.responses import Response

from hapticvlm.errors import HapticVLMError, UsageError
from hapticvlm.vision.encoders.encoder import Floats
from hapticvlm.vision.encoders.loading import load_encoder
from hapticvlm.vision.pictures import Crop
from hapticvlm.vision.remote import contract
from hapticvlm_recogniser_app import replies
from hapticvlm_recogniser_app.replies import Embedded, Named, Refusal, load_galleries
from hapticvlm_recogniser_app.settings import TOKEN, AppSettings, Live, Model, options

HUNG_S = 10.0  # a batch under way for longer: the replica is replaced

logger = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True)
class Waiting:
    """One crop that waits for its batch: since when, and until when somebody wants it, s."""

    crop: Crop
    since: float
    until: float


class Recogniser:
    """One replica."""

    def __init__(self, model: dict[str, Any]) -> None:
        """Load the encoder. Raises HapticVLMError, which the deployment reports."""
        self._model = Model(**model)
        self._token = os.environ.get(TOKEN) or None
        if self._token is None and not self._model.is_open:
            raise UsageError(f"set {TOKEN} where the replicas run, or `is_open: true`")
        self._encoder = load_encoder(
            self._model.encoder, device=self._model.device, threads=self._model.threads
        )
        self._galleries: dict[str, Named] = {}
        self._began: float | None = None
        self._counts: Counter[str] = Counter()
        self._batches: Counter[int] = Counter()
        self._encode_s: dict[int, float] = {}

    async def reconfigure(self, live: dict[str, Any]) -> None:
        """Apply other galleries or another batching, all of it or nothing, while answering."""
        wanted = Live(**live)
        self._galleries = await asyncio.to_thread(load_galleries, wanted.galleries, self._encoder)
        self._embed.set_max_batch_size(wanted.batch)
        wait_s = wanted.batch_wait_ms / 1000.0
        self._embed.set_batch_wait_timeout_s(wait_s)

    def check_health(self) -> None:
        """Raise RuntimeError when a batch hangs, so that this replica is replaced."""
        if self._began is not None and time.monotonic() - self._began > HUNG_S:
            raise RuntimeError("a batch hangs")

    async def __call__(self, request: Request) -> Response:
        """Answer one HTTP request."""
        try:
            return await self._answer(request)
        except Refusal as refusal:
            self._counts[f"refused: {refusal.status}"] += 1
            text = msgspec.json.encode({"error": str(refusal)})
            return Response(text, refusal.status, media_type="application/json")
        except HapticVLMError:
            logger.exception("a recognition failed")
            text = msgspec.json.encode({"error": "recognising failed"})
            return Response(text, 500, media_type="application/json")

    async def _answer(self, request: Request) -> Response:
        path = request.url.path
        verb = request.method
        wanted = "POST" if path == contract.RECOGNISE else "GET"
        if path not in (contract.RECOGNISE, contract.IDENTITY, contract.HEALTH, contract.READY):
            raise Refusal(404, f"paths here are {contract.RECOGNISE} and {contract.IDENTITY}")
        if verb != wanted:
            raise Refusal(405, f"{path} takes {wanted}")
        if path in (contract.HEALTH, contract.READY):
            return _json(self._health())
        replies.check_token(self._token, request.headers.get("authorization"))
        if path == contract.IDENTITY:
            name = request.query_params.get("gallery", contract.SHIPPED)
            return _json(replies.find(self._galleries, name).identity)
        return await self._recognise(request)

    async def _recognise(self, request: Request) -> Response:
        now = time.monotonic()
        job = replies.read_job(await _body(request, self._encoder.side), self._galleries, now)
        waiting = [Waiting(crop, now, job.until) for crop in job.crops]
        embedded = await asyncio.gather(*(self._embed(item) for item in waiting))
        self._counts["late"] += sum(result is None for result in embedded)
        answer = replies.write_answer(job, embedded)
        self._counts["crops"] += len(embedded)
        return Response(answer, media_type=contract.MESSAGEPACK)

    @serve.batch  # type: ignore[untyped-decorator]
    async def _embed(self, waiting: list[Waiting]) -> list[Embedded | None]:
        """Embed what waits together, but for what nobody waits for any more."""
        self._began = time.monotonic()
        wanted = [item for item in waiting if item.until > self._began]
        try:
            embeddings, cpu_s = await asyncio.to_thread(self._timed, [item.crop for item in wanted])
        finally:
            began = self._began
            self._began = None
        took_ms = (time.monotonic() - began) * 1000.0
        self._batches[len(wanted)] += 1
        self._encode_s[len(wanted)] = self._encode_s.get(len(wanted), 0.0) + cpu_s
        rows = iter(embeddings)
        return [
            Embedded(next(rows), len(wanted), (began - item.since) * 1000.0, took_ms)
            if item.until > began
            else None
            for item in waiting
        ]

    def _timed(self, crops: Sequence[Crop]) -> tuple[Floats, float]:
        started = time.thread_time()
        embeddings = self._encoder.embed(crops)
        return embeddings, time.thread_time() - started

    def _health(self) -> dict[str, Any]:
        return {
            "status": "ok",
            "pid": os.getpid(),
            "counts": dict(self._counts),
            "batches": {str(size): count for size, count in sorted(self._batches.items())},
            "encode_cpu_s": {str(size): used for size, used in sorted(self._encode_s.items())},
        }


def build(model: dict[str, Any]) -> serve.Application:
    """Make the application of a Serve config, whose own options win over these."""
    return application(AppSettings(Model(**model)))


def application(settings: AppSettings) -> serve.Application:
    """Make the application with all its options."""
    deployment = serve.deployment(Recogniser)
    return deployment.options(**options(settings)).bind(asdict(settings.model))


async def _body(request: Request, side: int) -> bytes:
    """Read the body, but not one that is larger than any request. Raises Refusal."""
    most = replies.most_bytes(side)
    data = bytearray()
    async for part in request.stream():
        data += part
        if len(data) > most:
            raise Refusal(413, f"a request has at most {most} bytes")
    return bytes(data)


def _json(content: object) -> Response:
    return Response(msgspec.json.encode(content), media_type="application/json")
