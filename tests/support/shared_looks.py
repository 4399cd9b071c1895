"""A scene that asks a service with a shared recogniser for one picture after another."""

import asyncio
import time
from contextlib import asynccontextmanager

from conftest import peer
from pace import PACE
from scene_client import OBJECTS, frame

PATIENCE_S = 30.0 * PACE
PAUSE_S = 0.025  # a scene's own pace: the service skips what comes faster than 60 pictures a second


@asynccontextmanager
async def scene(service):
    async with peer(service) as client:
        await client.hello()
        await client.ask(type="scene", objects=OBJECTS, ambient_c=21.0, replace=True)
        yield client


async def look(client):
    """Send a new picture of an object that only its picture can tell; return the decision."""
    await asyncio.sleep(PAUSE_S)
    answer = await client.ask(**frame(time.monotonic_ns() % 2**32, object_id="thing"))
    assert answer["type"] == "decision", answer
    return answer


def is_shared(answer):
    return "remote" in answer["stages_ms"] and "encode" not in answer["stages_ms"]


async def until_shared(client, seconds=PATIENCE_S):
    """Look until the shared recogniser answers; return the longest that any look took, ms."""
    started, longest = time.monotonic(), 0.0
    while not is_shared(answer := await look(client)):
        assert time.monotonic() - started < seconds, "it never came back"
        longest = max(longest, recognising_ms(answer))
    return longest


def recognising_ms(answer):
    return sum(answer["stages_ms"].get(stage, 0.0) for stage in ("remote", "encode", "match"))
