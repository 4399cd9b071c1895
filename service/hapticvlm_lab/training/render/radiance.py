"""Radiance pictures (.hdr) to arrays. Reads the run-length form every program writes today."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

_SIZE = re.compile(rb"-Y (\d+) \+X (\d+)\n")
_MOST_PIXELS = 1 << 24


def read_radiance(path: Path) -> NDArray[np.float32]:
    """Read a picture as (H, W, 3) float32 linear RGB. Raises ValueError when it is not one."""
    content = path.read_bytes()
    found = _SIZE.search(content)
    if not content.startswith(b"#?") or found is None:
        text = f"{path.name}: no Radiance picture with rows from top to bottom"
        raise ValueError(text)
    height, width = int(found[1]), int(found[2])
    if not 8 <= width < 1 << 15 or height * width > _MOST_PIXELS:
        raise ValueError(f"{path.name}: {width} x {height} px is not supported")
    try:
        planes = _rows(np.frombuffer(content, np.uint8, offset=found.end()), height, width)
    except IndexError as error:
        raise ValueError(f"{path.name}: the picture is cut short") from error
    scale = np.ldexp(np.float32(1), planes[..., 3].astype(np.int32) - 136)
    colour: NDArray[np.float32] = np.multiply(planes[..., :3], scale[..., None], dtype=np.float32)
    return colour


def _rows(stored: NDArray[np.uint8], height: int, width: int) -> NDArray[np.uint8]:
    """Unpack rows of (red, green, blue, exponent) planes: (height, width, 4)."""
    pixels = np.zeros((height, 4, width), np.uint8)
    at = 0
    for row in range(height):
        if stored[at] != 2 or stored[at + 1] != 2:
            raise ValueError("rows without run lengths are not supported")
        at += 4
        for plane in range(4):
            at = _plane(stored, at, pixels[row, plane])
    return pixels.transpose(0, 2, 1)


def _plane(stored: NDArray[np.uint8], at: int, line: NDArray[np.uint8]) -> int:
    """Unpack one plane of a row into `line`; returns where the next begins."""
    filled = 0
    while filled < len(line):
        count = int(stored[at])
        if count > 128:
            line[filled : filled + count - 128] = stored[at + 1]
            filled, at = filled + count - 128, at + 2
        else:
            line[filled : filled + count] = stored[at + 1 : at + 1 + count]
            filled, at = filled + count, at + 1 + max(count, 1)
    return at
