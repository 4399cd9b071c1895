"""Thin, soft bodies: curtains, cloths, cushions, rugs, paper."""

from __future__ import annotations

import numpy as np

from hapticvlm_lab.training.render.bodies.body import Body, lying, standing
from hapticvlm_lab.training.render.bodies.solids import spherical
from hapticvlm_lab.training.render.dice import Dice
from hapticvlm_lab.training.render.mesh import (
    Floats,
    Mesh,
    faceted,
    fitted,
    floats,
    joined,
    patch,
    placed,
)


def _square(rows: int, columns: int) -> tuple[Floats, Floats]:
    """Coordinates x rightwards and z towards the viewer, -1 to 1: (rows, columns) each."""
    x, z = np.meshgrid(np.linspace(-1, 1, columns), np.linspace(-1, 1, rows))
    return x.astype(np.float32), z.astype(np.float32)


def _waves(dice: Dice, x: Floats, z: Floats, height: float, count: int = 5) -> Floats:
    """Soft bumps and folds of about this height."""
    total = np.zeros_like(x)
    for _ in range(count):
        angle, knots = dice.uniform(0, 3.14), dice.uniform(1, 6)
        bend = 0.3 * np.sin(2 * z + dice.uniform(0, 6))
        phase = knots * (np.cos(angle) * x + np.sin(angle) * z + bend)
        total = total + height / knots**0.7 * np.sin(phase + dice.uniform(0, 6))
    return total.astype(np.float32)


def curtain(dice: Dice) -> Body:
    """Make a hanging cloth with upright folds."""
    x, y = _square(24, 90)
    knots, deep = dice.uniform(3, 14), dice.uniform(0.03, 0.16)
    drawn = x + 0.12 * np.sin(3 * x + dice.uniform(0, 6)) + 0.05 * y * np.sin(2 * x)
    folds = np.sin(knots * drawn * np.pi + 0.4 * np.sin(knots * 0.37 * x + y * dice.uniform(0, 1)))
    z = deep * folds * (0.6 + 0.25 * (y + 1)) + _waves(dice, x, y, 0.02)
    wide = dice.uniform(0.5, 1)
    mesh = patch(np.stack([x * wide, -y, z], -1))
    return Body(fitted(mesh), upright=True, open=True, fills=dice.chance(0.4))


def flag(dice: Dice) -> Body:
    """Make a loose cloth, waving or thrown down."""
    x, z = _square(44, 44)
    y = _waves(dice, x, z, dice.uniform(0.1, 0.28))
    wide = dice.uniform(0.5, 1)
    return lying(patch(np.stack([x * wide, y, z], -1)), open_=True)


def tablecloth(dice: Dice) -> Body:
    """Make a cloth over a round or square table: flat top, folds around."""
    x, z = _square(64, 64)
    round_table, size = dice.chance(0.5), dice.uniform(0.4, 0.65)
    reach = np.hypot(x, z) if round_table else np.maximum(np.abs(x), np.abs(z))
    over = np.maximum(reach - size, 0)
    angle = np.arctan2(z, x)
    folds = np.sin(angle * dice.integer(6, 16) + dice.uniform(0, 6)) * 0.5 + 0.5
    spread = 0.25 + dice.uniform(0.2, 0.6) * folds
    shrink = np.where(over > 0, (size + over * spread) / np.maximum(reach, 1e-6), 1.0)
    fall = over * np.sqrt(np.maximum(1 - spread**2, 0.05))
    y = -fall + _waves(dice, x, z, 0.012)
    return standing(patch(np.stack([x * shrink, y, z * shrink], -1)), open_=True)


def draped(dice: Dice) -> Body:
    """Make a cloth thrown over something lumpy."""
    x, z = _square(64, 64)
    y = np.full_like(x, -0.6)
    for _ in range(dice.integer(1, 3)):
        cx, cz, size = dice.normal(0.25), dice.normal(0.25), dice.uniform(0.25, 0.6)
        lump = dice.uniform(0.4, 1.0) / (1 + np.exp((np.hypot(x - cx, z - cz) - size) * 12)) - 0.6
        y = np.maximum(y, lump)
    for _ in range(4):
        around = [np.roll(y, step, axis) for step in (1, -1) for axis in (0, 1)]
        y = floats((y + sum(around)) / 5)
    y = y + _waves(dice, x, z, dice.uniform(0.02, 0.08), 9)
    return standing(patch(np.stack([x, y, z], -1).astype(np.float32)), open_=True)


def cushion(dice: Dice) -> Body:
    """Make a cushion: two sheets sewn together and filled, with creases."""
    x, z = _square(40, 40)
    rim = np.clip((1 - x**2) * (1 - z**2), 0, 1)
    thick = dice.uniform(0.25, 0.5) * rim ** dice.uniform(0.35, 0.6)
    pull = 1 - 0.12 * (1 - np.abs(z)) * dice.uniform(0, 1)
    sides = []
    for side in (1, -1):
        y = side * thick + _waves(dice, x, z, 0.02, 7) * rim**0.3
        points = np.stack([-x * pull * side, y, z], -1)
        sides.append(patch(points))
    mesh = joined(sides)
    return lying(mesh) if dice.chance(0.5) else standing(mesh)


def rug(dice: Dice) -> Body:
    """Make a rug or mat, nearly flat."""
    x, z = _square(36, 36)
    y = _waves(dice, x, z, dice.uniform(0.002, 0.03))
    if dice.chance(0.3):
        y = y + 0.5 * np.maximum(x - dice.uniform(0.5, 0.9), 0)
    mesh = patch(np.stack([x, y, z * dice.uniform(0.5, 1)], -1))
    return Body(fitted(mesh), upright=True, open=True, fills=dice.chance(0.5))


def folded(dice: Dice) -> Body:
    """Make a pile of folded sheets: towels, clothes."""
    parts, y = [], 0.0
    for _ in range(dice.integer(2, 6)):
        thick = dice.uniform(0.06, 0.14)
        parts.append(placed(_roll(dice, thick), dice.normal(0.04), y + thick, dice.normal(0.04)))
        y += 1.9 * thick
    return standing(joined(parts))


def _roll(dice: Dice, thick: float) -> Mesh:
    """Make a flat loop of cloth with round edges."""
    grid = spherical(21, 41)
    level = np.linalg.norm(grid[..., [0, 2]], axis=-1, keepdims=True)
    flat = grid[..., [0, 2]] / np.maximum(level, 1e-6)
    grid[..., [0, 2]] = np.sign(flat) * np.abs(flat) ** 0.25 * level**0.3
    lift = _waves(dice, grid[..., 0], grid[..., 2], thick * 0.2)
    points = grid * floats([1, thick, 0.7])
    points[..., 1] += lift
    return patch(points.astype(np.float32), closed=True)


def sheet(dice: Dice) -> Body:
    """Make a sheet of paper, slightly bent or curled."""
    x, z = _square(24, 24)
    bend, angle = dice.normal(0.35), dice.uniform(0, 3.14)
    along = np.cos(angle) * x + np.sin(angle) * z
    y = bend * along**2 + _waves(dice, x, z, 0.006, 3)
    mesh = patch(np.stack([x * dice.uniform(0.6, 0.8), y, z], -1).astype(np.float32))
    return Body(fitted(mesh), upright=dice.chance(0.6), open=True)


def crumpled(dice: Dice) -> Body:
    """Crumpled paper or foil: a ball or a sheet with sharp creases."""
    if dice.chance(0.5):
        grid = spherical(29, 49)
        reach = 0.8 + _creases(dice, grid, 12) * 0.5
        return lying(faceted(patch(grid * reach[..., None], closed=True)))
    x, z = _square(40, 40)
    flat = np.stack([x, np.zeros_like(x), z], -1)
    lift = _creases(dice, flat, 14)
    return lying(faceted(patch(flat + floats([0, 1, 0]) * lift[..., None])), open_=True)


def _creases(dice: Dice, points: Floats, count: int) -> Floats:
    """Sharp ridges and valleys over points (..., 3)."""
    total = np.zeros(points.shape[:-1])
    for number, direction in enumerate(dice.directions(count)):
        knots = 1.0 + number * 0.45
        wave = (points @ direction * knots * 0.5 + dice.uniform()) % 1.0
        total += (np.abs(wave - 0.5) * 2 - 0.5) * dice.uniform(0.1, 0.5) / knots
    result: Floats = total.astype(np.float32)
    return result


def corrugated(dice: Dice) -> Body:
    """Corrugated sheet."""
    x, z = _square(8, 120)
    knots, deep = dice.uniform(5, 16), dice.uniform(0.015, 0.06)
    y = deep * np.clip(np.sin(x * knots * np.pi) * dice.uniform(1, 3), -1, 1)
    mesh = patch(np.stack([x, y, z * dice.uniform(0.6, 1)], -1).astype(np.float32))
    return Body(fitted(mesh), open=True, fills=dice.chance(0.3))


def garment(dice: Dice) -> Body:
    """Make a shirt or trousers laid out or hanging: panels with creases."""
    shirt = dice.chance(0.6)
    corners = _SHIRT if shirt else _TROUSERS
    parts = []
    for panel in corners:
        grid = _panel(floats(panel), 22)
        lift = _waves(dice, grid[..., 0] * 2, grid[..., 1] * 2, dice.uniform(0.02, 0.06), 8)
        grid[..., 2] += lift + dice.uniform(0, 0.02)
        parts.append(patch(grid))
    mesh = fitted(joined(parts))
    return Body(mesh, upright=dice.chance(0.6), open=True)


# Corners of panels, x and y: top left, top right, bottom left, bottom right.
_SHIRT = (
    ((-0.45, 0.7), (0.45, 0.7), (-0.45, -0.8), (0.45, -0.8)),
    ((-0.45, 0.7), (-0.4, 0.25), (-0.95, 0.3), (-0.75, 0.0)),
    ((0.4, 0.25), (0.45, 0.7), (0.75, 0.0), (0.95, 0.3)),
)
_TROUSERS = (
    ((-0.42, 1.0), (0.42, 1.0), (-0.48, 0.55), (0.48, 0.55)),
    ((-0.48, 0.55), (0.02, 0.55), (-0.5, -1.0), (-0.12, -1.0)),
    ((-0.02, 0.55), (0.48, 0.55), (0.12, -1.0), (0.5, -1.0)),
)


def _panel(corners: Floats, count: int) -> Floats:
    """Span a flat grid between four corners (4, 2): (count, count, 3)."""
    u, v = np.meshgrid(np.linspace(0, 1, count), np.linspace(0, 1, count))
    upper = corners[0] + (corners[1] - corners[0]) * u[..., None]
    lower = corners[2] + (corners[3] - corners[2]) * u[..., None]
    flat = upper + (lower - upper) * v[..., None]
    return floats(np.concatenate([flat, np.zeros_like(flat[..., :1])], -1))
