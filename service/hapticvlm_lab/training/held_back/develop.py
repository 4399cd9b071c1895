"""Linear renders to 8-bit pictures: exposure, highlights, tone; JPEG and mask files.

Done as a headset's renderer does it: one exposure for an approach, highlights clipped before
antialiasing (which also tames the path tracer's fireflies), a tone curve, sRGB.
"""

from __future__ import annotations

import struct
import zlib
from io import BytesIO

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from hapticvlm_lab.training.held_back.denoise import denoise
from hapticvlm_lab.training.held_back.surfaces import GREY, Rng, to_srgb

_MOST = 0.85  # share of the object that is exposed below white
_WHITEST = 4.0  # exposed radiance that a film pixel is clipped at
Linear = NDArray[np.float32]
Pixels = NDArray[np.uint8]


def develop(halves: Linear, masks: Linear, rng: Rng) -> Pixels:
    """Turn radiance (2, N, k s, k s, 3) with masks (N, s, s) into pictures (N, s, s, 3) sRGB."""
    factor = halves.shape[2] // masks.shape[1]
    gain = exposure(halves[0, :, ::factor, ::factor], masks, rng)
    clipped = np.minimum(halves * np.float32(gain), _WHITEST)
    small = denoise(_shrunk(clipped[0], factor), _shrunk(clipped[1], factor))
    toned = _filmic(small) if rng.random() < 0.5 else small
    return np.round(to_srgb(toned) * 255).astype(np.uint8)


def exposure(linear: Linear, masks: Linear, rng: Rng) -> float:
    """Bring the geometric mean light of object and picture, half each, to a middle grey.

    Most of the object must stay below white.
    """
    light = linear @ GREY
    weight = masks / max(float(masks.sum()), 1.0) + 1 / masks.size
    logs = np.log(np.maximum(light, 1e-4))
    middle = float(np.exp((logs * weight).sum() / weight.sum()))
    inside = masks >= 0.5
    brightest = float(np.quantile(light[inside] if inside.any() else light, _MOST))
    return min(float(rng.uniform(0.14, 0.26)) / middle, 0.9 / max(brightest, 1e-4))


def jpeg(picture: Pixels, quality: int) -> bytes:
    """Compress (H, W, 3) as baseline JPEG."""
    store = BytesIO()
    Image.fromarray(picture).save(store, "JPEG", quality=quality, optimize=True)
    return store.getvalue()


def mask_png(mask: Linear) -> bytes:
    """Compress (H, W) 0..1 as an 8-bit PNG, 255 where the object covers half a pixel or more.

    Rows are unfiltered, which no option of Pillow allows, and which makes masks a quarter smaller.
    """
    inside = np.where(mask >= 0.5, 255, 0).astype(np.uint8)
    height, width = inside.shape
    rows = np.hstack([np.zeros((height, 1), np.uint8), inside]).tobytes()
    header = struct.pack(">IIBBBBB", width, height, 8, 0, 0, 0, 0)
    chunks = ((b"IHDR", header), (b"IDAT", zlib.compress(rows, 9)), (b"IEND", b""))
    return b"\x89PNG\r\n\x1a\n" + b"".join(_chunk(*chunk) for chunk in chunks)


def _chunk(kind: bytes, content: bytes) -> bytes:
    check = zlib.crc32(kind + content)
    return struct.pack(">I", len(content)) + kind + content + struct.pack(">I", check)


def _shrunk(linear: Linear, factor: int) -> Linear:
    """Average squares of `factor` pixels: (N, k s, k s, 3) to (N, s, s, 3)."""
    count = linear.shape[0]
    side = linear.shape[1] // factor
    small: Linear = linear.reshape(count, side, factor, side, factor, 3).mean(axis=(2, 4))
    return small


def _filmic(linear: Linear) -> Linear:
    """Narkowicz's fit of the ACES curve (2015), scaled to keep middle grey."""
    x = linear * np.float32(0.8)
    return np.asarray(x * (2.51 * x + 0.03) / (x * (2.43 * x + 0.59) + 0.14), np.float32)
