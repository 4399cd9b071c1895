"""Furniture and flat surfaces: floors, walls, panes, tables, shelves, seats, crates, frames."""

from __future__ import annotations

import numpy as np

from hapticvlm_lab.training.render.bodies.body import Body, standing
from hapticvlm_lab.training.render.bodies.solids import cuboid, cylinder_mesh, spherical
from hapticvlm_lab.training.render.dice import Dice
from hapticvlm_lab.training.render.mesh import Mesh, fitted, floats, joined, patch, placed


def slab(dice: Dice) -> Body:
    """Make a floor or table top, larger than the picture may be."""
    mesh = cuboid(1.0, dice.uniform(0.01, 0.08), dice.uniform(0.6, 1.0), 9)
    return Body(fitted(mesh), upright=True, fills=True)


def wall(dice: Dice) -> Body:
    """Make an upright board or wall, larger than the picture may be."""
    mesh = cuboid(1.0, dice.uniform(0.6, 1.0), dice.uniform(0.01, 0.08), 9)
    return Body(fitted(mesh), upright=True, fills=True)


def pane(dice: Dice) -> Body:
    """Make a window pane or sheet, framed more often than not."""
    wide, high, thick = dice.uniform(0.6, 1.0), dice.uniform(0.6, 1.0), dice.uniform(0.008, 0.04)
    mesh = cuboid(wide, high, thick, 7)
    fills = dice.chance(0.4)
    bars = _bars(dice, wide, high) if dice.chance(0.55) else None
    beside = None if bars is None else fitted(mesh, bars)
    return Body(fitted(mesh), upright=True, fills=fills, companion=beside)


def table(dice: Dice) -> Body:
    """Make a table, stool or bench: a top on legs."""
    wide, deep, high = dice.uniform(0.5, 1), dice.uniform(0.35, 0.8), dice.uniform(0.3, 1)
    thick, leg = dice.uniform(0.03, 0.09), dice.uniform(0.03, 0.09)
    round_top = dice.chance(0.25)
    top = cylinder_mesh(wide, thick) if round_top else cuboid(wide, thick, deep)
    deep = wide if round_top else deep
    parts = [placed(top, 0, high)]
    inset = 0.62 if round_top else 0.9
    for x in (-1, 1):
        for z in (-1, 1):
            post = cylinder_mesh(leg, high / 2) if round_top else cuboid(leg, high / 2, leg, 3)
            parts.append(placed(post, x * wide * inset, high / 2, z * deep * inset))
    return standing(joined(parts))


def chair(dice: Dice) -> Body:
    """Make a chair: seat, legs and a back of slats or a board."""
    wide, high, leg = dice.uniform(0.35, 0.5), dice.uniform(0.4, 0.55), dice.uniform(0.025, 0.06)
    parts = [placed(cuboid(wide, 0.04, wide), 0, high)]
    for x in (-1, 1):
        parts.append(placed(cuboid(leg, high / 2, leg, 3), x * wide * 0.9, high / 2, wide * 0.9))
        post = cuboid(leg, high * 1.05, leg, 3)
        parts.append(placed(post, x * wide * 0.9, high * 1.05, -wide * 0.9))
    if dice.chance(0.5):
        parts.append(placed(cuboid(wide, high * 0.35, 0.03), 0, high * 1.7, -wide * 0.9))
    else:
        slat = cuboid(wide * 0.9, 0.05, 0.02, 3)
        levels = np.linspace(1.3, 2.0, dice.integer(2, 5))
        parts += [placed(slat, 0, high * float(level), -wide * 0.9) for level in levels]
    return standing(joined(parts))


def shelf(dice: Dice) -> Body:
    """Make a shelf: boards between sides."""
    wide, high, deep = dice.uniform(0.5, 0.9), dice.uniform(0.7, 1.2), dice.uniform(0.15, 0.4)
    parts = [placed(cuboid(0.04, high, deep), side * wide) for side in (-1, 1)]
    heights = np.linspace(-high, high, dice.integer(3, 5))
    parts += [placed(cuboid(wide, 0.03, deep), 0, float(y)) for y in heights]
    if dice.chance(0.5):
        parts.append(placed(cuboid(wide, high, 0.01), 0, 0, -deep))
    return standing(joined(parts))


def crate(dice: Dice) -> Body:
    """Make an open crate of slats."""
    slats, gap = dice.integer(2, 5), dice.uniform(0.7, 0.95)
    high = dice.uniform(0.4, 0.9)
    parts = [placed(cuboid(1, 0.03, 0.8), 0, -high)]
    step = 2 * high / slats
    for number in range(slats):
        y = -high + (number + 0.5) * step
        long, short = cuboid(1, step / 2 * gap, 0.03, 3), cuboid(0.03, step / 2 * gap, 0.8, 3)
        parts += [placed(long, 0, y, z) for z in (-0.8, 0.8)]
        parts += [placed(short, x, y) for x in (-1, 1)]
    return standing(joined(parts))


def frame(dice: Dice) -> Body:
    """Make a picture or window frame."""
    return standing(_bars(dice, dice.uniform(0.6, 1), dice.uniform(0.6, 1)))


def _bars(dice: Dice, wide: float, high: float) -> Mesh:
    """Four bars around an opening of these half sizes, sometimes with crossbars."""
    bar, thick = dice.uniform(0.04, 0.16), dice.uniform(0.03, 0.1)
    parts = [placed(cuboid(wide + bar, bar, thick), 0, y * high) for y in (-1, 1)]
    parts += [placed(cuboid(bar, high - bar, thick), x * wide) for x in (-1, 1)]
    if dice.chance(0.4):
        parts.append(cuboid(bar * 0.4, high, thick * 0.8))
        parts.append(cuboid(wide, bar * 0.4, thick * 0.8))
    return joined(parts)


def seat(dice: Dice) -> Body:
    """Make an armchair, sofa or car seat: padded parts."""
    wide, power = dice.uniform(0.5, 1.1), dice.uniform(0.2, 0.45)
    parts = [
        placed(padded(wide, 0.2, 0.55, power), 0, 0.3),
        placed(padded(wide, 0.5, 0.18, power), 0, 0.75, -0.55),
    ]
    if dice.chance(0.7):
        parts += [
            placed(padded(0.17, 0.33, 0.6, power), side * (wide + 0.1), 0.4) for side in (-1, 1)
        ]
    return standing(joined(parts))


def padded(x: float, y: float, z: float, power: float) -> Mesh:
    """Make a padded box: a superellipsoid with half sizes."""
    grid = spherical(17, 33)
    level = np.linalg.norm(grid[..., [0, 2]], axis=-1, keepdims=True)
    flat = grid[..., [0, 2]] / np.maximum(level, 1e-6)
    grid[..., [0, 2]] = np.sign(flat) * np.abs(flat) ** power * level**power
    grid[..., 1] = np.sign(grid[..., 1]) * np.abs(grid[..., 1]) ** power
    return patch(grid * floats([x, y, z]), closed=True)
