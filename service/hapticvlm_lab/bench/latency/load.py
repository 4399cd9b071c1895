"""A scene in a process of its own that streams different frames at a fixed rate.

`python -m hapticvlm_lab.bench.latency.load URL RATE SECONDS BYTES` prints "streaming" when it
begins.
"""

from __future__ import annotations

import asyncio
import io
import sys
import time

import numpy as np
from PIL import Image

from hapticvlm.client import connect

SIDE = 448
DIFFERENT = 120


def pictures(count: int, size_bytes: int) -> list[bytes]:
    """Return `count` different 448 x 448 JPEGs of about `size_bytes` each."""
    rng = np.random.default_rng(0)
    # JPEG takes more bytes the more grain a picture has: halving finds the grain for the size.
    low = 0.0
    high = 80.0
    for _ in range(7):
        grain = (low + high) / 2
        low, high = (grain, high) if len(_picture(rng, grain)) < size_bytes else (low, grain)
    return [_picture(rng, low) for _ in range(count)]


def _picture(rng: np.random.Generator, grain: float) -> bytes:
    coarse = rng.integers(0, 255, (14, 14, 3), np.uint8)
    smooth = np.asarray(Image.fromarray(coarse).resize((SIDE, SIDE), Image.Resampling.BICUBIC))
    noise = rng.normal(0.0, 1.0, (SIDE, SIDE, 1))
    buffer = io.BytesIO()
    noisy = np.clip(smooth + grain * noise, 0, 255).astype(np.uint8)
    Image.fromarray(noisy).save(buffer, "JPEG", quality=75)
    return buffer.getvalue()


async def send(url: str, rate: float, seconds: float, frames: list[bytes]) -> None:
    """Stream for `seconds`; answers are taken as they come."""
    async with connect(url, name="frame load") as client:
        started = time.monotonic()
        sent = 0
        while (due := sent / rate) < seconds:
            await asyncio.sleep(max(0.0, started + due - time.monotonic()))
            answer = await client.send(
                "frame",
                captured_at=time.monotonic(),
                format="jpeg",
                width=SIDE,
                height=SIDE,
                origin="top",
                image=frames[sent % DIFFERENT],
            )
            answer.add_done_callback(lambda done: done.cancelled() or done.exception())
            sent += 1


if __name__ == "__main__":
    url, rate, seconds, size_bytes = sys.argv[1:]
    frames = pictures(DIFFERENT, int(size_bytes))
    print("streaming", flush=True)
    asyncio.run(send(url, float(rate), float(seconds), frames))
