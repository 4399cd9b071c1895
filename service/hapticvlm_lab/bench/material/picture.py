"""A decoded picture with its mask, and the operations that perturbations share. Pure."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hapticvlm import messages
from hapticvlm.vision import pictures
from hapticvlm_lab.bench.material.data import View
from hapticvlm_lab.training import crops

Pixels = NDArray[np.uint8]
Floats = NDArray[np.float32]

OBJECT_PX = 160  # length of the object that severities are meant for
AROUND = 0.5  # of the mask's box that is kept on every side of it
GAMMA = 2.2  # of displays


@dataclass(frozen=True, slots=True)
class Picture:
    """image (H, W, 3) uint8 RGB; mask (H, W) uint8 0 or 255, None where none is known.

    behind (H, W, 3) uint8 is another picture, seen through glass where it is asked for.
    """

    image: Pixels
    mask: Pixels | None
    behind: Pixels | None = None

    def over(
        self, image: NDArray[np.floating] | None = None, mask: Pixels | None = None
    ) -> Picture:
        """Return this with another image (any range, rounded to uint8) or mask."""
        pixels = self.image if image is None else _levels(image)
        return Picture(pixels, self.mask if mask is None else mask, self.behind)


def window(view: View) -> Picture:
    """Decode a view, cut to its object with surroundings, and at most OBJECT_PX long.

    Without a mask the whole frame.
    """
    image = pictures.decode_upright(view.frame, 1)
    if view.mask is None:
        return scaled(Picture(image, None), OBJECT_PX / max(image.shape[:2]))
    inside = np.asarray(pictures.decode_mask(view.as_cut("mask"))) > 0
    mask = np.where(inside, 255, 0).astype(np.uint8)
    rows = np.flatnonzero(mask.any(axis=1))
    columns = np.flatnonzero(mask.any(axis=0))
    cut = tuple(
        slice(max(0, int(at[0] - AROUND * len(at))), int(at[-1] + 1 + AROUND * len(at)))
        for at in (rows, columns)
    )
    return scaled(Picture(image[cut], mask[cut]), OBJECT_PX / length_of(mask))


def as_frame(picture: Picture) -> messages.Frame:
    """Wrap a picture as a client sends it: raw pixels, and its mask as PNG."""
    if picture.mask is None:
        return crops.frame(picture.image, region=messages.WHOLE)
    return crops.frame(picture.image, picture.mask > 0)


def as_float(picture: Picture) -> Floats:
    """Return its levels as (H, W, 3) float32, 0..255."""
    return picture.image.astype(np.float32)


def _levels(image: NDArray[np.floating]) -> Pixels:
    rounded: Pixels = np.clip(np.rint(image), 0, 255).astype(np.uint8)
    return rounded


def linear(image: Pixels) -> Floats:
    """Turn levels into light: (H, W, 3) float32, 0..1."""
    return np.asarray((image / np.float32(255.0)) ** np.float32(GAMMA), np.float32)


def display(light: NDArray[np.floating]) -> Floats:
    """Turn light into levels, 0..255; light above white clips."""
    return np.asarray(255.0 * np.clip(light, 0.0, 1.0) ** (1.0 / GAMMA), np.float32)


def exposed(picture: Picture, gain: float) -> Floats:
    """Return its levels with that many times the light."""
    return display(linear(picture.image) * gain)


def where_object(picture: Picture) -> NDArray[np.bool_]:
    """Find the object: under its mask, or in the middle half that the product uses."""
    if picture.mask is not None:
        return picture.mask > 0
    height, width = picture.image.shape[:2]
    inside = np.zeros((height, width), np.bool_)
    inside[height // 4 : height - height // 4, width // 4 : width - width // 4] = True
    return inside


def length_of(mask: Pixels) -> float:
    """Measure the longer side of the mask's box, px."""
    rows = np.flatnonzero(mask.any(axis=1))
    columns = np.flatnonzero(mask.any(axis=0))
    return float(max(rows[-1] - rows[0], columns[-1] - columns[0]) + 1)


def shifted(mask: Pixels, down: float, right: float) -> Pixels:
    """Shift a mask, but never entirely out of the picture."""
    moved = np.zeros_like(mask)
    y, x = np.nonzero(mask)
    y = y + round(down)
    x = x + round(right)
    kept = (y >= 0) & (y < mask.shape[0]) & (x >= 0) & (x < mask.shape[1])
    moved[y[kept], x[kept]] = 255
    return moved if kept.any() else mask


def _one_point(mask: Pixels) -> Pixels:
    """Set the middle of an empty mask: an object too small to mark still has a place."""
    point = mask.copy()
    point[mask.shape[0] // 2, mask.shape[1] // 2] = 255
    return point


def seen_behind(picture: Picture) -> Pixels:
    """Fit the picture behind to this one's size; without one take this one upside down."""
    from PIL import Image

    behind = picture.image[::-1] if picture.behind is None else picture.behind
    size = (picture.image.shape[1], picture.image.shape[0])
    return np.asarray(Image.fromarray(np.ascontiguousarray(behind)).resize(size))


def scaled(picture: Picture, factor: float) -> Picture:
    """Scale down by a factor; never up."""
    from PIL import Image

    if factor >= 1.0:
        return picture
    height, width = picture.image.shape[:2]
    size = (max(1, round(width * factor)), max(1, round(height * factor)))
    image = np.ascontiguousarray(picture.image)
    small = np.asarray(Image.fromarray(image).resize(size, Image.Resampling.BOX))
    if picture.mask is None:
        return Picture(small, None, picture.behind)
    mask = np.asarray(Image.fromarray(picture.mask).resize(size, Image.Resampling.BOX))
    kept = np.where(mask >= 128, 255, 0).astype(np.uint8)
    return Picture(small, kept if kept.any() else _one_point(kept), picture.behind)
