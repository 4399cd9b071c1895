"""Procedural textures that tile: noise, streaks, cells, weaves, grooves.

Every pattern is (side, side) float32 in 0..1 and continues over its edges. Independent of
materials.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Plane = NDArray[np.float32]
SIDE = 384
_NEIGHBOURS = 2


def noise(rng: np.random.Generator, slope: float = 1.0, stretch: float = 1.0) -> Plane:
    """Noise whose amplitude falls with frequency ** slope; `stretch` > 1 draws it out along x."""
    frequency = np.fft.fftfreq(SIDE, 1 / SIDE)
    distance = np.hypot(frequency[:, None], frequency[None, :] * stretch)
    amplitude = 1 / np.maximum(distance, 1.0) ** slope
    amplitude[0, 0] = 0.0
    phases = np.exp(2j * np.pi * rng.random((SIDE, SIDE)))
    return _level(np.real(np.fft.ifft2(amplitude * phases)))


def streaks(rng: np.random.Generator) -> Plane:
    """Fine scratches along x, as brushing leaves them."""
    return noise(rng, 0.4, 40.0)


def cells(rng: np.random.Generator, count: int) -> tuple[Plane, Plane]:
    """Return the distance to the nearest of `count` points, and to the border between two."""
    from scipy.spatial import cKDTree

    tree = cKDTree(rng.random((count, 2)), boxsize=1.0)
    axis = (np.arange(SIDE) + 0.5) / SIDE
    grid = np.stack(np.meshgrid(axis, axis, indexing="ij"), -1)
    near, _ = tree.query(grid, k=_NEIGHBOURS)
    return _level(near[..., 0]), _level(near[..., 1] - near[..., 0])


def weave(threads: int, step: int = 1) -> Plane:
    """Heights of a cloth: over and under, each row shifted by `step` threads (2: twill)."""
    axis = np.arange(SIDE) * threads / SIDE
    row = np.floor(axis)[:, None]
    column = np.floor(axis)[None, :]
    over = (row * step + column) % (step + 1) < step
    across = np.abs(np.sin(np.pi * axis))
    warp = across[None, :] * (0.6 + 0.4 * across[:, None])
    weft = across[:, None] * (0.6 + 0.4 * across[None, :])
    return _level(np.where(over, warp, weft))


def knit(loops: int) -> Plane:
    """Heights of a knitted cloth: columns of leaning stitches."""
    y, x = np.mgrid[0:SIDE, 0:SIDE] * (loops / SIDE)
    side = np.abs(2 * (x % 1) - 1)
    stitch = np.abs(np.sin(np.pi * (y + 0.7 * side)))
    return _level(np.sqrt(np.clip(1 - side**2, 0, 1)) * (0.35 + 0.65 * stitch))


def grooves(count: int, sharpness: float = 1.0) -> Plane:
    """Ridges along y: `sharpness` below 1 makes them flat-topped."""
    wave = np.abs(np.sin(np.pi * np.arange(SIDE) * count / SIDE)) ** sharpness
    return np.broadcast_to(wave.astype(np.float32), (SIDE, SIDE)).copy()


def leaf(rng: np.random.Generator) -> Plane:
    """Draw a leaf's veins: 1 on the rib along y and on the ribs that leave it, 0 between."""
    y, x = np.mgrid[0:SIDE, 0:SIDE] / SIDE
    off = np.abs(x - 0.5)
    side = np.abs(np.sin(np.pi * rng.integers(6, 11) * (y - 0.9 * off)))
    lines = np.exp(-((off / 0.015) ** 2)) + 0.5 * np.exp(-((side / 0.12) ** 2))
    return np.asarray(np.clip(lines, 0, 1), np.float32)


def print_lines(rng: np.random.Generator) -> Plane:
    """Print a page: 0 where ink is, in lines of words and two grey pictures."""
    page = np.ones((SIDE, SIDE), np.float32)
    for top in range(6, SIDE - 6, 8):
        left = 10
        while left < SIDE - 14:
            width = int(rng.integers(6, 28))
            page[top : top + 4, left : min(left + width, SIDE - 10)] = rng.uniform(0.1, 0.3)
            left += width + 5
    for _ in range(2):
        top, left = rng.integers(10, SIDE - 130, 2)
        page[top : top + 110, left : left + 110] = 0.2 + 0.6 * noise(rng, 1.6)[:110, :110]
    return page


def _level(values: NDArray[np.float64]) -> Plane:
    """Stretch to 0..1 between the 0.5 and 99.5 percentiles."""
    low, high = np.percentile(values, [0.5, 99.5])
    return np.asarray(np.clip((values - low) / max(high - low, 1e-9), 0, 1), np.float32)
