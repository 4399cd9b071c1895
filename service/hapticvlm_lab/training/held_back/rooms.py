"""The surroundings of an object: held-back skies, and rooms drawn as environment maps.

A room is a box with textured walls, lit windows and lamps, projected from its inside in every
direction; it lights a scene with little noise. Independent of any renderer.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from hapticvlm_lab.training.held_back.catalogue import Catalogue
from hapticvlm_lab.training.held_back.surfaces import Map, Rng, read_map, to_linear

HEIGHT = 384  # px; twice as wide
_WALLS = ("fabric", "wood", "stone", "ceramic", "paper", "metal")
_CEILING = 3  # number of the wall at +y
_BAR = 0.05  # half width of a window's bar, of the window's
Array = NDArray[np.float64]


def read_sky(path: Path) -> Map:
    """Read a Radiance .hdr map as (H, W, 3) float32 linear radiance, without hot pixels."""
    import mitsuba

    sky = np.array(mitsuba.Bitmap(str(path)), np.float32)[..., :3]
    # A sun of thousands in one pixel is all noise at a few samples a pixel.
    return np.clip(np.nan_to_num(sky), 0, 60 * float(sky.mean()))


def draw_room(rng: Rng, catalogue: Catalogue) -> Map:
    """Draw a room as an environment map (HEIGHT, 2 HEIGHT, 3) float32 linear radiance."""
    half = np.array([rng.uniform(2, 4), rng.uniform(1.2, 1.7), rng.uniform(2, 4)])
    eye = half * rng.uniform([-0.4, -0.3, -0.4], [0.4, 0.1, 0.4])
    direction = _directions()
    distance = np.where(direction > 0, half - eye, half + eye) / np.maximum(np.abs(direction), 1e-6)
    axis = distance.argmin(axis=-1)
    place = eye + direction * distance.min(axis=-1)[..., None]
    wall = axis * 2 + (np.take_along_axis(direction, axis[..., None], -1)[..., 0] > 0)
    room = np.zeros(direction.shape, np.float32)
    brightness = rng.uniform(0.15, 0.5)
    for number in range(6):
        here = wall == number
        at = np.delete(place[here], number // 2, axis=1)
        size = np.delete(half, number // 2)
        plain = number == _CEILING
        painted = brightness * _paper(rng, catalogue, at, plain=plain)
        room[here] = _lit(rng, painted, at / size, least=int(plain))
    return room


def _directions() -> Array:
    polar = (np.arange(HEIGHT) + 0.5) / HEIGHT * np.pi
    around = (np.arange(2 * HEIGHT) + 0.5) / HEIGHT * np.pi
    sine = np.sin(polar)[:, None]
    up = np.cos(polar)[:, None]
    parts = np.broadcast_arrays(sine * np.sin(around), up, -sine * np.cos(around))
    return np.stack(parts, -1)


def _paper(rng: Rng, catalogue: Catalogue, at: Array, *, plain: bool) -> Map:
    """Colour the points (N, 2) of a wall in metres: plain paint, or a texture."""
    if plain or rng.random() < 0.4:
        tone = np.clip(rng.uniform(0.35, 0.9) * (1 + rng.normal(0, 0.12, 3)), 0.05, 0.95)
        return np.broadcast_to(tone, (len(at), 3)).astype(np.float32)
    pool = catalogue.textures[_WALLS[int(rng.integers(len(_WALLS)))]]
    texture = read_map(pool[int(rng.integers(len(pool)))].maps["albedo"])
    cell = np.floor((at / rng.uniform(0.8, 2.0)) % 1.0 * texture.shape[0]).astype(int)
    return to_linear(texture[cell[:, 1], cell[:, 0]])


def _lit(rng: Rng, wall: Map, at: Array, *, least: int) -> Map:
    """Put up to two windows or lamps on a wall (N, 3), whose points `at` (N, 2) are in -1..1."""
    lit = wall.copy()
    for _ in range(int(rng.integers(least, 3))):
        centre = rng.uniform(-0.6, 0.6, 2)
        half = rng.uniform(0.1, 0.35, 2)
        inside = (np.abs(at - centre) < half).all(axis=1)
        warm = np.array([1.0, rng.uniform(0.8, 1.0), rng.uniform(0.55, 1.1)])
        panes = np.abs((at[inside, 0] - centre[0]) / half[0]) > _BAR
        lit[inside] = rng.uniform(3, 14) * warm * panes[:, None] + 0.05
    return lit
