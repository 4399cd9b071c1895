"""Texture maps drawn by arithmetic, and the frame that a scene would send of one."""

from __future__ import annotations

import io

import numpy as np
from PIL import Image

from hapticvlm.messages import Frame, Region
from hapticvlm.vision.pictures import Pixels

SIDE = 256  # px


def planks(side: int = SIDE) -> Pixels:
    """Draw boards with a grain along them: (side, side, 3)."""
    dice = np.random.default_rng(3)
    rows, columns = np.mgrid[0:side, 0:side]
    board = columns // (side // 5)
    rings = np.sin(rows / 40.0 + 0.35 * (columns % (side // 5)) + 5.0 * board)
    streaks = np.repeat(dice.normal(0.0, 1.0, (1, side)), side, axis=0)
    seams = np.where(columns % (side // 5) < 2, -70.0, 0.0)
    level = 10.0 * rings + 14.0 * streaks + seams + dice.normal(0.0, 3.0, (side, side))
    colours = np.array([150.0, 102.0, 58.0]) + np.stack([level, 0.8 * level, 0.6 * level], axis=2)
    return np.asarray(np.clip(colours, 0, 255), np.uint8)


def weave(side: int = SIDE) -> Pixels:
    """Draw blue threads that cross over and under: (side, side, 3)."""
    dice = np.random.default_rng(5)
    rows, columns = np.mgrid[0:side, 0:side]
    thread = side // 32
    is_over = (rows // thread + columns // thread) % 2 == 0
    across = np.where(is_over, rows % thread, columns % thread)
    level = 60.0 * np.sin(np.pi * (across + 0.5) / thread) + dice.normal(0.0, 6.0, (side, side))
    colours = np.array([70.0, 80.0, 120.0]) + level[..., None]
    return np.asarray(np.clip(colours, 0, 255), np.uint8)


def png(pixels: Pixels) -> bytes:
    file = io.BytesIO()
    Image.fromarray(pixels).save(file, "PNG")
    return file.getvalue()


def frame_of(pixels: Pixels, region: Region | None = None) -> Frame:
    return Frame(
        id=1,
        captured_at=0.0,
        format="rgb8",
        width=pixels.shape[1],
        height=pixels.shape[0],
        image=pixels.tobytes(),
        origin="top",
        purpose="texture",
        region=region,
    )
