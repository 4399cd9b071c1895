"""The shared recogniser as a deployment on Ray Serve: for many nodes and shares of a GPU.

The only modules that import Ray are this one and `ray_here`. A replica is one recogniser; Ray
gathers its batches, watches it and replaces it.
"""

from __future__ import annotations

import asyncio
import logging
from dataclasses import asdict
from typing import Any

from ray import serve
from starlette.requests import Request
from starlette.responses import Response

from hapticvlm.processes import priority
from hapticvlm.vision.remote import contract
from hapticvlm_recogniser_app import recogniser
from hapticvlm_recogniser_app.replies import Embedded
from hapticvlm_recogniser_app.settings import AppSettings, Live, Model, options

logger = logging.getLogger("ray.serve")  # what Serve writes into a replica's log


class Recogniser:
    """One replica."""

    def __init__(self, model: dict[str, Any]) -> None:
        """Load the encoder. Raises HapticVLMError, which the deployment reports."""
        self._recogniser = recogniser.Recogniser(Model(**model), self._embed)
        if nice := priority.niceness():
            logger.warning(
                "this replica is at nice %d, behind all other programs of its node: "
                "start each node with RAY_worker_niceness=0",
                nice,
            )

    async def reconfigure(self, live: dict[str, Any]) -> None:
        """Apply other galleries or another batching, all of it or nothing, while answering."""
        wanted = Live(**live)
        await asyncio.to_thread(self._recogniser.load, wanted)
        self._embed.set_max_batch_size(wanted.batch)
        self._embed.set_batch_wait_timeout_s(wanted.batch_wait_ms / 1000.0)

    def check_health(self) -> None:
        """Raise RuntimeError when a batch hangs, so that this replica is replaced."""
        if self._recogniser.hangs:
            raise RuntimeError("a batch hangs")

    async def __call__(self, request: Request) -> Response:
        """Answer one HTTP request."""
        reply = await self._recogniser.answer(
            recogniser.Request(
                request.method,
                request.url.path,
                request.query_params.get("gallery", contract.SHIPPED),
                request.headers.get("authorization"),
                request.stream(),
            )
        )
        return Response(reply.content, reply.status, media_type=reply.media_type)

    @serve.batch  # type: ignore[untyped-decorator]
    async def _embed(self, waiting: list[recogniser.Waiting]) -> list[Embedded | None]:
        return await self._recogniser.embed(waiting)


def build(model: dict[str, Any]) -> serve.Application:
    """Make the application of a Serve config, whose own options win over these."""
    return application(AppSettings(Model(**model)))


def application(settings: AppSettings) -> serve.Application:
    """Make the application with all its options."""
    deployment = serve.deployment(Recogniser)
    return deployment.options(**options(settings)).bind(asdict(settings.model))
