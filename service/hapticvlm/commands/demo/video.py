"""Writes pictures and sound as one WebM file: VP8 and Opus, which every browser plays."""

from __future__ import annotations

from collections.abc import Iterable
from fractions import Fraction
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from hapticvlm.rendering.vibration import RATE_HZ

if TYPE_CHECKING:
    import av

_BITS_PER_S = 1_500_000


def write(
    path: Path, pictures: Iterable[Image.Image], rate_hz: int, wave: NDArray[np.float32]
) -> None:
    """Write pictures of one size and (N,) float32 at RATE_HZ. Raises OSError."""
    import av

    with av.open(str(path), "w", format="webm") as file:
        video = file.add_stream("libvpx", rate=rate_hz)
        video.pix_fmt, video.bit_rate = "yuv420p", _BITS_PER_S
        video.options = {"deadline": "realtime", "cpu-used": "6"}
        audio = file.add_stream("libopus", rate=RATE_HZ)
        audio.layout = "mono"
        for number, picture in enumerate(pictures):
            if number == 0:
                video.width, video.height = picture.size
            frame = av.VideoFrame.from_ndarray(np.asarray(picture), format="rgb24")
            frame.pts, frame.time_base = number, Fraction(1, rate_hz)
            file.mux(video.encode(frame))
            begin, end = (round(at * RATE_HZ / rate_hz) for at in (number, number + 1))
            file.mux(audio.encode(_sound(wave, begin, end)))
        file.mux(video.encode(None))
        file.mux(audio.encode(None))


def _sound(wave: NDArray[np.float32], begin: int, end: int) -> av.AudioFrame:
    """Make samples `begin` to `end` a frame; silence past the end."""
    import av

    samples = np.zeros((1, end - begin), np.float32)
    part = wave[begin:end]
    samples[0, : part.size] = np.clip(part, -1.0, 1.0)
    frame = av.AudioFrame.from_ndarray(samples, format="fltp", layout="mono")
    frame.sample_rate, frame.pts, frame.time_base = RATE_HZ, begin, Fraction(1, RATE_HZ)
    return frame
