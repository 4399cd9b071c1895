"""Who watches costs little: a view is small and encoded once, whatever the scene sends."""

import asyncio
import io
import time

import numpy as np
import pytest
from conftest import peer
from PIL import Image
from scene_client import owner_of

from hapticvlm.server.recognition_queue import SHOWN_BYTES
from hapticvlm.vision.worker import SHOWN_PX

ATTEMPTS = 100  # a recogniser that a busy machine starts late refuses pictures until it is there
COMMENT = b"\xff\xfe\xff\xff" + bytes(65533)


def jpeg(width, height, comments=0):
    noise = np.random.default_rng(0).integers(0, 255, (height, width, 3), np.uint8)
    buffer = io.BytesIO()
    Image.fromarray(noise).save(buffer, "JPEG", quality=75)
    data = buffer.getvalue()
    return data[:2] + COMMENT * comments + data[2:]


@pytest.mark.parametrize(
    ("size", "comments"),
    [((1920, 1080), 0), ((256, 192), 40)],
    ids=["a large frame", "a small frame of many bytes"],
)
async def test_a_watched_view_is_small_and_delays_no_touch(service, size, comments):
    width, height = size
    image = jpeg(width, height, comments)
    assert len(image) > 4 * SHOWN_BYTES
    async with peer(service) as client, peer(service, as_text=True) as watching:
        await owner_of(client)
        await watching.hello("observer")
        await watching.ask(type="set", watch=["frames"])
        shape = {"width": size[0], "height": size[1], "origin": "top", "format": "jpeg"}
        frame = {"type": "frame", "object_id": "thing", "image": image, **shape}
        for _ in range(ATTEMPTS):
            answer = await client.ask(captured_at=time.monotonic(), **frame)
            if answer.get("code") != "model":
                break
            await asyncio.sleep(0.5)
        assert answer["type"] == "decision"
        view = await watching.event("view", kind="frames", object_id="thing")
    assert len(view["image"]) < 1.4 * SHOWN_BYTES  # base64
    assert max(size) > SHOWN_PX or comments


async def test_a_mask_that_is_broken_is_named_as_the_mask(service):
    async with peer(service) as client:
        await owner_of(client)
        shape = {"width": 64, "height": 64, "origin": "top", "format": "jpeg"}
        answer = await client.ask(
            type="frame",
            captured_at=time.monotonic(),
            object_id="thing",
            image=jpeg(64, 64),
            mask=b"\x89PNG\r\n\x1a\nand no more",
            **shape,
        )
    assert (answer["type"], answer["path"]) == ("error", "$.mask")
    assert answer["text"].startswith("$.mask")


async def test_gains_outlive_the_scene_that_set_them(service):
    async with peer(service) as client:
        await owner_of(client)
        await client.ask(type="set", thermal_gain=0.0)
    async with peer(service) as client:
        await owner_of(client)
        await client.touch("contact", "kettle")
        decision = await client.event("decision", object_id="kettle")
        assert decision["contact_c"] < 25.0
        assert decision["unlimited_c"] == pytest.approx(32.0)  # neutral
        await client.ask(type="set", thermal_gain=1.0)
