"""The named shapes of the held-back set: vessels, bars, sheets, cloths, lumps; seeded.

Every shape is offered to every class, so that no shape reveals its material. Independent of
materials.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from hapticvlm_lab.training.held_back import vessels
from hapticvlm_lab.training.held_back.meshes import (
    Array,
    Mesh,
    any_rotation,
    box_mapped,
    cube_sphere,
    fitted,
    join,
    moved,
    outwards,
    rotation,
    sheet,
)

Rng = np.random.Generator
X, Y, Z = np.eye(3)
ORIGIN = np.zeros(3)


def make(name: str, rng: Rng) -> Mesh:
    """Build a shape by its name, turned about y, fitted to a bounding radius of 1."""
    mesh = outwards(SHAPES[name](rng))
    return fitted([moved(mesh, rotation(Y, rng.uniform(0, 2 * np.pi)), ORIGIN)])[0]


def _rounded(half: Array, bevel: float) -> Mesh:
    """Round the edges of a box of half sizes; its texture keeps its scale."""
    core = np.maximum(half - bevel, 1e-3)

    def warp(cube: Array) -> Array:
        out = cube * half
        inside = np.clip(out, -core, core)
        away = out - inside
        length = np.maximum(np.linalg.norm(away, axis=1, keepdims=True), 1e-9)
        return np.asarray(inside + away / length * np.minimum(length, bevel))

    return box_mapped(cube_sphere(warp, 16))


def _box(rng: Rng) -> Mesh:
    return _rounded(rng.uniform(0.45, 0.8, 3), rng.uniform(0.02, 0.12))


def _bar(rng: Rng) -> Mesh:
    half = np.array([1.0, rng.uniform(0.12, 0.3), rng.uniform(0.15, 0.35)])
    return moved(_rounded(half, 0.03), rotation(Z, rng.uniform(-0.3, 1.0)), ORIGIN)


def _slab(rng: Rng) -> Mesh:
    half = np.array([rng.uniform(0.6, 0.9), rng.uniform(0.6, 0.9), rng.uniform(0.05, 0.1)])
    return moved(_rounded(half, 0.02), rotation(X, rng.uniform(-1.3, 0.0)), ORIGIN)


def _stack(rng: Rng) -> Mesh:
    """Put boxes on each other: blocks, books, bricks."""
    boxes = []
    top = 0.0
    for _ in range(int(rng.integers(2, 4))):
        half = rng.uniform([0.5, 0.15, 0.4], [0.75, 0.3, 0.6])
        turn = rotation(Y, rng.uniform(-0.4, 0.4))
        boxes.append(moved(_rounded(half, 0.03), turn, np.array([0, top + half[1], 0])))
        top += 2 * half[1]
    return join(boxes)


def _ball(rng: Rng) -> Mesh:
    squash = rng.uniform(0.75, 1.0)
    ball = cube_sphere(lambda p: p / np.linalg.norm(p, axis=1, keepdims=True) * [1, squash, 1])
    return moved(ball, any_rotation(rng), ORIGIN)


def _lump(rng: Rng) -> Mesh:
    """Draw low waves on a sphere: a stone, a piece of bread, a carved knob."""
    k = rng.normal(size=(7, 3)) * 1.9
    phase = rng.uniform(0, 6.28, 7)

    def warp(p: Array) -> Array:
        unit = p / np.linalg.norm(p, axis=1, keepdims=True)
        waves: Array = np.sin(unit @ k.T + phase).sum(axis=1, keepdims=True)
        return np.asarray(unit * (1 + 0.09 * waves) * [1, 0.8, 0.9])

    return moved(cube_sphere(warp, 32), any_rotation(rng), ORIGIN)


def _cushion(rng: Rng) -> Mesh:
    """Bulge a square and draw its edges in: a pillow."""
    flat = rng.uniform(0.28, 0.42)

    def warp(p: Array) -> Array:
        u = p[:, 0]
        v = p[:, 2]
        bulge = (1 - np.abs(u) ** 4) * (1 - np.abs(v) ** 4)
        thin = 0.04 + (flat - 0.04) * np.sqrt(np.clip(bulge, 0, 1))
        x = u * (1 - 0.1 * (1 - v**2))
        z = v * (1 - 0.1 * (1 - u**2))
        return np.stack([x, p[:, 1] * thin, z], -1)

    return moved(cube_sphere(warp, 28), rotation(X, rng.uniform(0.0, 1.3)), ORIGIN)


def _curtain(rng: Rng) -> Mesh:
    folds = rng.uniform(3, 6)
    phase = rng.uniform(0, 6.28, 3)

    def height(flat: Array) -> Array:
        x = flat[:, 0]
        z = flat[:, 1]
        fold = np.sin(folds * x + phase[0] + 0.5 * np.sin(1.3 * z + phase[1]))
        return np.asarray(0.13 * fold + 0.04 * np.sin(2.1 * folds * x + phase[2] + z))

    return moved(sheet(height, (0.9, 0.9), 96), rotation(X, -np.pi / 2), ORIGIN)


def _drape(rng: Rng) -> Mesh:
    """Drape cloth, foil or paper over something round."""
    folds = int(rng.integers(5, 9))
    phase = rng.uniform(0, 6.28)

    def height(flat: Array) -> Array:
        r = np.linalg.norm(flat, axis=1)
        angle = np.arctan2(flat[:, 1], flat[:, 0])
        dome = 0.9 * np.exp(-((np.maximum(r - 0.5, 0) / 0.32) ** 2))
        folded = np.clip(r - 0.45, 0, 0.45) * np.sin(folds * angle + phase + r)
        return np.asarray(dome + 0.16 * folded)

    return sheet(height, (1.0, 1.0), 110)


def _crumpled(rng: Rng) -> Mesh:
    """Crease a sheet along a few directions, as if crumpled and laid out again."""
    k = rng.normal(size=(9, 2)) * 2.6
    phase = rng.uniform(0, 6.28, 9)

    def height(flat: Array) -> Array:
        creases = np.abs(np.sin(flat @ k.T + phase))
        return np.asarray(0.075 * (creases - 0.6).sum(axis=1))

    lean = rotation(X, rng.uniform(-1.2, -0.2))
    return moved(sheet(height, (0.9, 0.7), 110), lean, ORIGIN)


def _leaves(rng: Rng) -> Mesh:
    """Put bent leaves round a centre: a bush."""
    leaves = []
    for _ in range(int(rng.integers(90, 150))):
        away = rng.normal(size=3)
        away[1] = abs(away[1]) * 0.9
        place = away / np.linalg.norm(away) * rng.uniform(0.35, 0.8)
        leaves.append(moved(_leaf(rng), any_rotation(rng), place))
    return join(leaves)


def _leaf(rng: Rng) -> Mesh:
    """Narrow and bend a sheet; its uv run once over 0..1."""
    half = (0.09, rng.uniform(0.16, 0.24))
    bend = rng.uniform(1, 4)
    blade = sheet(lambda p: np.asarray(-bend * p[:, 1] ** 2 - 3 * p[:, 0] ** 2), half, 9)
    x, y, z = blade.points.T
    narrow = np.stack([x * np.sqrt(np.clip(1 - (z / half[1]) ** 2, 0, 1)), y, z], -1)
    low = blade.uv.min(axis=0)
    high = blade.uv.max(axis=0)
    return replace(blade, points=narrow, uv=(blade.uv - low) / (high - low))


SHAPES: dict[str, Callable[[Rng], Mesh]] = {
    "vase": vessels.vase,
    "box": _box,
    "ball": _ball,
    "curtain": _curtain,
    "tumbler": vessels.tumbler,
    "bar": _bar,
    "lump": _lump,
    "plate": vessels.plate,
    "ring": vessels.ring,
    "cushion": _cushion,
    "bowl": vessels.bowl,
    "slab": _slab,
    "drape": _drape,
    "bottle": vessels.bottle,
    "cylinder": vessels.cylinder,
    "stack": _stack,
    "goblet": vessels.goblet,
    "pipe": vessels.pipe,
    "crumpled": _crumpled,
    "leaves": _leaves,
}
COMMON = tuple(name for name in SHAPES if name != "leaves")
