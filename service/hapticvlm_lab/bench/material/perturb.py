"""The things that go wrong between an object and its picture, by degrees. Pure.

Each perturbation takes a `Picture`, a severity in the unit that its `Shake` names, and a random
generator, and returns a new picture. Severity 0 changes nothing; the same generator state gives the
same picture again. Lengths are px of a picture whose object is about OBJECT_PX long. Levels are
those of a display (gamma 2.2). Light is linear: it adds up, and a stop of exposure halves it, which
levels do not do. So exposure, reflections and see-through are computed in light.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from io import BytesIO

import numpy as np

from hapticvlm_lab.bench.material.picture import (
    OBJECT_PX,
    Picture,
    Pixels,
    as_float,
    display,
    exposed,
    linear,
    scaled,
    seen_behind,
    shifted,
    where_object,
)

LAMP = (1.0, 0.70, 0.38)  # linear gain of 2700 K light beside daylight, its red kept
NIGHT_STOPS = 4.0  # that night is darker than day
NIGHT_NOISE = 10.0  # grey levels, of a frame lit that little
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
    only: str | None = None  # for this class alone


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


def darken(picture: Picture, stops: float, _: np.random.Generator) -> Picture:
    """Underexpose by so many stops of light."""
    return picture.over(exposed(picture, 2.0**-stops))


def brighten(picture: Picture, stops: float, _: np.random.Generator) -> Picture:
    """Overexpose by so many stops of light; levels above white clip."""
    return picture.over(exposed(picture, 2.0**stops))


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


def move(picture: Picture, length: float, rng: np.random.Generator) -> Picture:
    """Turn the head: blur along a line of so many px, and a mask of a frame as much earlier."""
    from scipy.ndimage import convolve

    angle = rng.uniform(0.0, 2.0 * np.pi)
    # Motion blur is the mean of the picture over a line. The mask belongs to the frame before, so
    # it lags by the length of that line.
    side = 2 * int(np.ceil(length / 2)) + 1
    line = np.zeros((side, side))
    steps = np.linspace(-length / 2, length / 2, 4 * side)
    at = (side // 2 + np.outer((np.sin(angle), np.cos(angle)), steps)).round().astype(int)
    line[np.clip(at[0], 0, side - 1), np.clip(at[1], 0, side - 1)] = 1.0
    smeared = convolve(as_float(picture), (line / line.sum())[..., None], mode="nearest")
    if picture.mask is None:
        return picture.over(smeared)
    lag = (-np.sin(angle) * length, -np.cos(angle) * length)
    return picture.over(smeared, shifted(picture.mask, *lag))


def clutter(picture: Picture, share: float, _: np.random.Generator) -> Picture:
    """Show another picture through the object, as that share of its light."""
    return _mixed_in(picture, seen_behind(picture), share)


def mirror(picture: Picture, share: float, _: np.random.Generator) -> Picture:
    """Put the object among mirrors: that share of its surroundings is its own reflection."""
    flipped = linear(picture.image[:, ::-1])
    mixed = (1.0 - share) * linear(picture.image) + share * flipped
    return picture.over(np.where(where_object(picture)[..., None], picture.image, display(mixed)))


def reflect(picture: Picture, share: float, _: np.random.Generator) -> Picture:
    """Polish the object: that share of its light is a mirror image of other surroundings."""
    return _mixed_in(picture, seen_behind(picture)[:, ::-1], share)


def _mixed_in(picture: Picture, other: Pixels, share: float) -> Picture:
    """Let that share of the object's light be another picture's."""
    mixed = (1.0 - share) * linear(picture.image) + share * linear(other)
    return picture.over(np.where(where_object(picture)[..., None], display(mixed), picture.image))


def nightfall(picture: Picture, share: float, rng: np.random.Generator) -> Picture:
    """Go from day (0) to a lamp at night (1): darker, warmer, noisier."""
    # A camera in little light amplifies its sensor, and its noise with it.
    warm = np.array(LAMP) ** share
    lit = display(linear(picture.image) * warm * 2.0 ** (-NIGHT_STOPS * share))
    return picture.over(lit + rng.normal(0.0, NIGHT_NOISE * share, picture.image.shape))


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
    Shake("dark", darken, (0, 1, 2, 3, 5), "stops under"),
    Shake("bright", brighten, (0, 1, 2, 3, 4), "stops over"),
    Shake("JPEG", jpeg, (0, 50, 75, 90, 97), "100 - quality"),
    Shake("size", shrink, (0, 1, 2, 3, 4), f"halvings of {OBJECT_PX} px"),
    Shake("occlusion", occlude, (0, 0.2, 0.4, 0.6, 0.8), "share covered"),
    Shake("motion", move, (0, 4, 8, 16, 32), "px between frames"),
    Shake("clutter", clutter, (0, 0.25, 0.5, 0.75, 0.9), "of the light, glass alone", only="glass"),
    Shake("mirrors", mirror, (0, 0.25, 0.5, 0.75, 1.0), "of the surroundings"),
    Shake(
        "reflections", reflect, (0, 0.25, 0.5, 0.75, 0.9), "of the light, metal alone", only="metal"
    ),
    Shake("night", nightfall, (0, 0.25, 0.5, 0.75, 1.0), "day 0 to lamp light 1"),
    Shake("stylised", stylise, (0, 0.25, 0.5, 0.75, 1.0), "of it drawn"),
)
