"""Drawn pictures with and without a thing on a plain ground, each with the thing's true mask."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageFilter

HEIGHT = 240
WIDTH = 320
WHITE = (238, 238, 236)

Pixels = NDArray[np.uint8]
Grid = NDArray[np.bool_]
Picture = tuple[NDArray[np.float64], Grid]


@dataclass(frozen=True, slots=True)
class Ground:
    """Draws a picture and the thing in it; `is_outlined`: the thing must be found."""

    draw: Callable[[], Picture]
    is_outlined: bool


def drawn(name: str) -> tuple[Pixels, Grid]:
    """Return (H, W, 3) RGB with a camera's noise, and the true mask (H, W)."""
    pixels, truth = GROUNDS[name].draw()
    noise = np.random.default_rng(7).normal(0, 2, pixels.shape)
    return np.clip(pixels + noise, 0, 255).astype(np.uint8), truth


def _plain(colour: tuple[float, float, float] = WHITE) -> NDArray[np.float64]:
    return np.full((HEIGHT, WIDTH, 3), colour, np.float64)


def _ellipse(x: float = 0.5, y: float = 0.5, wide: float = 0.22, high: float = 0.3) -> Grid:
    v, u = np.mgrid[:HEIGHT, :WIDTH]
    inside: Grid = ((u / WIDTH - x) / wide) ** 2 + ((v / HEIGHT - y) / high) ** 2 < 1
    return inside


def _thing(ground: NDArray[np.float64], where: Grid, period: float = 5.0) -> Picture:
    """Paint striped wood onto a ground."""
    stripes = 25 * np.sin(np.arange(WIDTH) / period)[None, :, None]
    return np.where(where[..., None], np.array((150, 100, 60)) + stripes, ground), where


def _gradient(fall: float) -> NDArray[np.float64]:
    """Light that falls off from the left to the right, and half as much downwards."""
    v, u = np.mgrid[:HEIGHT, :WIDTH]
    ground: NDArray[np.float64] = _plain() - fall * (u / WIDTH + v / HEIGHT / 2)[..., None]
    return ground


def _shadowed(depth: float) -> Picture:
    shadow = Image.fromarray((255 * _ellipse(0.55, 0.72, 0.26, 0.12)).astype(np.uint8))
    blurred = np.asarray(shadow.filter(ImageFilter.GaussianBlur(8))) / 255.0
    return _thing(_plain() - depth * blurred[..., None], _ellipse())


def _ring() -> Picture:
    return _thing(_plain(), _ellipse() & ~_ellipse(wide=0.12, high=0.16))


def _glass() -> Picture:
    """A white vessel: its contour is dark and has a gap, its inside has the ground's colour."""
    truth = _ellipse()
    contour = truth & ~_ellipse(wide=0.2, high=0.27)
    contour[:, WIDTH // 2 - 3 : WIDTH // 2 + 3] = False
    return np.where(contour[..., None], 90.0, _plain()), truth


def _weave() -> Picture:
    v, u = np.mgrid[:HEIGHT, :WIDTH]
    relief = 45 * np.sin(u / 4) * np.sin(v / 4)
    return _plain((140, 120, 110)) + relief[..., None], np.ones((HEIGHT, WIDTH), bool)


def _clouds() -> Picture:
    """Smooth spots of many sizes, as a wall or a floor has them."""
    rng = np.random.default_rng(3)
    sides = (4, 8, 16, 32)
    spots = [
        np.asarray(
            Image.fromarray(rng.normal(0, 40, (side, side)).astype(np.float32)).resize(
                (WIDTH, HEIGHT), Image.Resampling.BICUBIC
            )
        )
        for side in sides
    ]
    return _plain((128, 128, 128)) + np.sum(spots, axis=0)[..., None], np.ones(
        (HEIGHT, WIDTH), bool
    )


def _half() -> Picture:
    truth = np.zeros((HEIGHT, WIDTH), bool)
    truth[:, WIDTH // 2 :] = True
    return _thing(_plain(), truth)


def _several() -> Picture:
    return _thing(_plain(), _ellipse(0.25, 0.5, 0.12, 0.2) | _ellipse(0.75, 0.5, 0.12, 0.2))


GROUNDS: dict[str, Ground] = {
    "thing": Ground(lambda: _thing(_plain(), _ellipse()), True),
    "to one side": Ground(lambda: _thing(_plain(), _ellipse(0.3, 0.35, 0.18, 0.2)), True),
    "on blue": Ground(lambda: _thing(_plain((60, 90, 170)), _ellipse()), True),
    "gradient ground": Ground(lambda: _thing(_gradient(60), _ellipse()), True),
    "soft shadow": Ground(lambda: _shadowed(18), True),
    "ring": Ground(lambda: (_ring()[0], _ellipse()), True),
    "glass with a gap": Ground(_glass, True),
    "foot at the border": Ground(
        lambda: _thing(_plain(), _ellipse(0.5, 0.75, 0.05, 0.4) | _ellipse(0.5, 0.4)), True
    ),
    "empty": Ground(lambda: (_plain(), np.zeros((HEIGHT, WIDTH), bool)), False),
    "empty with a gradient": Ground(
        lambda: (_gradient(80), np.zeros((HEIGHT, WIDTH), bool)), False
    ),
    "speck": Ground(lambda: _thing(_plain(), _ellipse(0.5, 0.5, 0.03, 0.04)), False),
    "weave that fills the frame": Ground(_weave, False),
    "spots that fill the frame": Ground(_clouds, False),
    "thing that fills the frame": Ground(
        lambda: _thing(_plain(), _ellipse(0.5, 0.5, 0.49, 0.49)), False
    ),
    "thing over the border": Ground(lambda: _thing(_plain(), _ellipse(0.2, 0.5, 0.3, 0.35)), False),
    "half the frame": Ground(_half, False),
    "two things": Ground(_several, False),
}
