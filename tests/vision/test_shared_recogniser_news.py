"""A shared recogniser that refuses the token: scene, metrics and log know, with the cure."""

import asyncio
import time

import pytest
from conftest import EVENT_S, peer
from scene_client import OBJECTS, frame, get
from shared_recogniser import shared_recogniser

from hapticvlm.client.local_service import running

pytestmark = [pytest.mark.process, pytest.mark.nightly]


async def test_a_scene_is_told_that_its_shared_recogniser_fails_and_what_can_be_done():
    with shared_recogniser() as shared:
        shared.token = "a token of someone else's"
        with running(["--recogniser-url", shared.url]) as service:
            async with peer(service) as client:
                await client.hello()
                await client.ask(type="scene", objects=OBJECTS, ambient_c=21.0, replace=True)
                async with asyncio.timeout(EVENT_S):
                    while not (
                        errors := [
                            event["text"] for event in client.events if event["type"] == "error"
                        ]
                    ):
                        await client.ask(**frame(time.monotonic_ns() % 2**32, object_id="thing"))
                        await client.telemetry()
                with get(service, "/metrics") as answer:
                    metrics = answer.read().decode()
    assert "the shared recogniser fails" in errors[0]
    assert "HAPTICVLM_RECOGNISER_TOKEN" in errors[0]
    assert "pictures are recognised here" in errors[0]
    assert "hapticvlm_shared_recogniser_failed_total 0.0" not in metrics
