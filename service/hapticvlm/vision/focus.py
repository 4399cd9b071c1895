"""Evens out pictures that are sharp in a few places and blurred in most. Pure.

A headset that saves work draws the middle of its view in full and the rest at a part of the size
(foveated rendering). The encoder learned from pictures of one sharpness. Sharp grain beside smooth
surfaces looks to it like glass or metal, and it is sure and wrong. Such a picture is blurred a
little as a whole, which costs what is fine in the middle, and the encoder is then as often right as
it believes.

In a cell of a few pixels, the largest step between neighbours over the whole range says how sharp
an edge is, whatever its contrast: haze and darkness change nothing. A cell without an edge says
nothing, so smooth things and flat colours are not taken for blurred ones. Pictures that are blurred
everywhere, or along one direction by motion, stay as they are: the encoder is as often right there
as it believes already.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hapticvlm.statistics import percentile

# Our choice, by the decisions on choose_web that survive foveation (training/LOG.md). Levels are
# sums of red, green and blue; a sharpness of 1 is an edge between two pixels.
CELL = 8  # px a side
EDGE = 60  # range of levels above which a cell holds an edge
LEAST = 12  # cells with an edge that a picture is judged by
BLURRED = 0.32  # sharpness of the median cell, below which most of a picture is blurred
SHARP = 0.45  # sharpness of the sharpest cells, above which they are in focus
SHARPEST = 92.0  # percentile that stands for the sharpest cells
ONE_WAY = 0.3  # logarithm of sharpness down over sharpness across, beyond which a picture moved
SPREAD = 1 / 150  # standard deviation of the blur over the side of the picture

_Pixels = NDArray[np.uint8]
_Cells = NDArray[np.float32]


def evened(image: _Pixels, mask: _Pixels) -> _Pixels:
    """Return (S, S, 3) uint8, blurred if it is sharp in a few places of the mask (S, S) only."""
    if not is_uneven(image, mask):
        return image
    from PIL import Image, ImageFilter

    blur = ImageFilter.GaussianBlur(SPREAD * image.shape[0])
    return np.asarray(Image.fromarray(image).filter(blur))


def is_uneven(image: _Pixels, mask: _Pixels) -> bool:
    """Return whether most edges inside the mask are blurred both ways, and a few are sharp."""
    side = mask.shape[0] // CELL * CELL
    part = image[:side, :side]
    levels = part[..., 0].astype(np.int16) + part[..., 1] + part[..., 2]
    inside = mask[CELL // 2 : side : CELL, CELL // 2 : side : CELL] > 0
    down, range_down = (each[inside] for each in _steps(levels))
    turned = _steps(np.ascontiguousarray(levels.T))
    across, range_across = (each.T[inside] for each in turned)
    extent = np.maximum(range_down, range_across)
    has_edge = extent > EDGE
    if np.count_nonzero(has_edge) < LEAST:
        return False
    sharpness = np.maximum(down, across)[has_edge] / extent[has_edge]
    if percentile(sharpness, 50.0) >= BLURRED or percentile(sharpness, SHARPEST) <= SHARP:
        return False
    # Motion blurs the edges across its path alone. Cells with an edge both ways tell it.
    both = (range_down > EDGE) & (range_across > EDGE)
    if np.count_nonzero(both) < LEAST / 2:
        return False
    ratio = (down[both] * range_across[both]) / (range_down[both] * across[both])
    return abs(float(np.log(ratio).mean())) < ONE_WAY


def _steps(levels: NDArray[np.int16]) -> tuple[_Cells, _Cells]:
    """Return the largest step and the largest range down the columns of each cell, (N, N)."""
    # Over the rows of a cell first: numpy reduces long rows fastest, and an eighth is left.
    count = levels.shape[0] // CELL
    rows = levels.reshape(count, CELL, count * CELL)
    steps = np.abs(np.diff(rows, axis=1)).max(axis=1)
    ranges = rows.max(axis=1) - rows.min(axis=1)
    step, extent = (each.reshape(count, count, CELL).max(axis=2) for each in (steps, ranges))
    return step.astype(np.float32), extent.astype(np.float32)
