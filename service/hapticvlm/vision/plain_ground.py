"""Outlines the one thing that lies on a plain ground, as catalogue photographs show it. Pure.

The border of such a picture is ground. Its colour at the four sides gives a plane of colours, which
follows light that falls off to one side. Pixels near the plane that are connected with the border
are ground too; the rest is the thing, with all that the ground does not reach inside of it. Narrow
gaps in its contour are closed first, since a highlight on white glass would let the ground in.

Most pictures have no such ground, so an outline must be plausible: nearly all of the border agrees
with the plane, so that the thing hardly touches it, and the thing is in one piece, neither tiny nor
nearly the whole picture. `pages/try.outline.js` does the same in a browser, with the same
constants. Knows no material.
"""

from __future__ import annotations

from io import BytesIO

import msgspec
import numpy as np
from numpy.typing import NDArray

from hapticvlm.messages import Frame
from hapticvlm.statistics import percentile
from hapticvlm.vision import pictures
from hapticvlm.vision.pictures import Pixels

# Our choice; looked at on photographs of the web that nothing else is measured on.
SIDE = 192  # longest side at which the ground is searched, px
SMALLEST = 16  # px a side; smaller pictures have no border worth the name
BORDER = 0.03  # width of the border over the shorter side
SAME = 24.0  # grey levels of one channel, up to which a pixel has the ground's colour
AGREEING = 0.9  # least share of the border that has the ground's colour
GAP = 3  # px at SIDE; contours with gaps up to twice as wide are closed
SHARE = (0.04, 0.75)  # of the picture that the thing covers
IN_ONE = 0.8  # least share of all that is not ground that the largest piece has

_Grid = NDArray[np.bool_]


def outlined(frame: Frame) -> Frame | None:
    """Return the frame with the thing on its plain ground as the mask; None if there is none.

    Raises PictureError.
    """
    mask = outline(pictures.whole(frame, SIDE)[0])
    if mask is None:
        return None
    from PIL import Image

    file = BytesIO()
    size = (frame.width, frame.height)
    Image.fromarray(mask).resize(size, Image.Resampling.NEAREST).save(file, "PNG", compress_level=1)
    return msgspec.structs.replace(frame, mask=file.getvalue(), region=None)


def views(frame: Frame) -> list[Frame]:
    """Return the frame, then the outlined one if it has no mask and shows a thing on plain ground.

    The mean of both recognitions counts: the whole picture shows the thing in its proportions, the
    outlined one is squashed to the crop but shows more of its surface. Raises PictureError.
    """
    thing = outlined(frame) if frame.mask is None else None
    return [frame] if thing is None else [frame, thing]


def outline(pixels: Pixels) -> _Grid | None:
    """Outline the thing in (H, W, 3) uint8 RGB: (h, w) bool, h and w at most SIDE.

    None if the ground is not plain, or what lies on it is not plausibly one thing.
    """
    small = _shrunk(pixels)
    if min(small.shape[:2]) < SMALLEST:
        return None
    width = max(2, round(BORDER * min(small.shape[:2])))
    far = np.abs(small - _ground(small, width)).max(axis=2) > SAME
    border = np.ones(far.shape, bool)
    border[width:-width, width:-width] = False
    if far[border].mean() > 1.0 - AGREEING:
        return None
    thing = _largest(_without_ground(far))
    return thing if thing is not None and SHARE[0] <= thing.mean() <= SHARE[1] else None


def _shrunk(pixels: Pixels) -> NDArray[np.float32]:
    """Shrink to SIDE, each pixel the mean of those it replaces: float32."""
    from PIL import Image

    height, width = pixels.shape[:2]
    scale = min(1.0, SIDE / max(height, width))
    size = (max(1, round(width * scale)), max(1, round(height * scale)))
    image = Image.fromarray(np.ascontiguousarray(pixels)).resize(size, Image.Resampling.BOX)
    return np.asarray(image).astype(np.float32)


def _ground(pixels: NDArray[np.float32], width: int) -> NDArray[np.float32]:
    """Return the plane of colours through the medians of the four sides, (H, W, 3)."""
    # A thing that reaches into a side moves its median only if it covers half of that side.
    sides = (pixels[:width], pixels[-width:], pixels[:, :width], pixels[:, -width:])
    top, bottom, left, right = (percentile(side.reshape(-1, 3), 50.0) for side in sides)
    height, length = pixels.shape[:2]
    v = ((np.arange(height) + 0.5) / height - 0.5)[:, None, None]
    u = ((np.arange(length) + 0.5) / length - 0.5)[None, :, None]
    mean = (top + bottom + left + right) / 4
    plane: NDArray[np.float32] = mean + u * (right - left) + v * (bottom - top)
    return plane


def _without_ground(far: _Grid) -> _Grid:
    """Remove what is connected with the edge, through more than narrow gaps in `far`."""
    pieces = _pieces(~_widened(far))
    edge = np.concatenate([pieces[0], pieces[-1], pieces[:, 0], pieces[:, -1]])
    ground = np.isin(pieces, edge[edge > 0])
    # The contour was widened to close its gaps. The ground grows back by as much.
    return ~_widened(ground)


def _widened(grid: _Grid) -> _Grid:
    """Return the cells that are GAP or less from one of the grid, along both sides."""
    from PIL import Image, ImageFilter

    levels = Image.fromarray(grid.astype(np.uint8))
    return np.asarray(levels.filter(ImageFilter.MaxFilter(2 * GAP + 1))) > 0


def _pieces(grid: _Grid) -> NDArray[np.int64]:
    """Return the number of the piece that each cell is in, from 1 on, or 0; sides connect."""
    numbers = np.zeros(grid.shape, np.int64)
    same = [0]  # a number and one below it, of the same piece
    for row, steps in enumerate(np.diff(np.pad(grid, ((0, 0), (1, 1))).astype(np.int8))):
        begins, ends = (np.flatnonzero(steps == step).tolist() for step in (1, -1))
        for begin, end in zip(begins, ends, strict=True):
            met = {_least(same, n) for n in set(numbers[row - 1, begin:end].tolist()) if n}
            number = min(met, default=len(same))
            if not met:
                same.append(number)
            for other in met:
                same[other] = number
            numbers[row, begin:end] = number
    least = np.array([_least(same, number) for number in range(len(same))])
    return np.unique(least, return_inverse=True)[1][numbers]


def _least(same: list[int], number: int) -> int:
    while same[number] != number:
        number = same[number]
    return number


def _largest(grid: _Grid) -> _Grid | None:
    """Return the largest piece if it is nearly all; None if there are several, or none."""
    pieces = _pieces(grid)
    sizes = np.bincount(pieces.ravel())[1:]
    if sizes.size == 0:
        return None
    if sizes.max() < IN_ONE * sizes.sum():
        return None
    largest: _Grid = pieces == 1 + int(sizes.argmax())
    return largest
