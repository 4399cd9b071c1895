"""Declares the shared recogniser as a Ray Serve deployment, for many nodes and shares of a GPU.

Only this module and `engine_ray` import Ray. Each replica holds one recogniser; Ray fills its
batches, checks its health and replaces it when it hangs.
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
from hapticvlm_recogniser_app.settings import BATCH, WAIT_S, AppSettings, Model, options

logger = logging.getLogger("ray.serve")  # Serve copies this logger into the replica's log


class Recogniser:
    """One replica."""

    def __init__(self, model: dict[str, Any]) -> None:
        """Load the encoder. Raises HapticVLMError, which the deployment reports."""
        self._recogniser = recogniser.Recogniser(Model(**model), self._embed, 2 * BATCH)
        if nice := priority.niceness():
            logger.warning(
                "this replica runs at nice %d, after all other programs of its node: "
                "start each node with RAY_worker_niceness=0",
                nice,
            )

    async def reconfigure(self, live: dict[str, Any]) -> None:
        """Replace the galleries, all or none, while requests are answered.

        Raises HapticVLMError, and nothing has changed then.
        """
        await asyncio.to_thread(self._recogniser.load, live["galleries"])

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
                self._recogniser.tokens.client(request.headers.get("authorization")),
                request.stream(),
            )
        )
        return Response(reply.content, reply.status, media_type=reply.media_type)

    @serve.batch(max_batch_size=BATCH, batch_wait_timeout_s=WAIT_S)  # type: ignore[untyped-decorator]
    async def _embed(self, crops: list[recogniser.PendingCrop]) -> list[Embedded | None]:
        return await self._recogniser.embed(crops)


def build(model: dict[str, Any]) -> serve.Application:
    """Build the application that a Serve config names; options in the config override ours."""
    return application(AppSettings(Model(**model)))


def application(settings: AppSettings) -> serve.Application:
    """Build the application with all its options."""
    deployment = serve.deployment(Recogniser)
    return deployment.options(**options(settings)).bind(asdict(settings.model))
