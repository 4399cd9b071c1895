"""Finds the uniform bars that a player or a headset's mirror puts beside a picture. Pure.

Bars are of one colour, lie on two opposite sides, are about equally wide, and end in a straight
line across the whole picture. The ground of a catalogue photograph is uniform too, but the thing on
it rarely reaches from side to side.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hapticvlm.vision.pictures import Pixels

# Our choice, looked at on letterboxed photographs.
UNIFORM = 10  # grey levels within a row of a bar; JPEG leaves a few
DIFFERS = 12  # grey levels from the bar's colour of a pixel of the picture
ACROSS = 0.6  # share of the pixels beside a bar that must differ from it
EDGE = 17  # px within which JPEG blurs the line between bar and picture: a block of colour
LEAST = 0.02  # of the side that a bar covers
MOST = 0.7  # of the side that both cover
UNEQUAL = 0.04  # of the side by which the two may differ

Box = tuple[int, int, int, int]


def content_box(pixels: Pixels) -> Box | None:
    """Return what lies between the bars of (H, W, 3) uint8, as (left, top, right, bottom) px.

    None: it has no bars.
    """
    rows = _between(pixels)
    top, bottom = rows or (0, pixels.shape[0])
    columns = _between(pixels[top:bottom].transpose(1, 0, 2))
    if rows is None and columns is None:
        return None
    left, right = columns or (0, pixels.shape[1])
    return left, top, right, bottom


def _between(pixels: Pixels) -> tuple[int, int] | None:
    """Return the first and the last row, exclusive, between two bars of rows."""
    height = pixels.shape[0]
    low = pixels.min(axis=1).astype(np.int16)
    high = pixels.max(axis=1).astype(np.int16)
    colour = (low[0] + high[0]) // 2
    first = _bar(low, high, colour)
    last = _bar(low[::-1], high[::-1], colour)
    least = max(2.0, LEAST * height)
    if min(first, last) < least or first + last > MOST * height:
        return None
    if abs(first - last) > max(2.0, UNEQUAL * height):
        return None
    above = _edge(pixels, first, colour)
    below = _edge(pixels[::-1], last, colour)
    return None if above is None or below is None else (above, height - below)


def _bar(low: NDArray[np.int16], high: NDArray[np.int16], colour: NDArray[np.int16]) -> int:
    """Count the rows from the first on that are of this colour alone."""
    is_bar = ((high - low <= UNIFORM) & (np.abs((low + high) // 2 - colour) <= UNIFORM)).all(axis=1)
    return len(is_bar) if is_bar.all() else int(np.argmin(is_bar))


def _edge(pixels: Pixels, first: int, colour: NDArray[np.int16]) -> int | None:
    """Return the first row of the picture; None if it differs from the bar in parts only."""
    for row in range(first, min(first + EDGE, pixels.shape[0])):
        away = np.abs(pixels[row].astype(np.int16) - colour).max(axis=1)
        if np.mean(away > DIFFERS) >= ACROSS:
            return row
    return None
