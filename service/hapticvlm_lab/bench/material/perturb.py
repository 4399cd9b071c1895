"""The things that go wrong between an object and its picture, by degrees. Pure.

Each perturbation takes a `Picture`, a severity in the unit that its `Shake` names, and a random
generator, and returns a new picture. Severity 0 changes nothing; the same generator state gives the
same picture again. Lengths are px of a picture whose object is about OBJECT_PX long. Light and
weather, and what a headset or a player does to a whole picture, are in `conventions`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from io import BytesIO

import numpy as np

from hapticvlm_lab.bench.material.picture import (
    OBJECT_PX,
    Picture,
    as_float,
    scaled,
    where_object,
)

HAND = (172.0, 128.0, 104.0)  # a hand covers an object most often
EDGE = 30.0  # grey levels of gradient drawn as a full line


Change = Callable[[Picture, float, np.random.Generator], Picture]


@dataclass(frozen=True, slots=True)
class Shake:
    """A perturbation: severities from 0 (nothing) upwards, and their unit."""

    name: str
    change: Change
    severities: tuple[float, ...]
    unit: str


def apply(shake: Shake, picture: Picture, severity: float, seed: int) -> Picture:
    """Change a picture; severity 0 returns it as it is."""
    if severity == 0.0:
        return picture
    return shake.change(picture, severity, np.random.default_rng(seed))


def blur(picture: Picture, sigma: float, _: np.random.Generator) -> Picture:
    """Defocus by a Gaussian of sigma px."""
    from scipy.ndimage import gaussian_filter

    return picture.over(gaussian_filter(as_float(picture), (sigma, sigma, 0)))


def noise(picture: Picture, deviation: float, rng: np.random.Generator) -> Picture:
    """Add independent sensor noise of this standard deviation, grey levels."""
    return picture.over(as_float(picture) + rng.normal(0.0, deviation, picture.image.shape))


def jpeg(picture: Picture, lost: float, _: np.random.Generator) -> Picture:
    """Compress at JPEG quality 100 - lost."""
    from PIL import Image

    store = BytesIO()
    Image.fromarray(picture.image).save(store, "JPEG", quality=max(1, round(100 - lost)))
    return picture.over(np.asarray(Image.open(store), np.float32))


def shrink(picture: Picture, halvings: float, _: np.random.Generator) -> Picture:
    """Move away: halve both sides of picture and mask so often."""
    return scaled(picture, 0.5**halvings)


def occlude(picture: Picture, share: float, rng: np.random.Generator) -> Picture:
    """Cover that share of the object by a hand from one side; the mask does not change."""
    inside = where_object(picture)
    # A straight edge moves over the object until the share is covered: the edge of this direction
    # at the quantile of the object's own pixels.
    y, x = np.nonzero(inside)
    angle = rng.uniform(0.0, 2.0 * np.pi)
    grid_y, grid_x = np.mgrid[: inside.shape[0], : inside.shape[1]]
    along = np.cos(angle) * grid_x + np.sin(angle) * grid_y
    covered = along <= np.quantile(along[y, x], share)
    shade = 0.75 + 0.25 * np.sin(grid_y / 9.0)[..., None]
    return picture.over(np.where(covered[..., None], np.array(HAND) * shade, picture.image))


def stylise(picture: Picture, share: float, _: np.random.Generator) -> Picture:
    """Shade like a drawing, with few levels and dark outlines, blended in by that share."""
    from scipy.ndimage import gaussian_filter, sobel

    smooth = gaussian_filter(as_float(picture), (1.5, 1.5, 0))
    grey = smooth.mean(axis=2)
    edge = np.hypot(sobel(grey, axis=0), sobel(grey, axis=1)) / 4.0
    drawn = np.round(smooth / 85.0) * 85.0 * (1.0 - np.minimum(edge / EDGE, 1.0))[..., None]
    return picture.over((1.0 - share) * as_float(picture) + share * drawn)


SHAKES = (
    Shake("blur", blur, (0, 1, 2, 4, 8), "sigma, px"),
    Shake("noise", noise, (0, 8, 16, 32, 64), "s.d., grey levels"),
    Shake("JPEG", jpeg, (0, 50, 75, 90, 97), "100 - quality"),
    Shake("size", shrink, (0, 1, 2, 3, 4), f"halvings of {OBJECT_PX} px"),
    Shake("occlusion", occlude, (0, 0.2, 0.4, 0.6, 0.8), "share covered"),
    Shake("stylised", stylise, (0, 0.25, 0.5, 0.75, 1.0), "of it drawn"),
)
