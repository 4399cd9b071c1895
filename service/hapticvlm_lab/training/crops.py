"""One teaching picture cut to a crop with a mask, as a client might send it. Pure.

Photographs are cut as they are, with a mask that a client could send: the object's outline on a
plain board, else the central disc, the whole crop or a shape. Tiles and boards, which fill the
picture, are lit, bent into shapes and placed before other pictures.
"""

from __future__ import annotations

from io import BytesIO
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image
from scipy import ndimage

from hapticvlm.messages import Frame
from hapticvlm.vision.pictures import central_mask

SIDE = 224  # px of a crop
SMALLEST = 0.25  # least share of a picture that a crop shows
ELONGATION = 0.3  # standard logarithmic elongation of a crop, in either direction
# shares of photographs under the central disc and under no mask at all
DISC = 0.4
WHOLE = 0.25
LEAST_OUTLINE = 0.05  # share of the crop an outline must cover to be of use

Pixels = NDArray[np.uint8]
Cut = tuple[Pixels, Pixels]  # (S, S, 3) RGB and (S, S) mask, 0 or 255


def frame(pixels: Pixels, mask: NDArray[np.bool_] | None = None, **more: Any) -> Frame:
    """Return the frame that a scene would send of RGB pixels (H, W, 3), with a mask (H, W)."""
    png = BytesIO()
    if mask is not None:
        Image.fromarray(np.where(mask, 255, 0).astype(np.uint8)).save(png, "PNG", compress_level=0)
    return Frame(
        id=1, captured_at=0.0, format="rgb8", width=pixels.shape[1], height=pixels.shape[0],
        origin="top", image=pixels.tobytes(), mask=png.getvalue() or None, **more,
    )  # fmt: skip


def photograph(pixels: Pixels, rng: np.random.Generator) -> Cut:
    """Cut a part of a photograph, squashed to a square, with a mask that a client might send."""
    height, width = pixels.shape[:2]
    area = rng.uniform(SMALLEST, 1.0)
    ratio = np.exp(rng.uniform(-ELONGATION, ELONGATION))
    wide = min(width, width * np.sqrt(area * ratio))
    high = min(height, height * np.sqrt(area / ratio))
    left = rng.uniform(0, width - wide + 1e-6)
    top = rng.uniform(0, height - high + 1e-6)
    box = (left, top, min(width, left + wide), min(height, top + high))
    chance = rng.random()
    if chance < DISC:
        mask = central_mask(SIDE)
    elif chance < DISC + WHOLE:
        mask = np.full((SIDE, SIDE), 255, np.uint8)
    else:
        mask = shape(rng)
    return _resize(pixels, box), mask


def on_board(pixels: Pixels, rng: np.random.Generator) -> Cut:
    """Cut the object that lies on a plain board, with its outline as the mask."""
    outline = _outline(pixels)
    height, width = pixels.shape[:2]
    rows = np.flatnonzero(outline.any(axis=1))
    columns = np.flatnonzero(outline.any(axis=0))
    span = max(rows[-1] - rows[0], columns[-1] - columns[0]) * rng.uniform(0.6, 1.3)
    span = float(np.clip(span, 32, min(height, width)))
    middle = ((rows[0] + rows[-1]) / 2, (columns[0] + columns[-1]) / 2)
    top = np.clip(middle[0] - span / 2 + rng.normal(0, span / 12), 0, height - span)
    left = np.clip(middle[1] - span / 2 + rng.normal(0, span / 12), 0, width - span)
    box = (left, top, left + span, top + span)
    image = _resize(pixels, box)
    mask = _resize(outline, box) > 127
    if mask.mean() > LEAST_OUTLINE:
        return image, np.where(mask, 255, 0).astype(np.uint8)
    return image, central_mask(SIDE)


def dress(texture: Pixels, behind: Pixels, rng: np.random.Generator) -> Cut:
    """Give a flat texture a shape, light and a picture behind it."""
    mask = shape(rng) if rng.random() < 0.7 else np.full((SIDE, SIDE), 255, np.uint8)
    span = min(texture.shape[:2]) * rng.uniform(0.4, 1.0)
    top = rng.uniform(0, texture.shape[0] - span)
    left = rng.uniform(0, texture.shape[1] - span)
    surface = _resize(texture, (left, top, left + span, top + span))
    surface = np.rot90(surface, int(rng.integers(4)))
    axis = np.linspace(-1, 1, SIDE)
    slope = rng.normal(0, 0.3, 2)
    ramp = 1 + slope[0] * axis[:, None] + slope[1] * axis[None, :]
    ramp = ramp - rng.uniform(0, 0.5) * (axis[:, None] ** 2 + axis[None, :] ** 2)
    lit = surface * np.clip(ramp, 0.15, 2.0)[..., None]
    edge = min(behind.shape[:2])
    ground = _resize(behind, (0, 0, edge, edge))
    image = np.where(mask[..., None] > 0, lit, ground)
    return np.clip(image, 0, 255).astype(np.uint8), mask


def shape(rng: np.random.Generator) -> Pixels:
    """Draw a turned ellipse or box covering much of the crop: (SIDE, SIDE) uint8, 0 or 255."""
    y, x = np.mgrid[0:SIDE, 0:SIDE] / SIDE - 0.5
    angle = rng.uniform(0, np.pi)
    u = x * np.cos(angle) + y * np.sin(angle)
    v = y * np.cos(angle) - x * np.sin(angle)
    a, b = rng.uniform(0.25, 0.55, 2)
    power = float(rng.choice([2.0, 2.0, 6.0]))
    return np.where(np.abs(u / a) ** power + np.abs(v / b) ** power <= 1, 255, 0).astype(np.uint8)


def _outline(pixels: Pixels) -> Pixels:
    """Find the object on a plain board: the region unlike the border's colour, filled."""
    border = np.concatenate([pixels[:6].reshape(-1, 3), pixels[-6:].reshape(-1, 3)])
    far = np.abs(pixels.astype(np.float32) - np.median(border, axis=0)).max(axis=2)
    near = ndimage.binary_closing(ndimage.gaussian_filter(far, 2) > 22, iterations=9)
    regions, count = ndimage.label(ndimage.binary_fill_holes(near))
    if not count:
        return np.full(pixels.shape[:2], 255, np.uint8)
    largest = 1 + int(np.argmax(np.bincount(regions.ravel())[1:]))
    return np.where(regions == largest, 255, 0).astype(np.uint8)


def _resize(pixels: Pixels, box: tuple[float, float, float, float]) -> Pixels:
    image = Image.fromarray(pixels).resize((SIDE, SIDE), Image.Resampling.BICUBIC, box=box)
    return np.asarray(image)
