"""Bodies people make of parts: boards, tables, cartons, seats, toys, tubes."""

from __future__ import annotations

import numpy as np

from hapticvlm.training.render.bodies.body import Body, lying, standing
from hapticvlm.training.render.bodies.solids import (
    cuboid,
    cylinder_mesh,
    spherical,
    tube_along,
    turned_body,
)
from hapticvlm.training.render.dice import Dice
from hapticvlm.training.render.mesh import Mesh, about_x, fitted, floats, joined, patch, placed


def slab(dice: Dice) -> Body:
    """Make a floor or table top, larger than the picture may be."""
    mesh = cuboid(1.0, dice.uniform(0.01, 0.08), dice.uniform(0.6, 1.0), 9)
    return Body(fitted(mesh), upright=True, fills=True)


def wall(dice: Dice) -> Body:
    """Make an upright board or wall, larger than the picture may be."""
    mesh = cuboid(1.0, dice.uniform(0.6, 1.0), dice.uniform(0.01, 0.08), 9)
    return Body(fitted(mesh), upright=True, fills=True)


def pane(dice: Dice) -> Body:
    """Make a window pane or sheet."""
    mesh = cuboid(dice.uniform(0.6, 1.0), dice.uniform(0.6, 1.0), dice.uniform(0.008, 0.04), 7)
    return Body(fitted(mesh), upright=True, fills=dice.chance(0.4))


def boards(dice: Dice) -> Body:
    """Boards or beams, side by side or piled up."""
    count, piled = dice.integer(2, 6), dice.chance(0.5)
    width, thick = dice.uniform(0.12, 0.35), dice.uniform(0.03, 0.15)
    parts = []
    for number in range(count):
        long = dice.uniform(0.8, 1.2)
        board = cuboid(long, thick, width * 0.97, 4)
        turn = dice.normal(0.03) + (dice.uniform(0, 0.5) if piled else 0)
        up, aside = (2 * thick * number, 0.0) if piled else (0.0, 2 * width * number)
        parts.append(placed(board, dice.normal(0.05), up, aside, turn))
    return standing(joined(parts)) if dice.chance(0.7) else lying(joined(parts))


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
    wide, high, bar = dice.uniform(0.6, 1), dice.uniform(0.6, 1), dice.uniform(0.06, 0.2)
    thick = dice.uniform(0.03, 0.1)
    parts = [placed(cuboid(wide + bar, bar, thick), 0, y * high) for y in (-1, 1)]
    parts += [placed(cuboid(bar, high - bar, thick), x * wide) for x in (-1, 1)]
    return standing(joined(parts))


def rods(dice: Dice) -> Body:
    """Thin rods or bars, straight, crossing or side by side."""
    thin, parts = dice.spread(0.02, 0.12), []
    aligned = dice.chance(0.5)
    for number in range(dice.integer(1, 6)):
        rod = cuboid(thin, 1.0, thin, 3) if dice.chance(0.3) else cylinder_mesh(thin, 1.0)
        lean = about_x(0.0 if aligned else dice.normal(0.4))
        rod = rod.moved(lean, np.zeros(3, np.float32))
        parts.append(placed(rod, number * thin * dice.uniform(2.2, 6), 0, 0, dice.uniform(0, 6)))
    return lying(joined(parts)) if dice.chance(0.5) else standing(joined(parts))


def rings(dice: Dice) -> Body:
    """Links of a chain."""
    angle, parts = np.linspace(0, 2 * np.pi, 33), []
    long, thick = dice.uniform(1, 1.6), dice.uniform(0.1, 0.25)
    path = np.stack([long * np.cos(angle), np.sin(angle), 0 * angle], -1).astype(np.float32)
    link = tube_along(path, thick, 11)
    for number in range(dice.integer(1, 4)):
        turn = about_x(np.pi / 2 * (number % 2))
        parts.append(link.moved(turn, floats([number * (2 * long - 3 * thick), 0, 0])))
    return lying(joined(parts))


def cutlery(dice: Dice) -> Body:
    """Make a spoon."""
    along = np.linspace(0, 1, 40)
    wide = np.where(along < 0.3, 0.16 * np.sqrt(np.clip(1 - ((along - 0.15) / 0.15) ** 2, 0, 1)), 0)
    wide = np.maximum(wide, 0.025 + 0.03 * along)
    across = np.linspace(-1, 1, 9)
    x = np.broadcast_to(2 * along[:, None] - 1, (40, 9))
    dish = np.where(along < 0.3, dice.uniform(0.3, 0.8), 0.1)[:, None] * wide[:, None]
    y = dish * across**2 + 0.15 * (along[:, None] - 0.3) ** 2
    return lying(patch(np.stack([x, y, wide[:, None] * across], -1)), open_=True)


def tube(dice: Dice) -> Body:
    """Make a bent tube, hose or roll."""
    along = np.linspace(0, 1, 60)
    turns, rise = dice.uniform(0.05, 2.2), dice.uniform(0, 1)
    angle = 2 * np.pi * turns * along
    path = np.stack([np.cos(angle), rise * along, np.sin(angle)], -1)
    path[:, 0] += along * dice.uniform(0, 2)
    return lying(tube_along(path.astype(np.float32), dice.uniform(0.07, 0.3), 17), open_=True)


def toy(dice: Dice) -> Body:
    """Make simple parts put together, each of the same material."""
    parts: list[Mesh] = []
    for number in range(dice.integer(2, 5)):
        size = dice.uniform(0.25, 0.6)
        options = (
            cuboid(size, size * dice.uniform(0.4, 1), size),
            cylinder_mesh(size, size * dice.uniform(0.3, 1)),
            patch(spherical(17, 25) * np.float32(size), closed=True),
        )
        parts.append(placed(dice.choose(options), dice.normal(0.3), number * 0.5, dice.normal(0.3)))
    return standing(joined(parts))


def blocks(dice: Dice) -> Body:
    """Blocks laid in courses, or steps."""
    parts, steps = [], dice.chance(0.4)
    for course in range(dice.integer(2, 4)):
        for number in range(3):
            block = cuboid(0.32 + dice.normal(0.005), 0.15, 0.3, 3)
            x = number * 0.66 + (course % 2) * 0.33 * (not steps)
            parts.append(placed(block, x, course * 0.31, -0.5 * course * steps))
    return standing(joined(parts))


def seat(dice: Dice) -> Body:
    """Make an armchair, sofa or car seat: padded parts."""
    wide, power = dice.uniform(0.5, 1.1), dice.uniform(0.2, 0.45)
    parts = [
        placed(_pad(wide, 0.2, 0.55, power), 0, 0.3),
        placed(_pad(wide, 0.5, 0.18, power), 0, 0.75, -0.55),
    ]
    if dice.chance(0.7):
        parts += [
            placed(_pad(0.17, 0.33, 0.6, power), side * (wide + 0.1), 0.4) for side in (-1, 1)
        ]
    return standing(joined(parts))


def _pad(x: float, y: float, z: float, power: float) -> Mesh:
    """Make a padded box: a superellipsoid with half sizes."""
    grid = spherical(17, 33)
    level = np.linalg.norm(grid[..., [0, 2]], axis=-1, keepdims=True)
    flat = grid[..., [0, 2]] / np.maximum(level, 1e-6)
    grid[..., [0, 2]] = np.sign(flat) * np.abs(flat) ** power * level**power
    grid[..., 1] = np.sign(grid[..., 1]) * np.abs(grid[..., 1]) ** power
    return patch(grid * floats([x, y, z]), closed=True)


def stack(dice: Dice) -> Body:
    """Sheets, books or notebooks piled up."""
    parts, y = [], 0.0
    wide, deep = dice.uniform(0.6, 1), dice.uniform(0.5, 0.9)
    fine = dice.chance(0.5)
    for _ in range(dice.integer(5, 16) if fine else dice.integer(2, 6)):
        thick = dice.uniform(0.008, 0.02) if fine else dice.uniform(0.03, 0.1)
        turn = dice.normal(0.04 if fine else 0.15)
        sheet = cuboid(wide, thick, deep, 4)
        parts.append(placed(sheet, dice.normal(0.02), y + thick, dice.normal(0.02), turn))
        y += 2 * thick
    return standing(joined(parts))


def carton(dice: Dice) -> Body:
    """Make an open cardboard box with flaps."""
    x, y, z = dice.uniform(0.5, 1), dice.uniform(0.3, 0.8), dice.uniform(0.4, 0.9)
    parts = [placed(cuboid(x, 0.01, z), 0, -y)]
    parts += [placed(cuboid(x, y, 0.01), 0, 0, side * z) for side in (-1, 1)]
    parts += [placed(cuboid(0.01, y, z), side * x) for side in (-1, 1)]
    for side in (-1, 1):
        lean = dice.uniform(-0.3, 2.2)
        flap = placed(cuboid(x, 0.01, z / 2, 3), 0, 0, z / 2)
        flap = flap.moved(about_x(-lean), floats([0, y, z]))
        parts.append(flap if side > 0 else placed(flap, turn=np.pi))
    return standing(joined(parts))


def bag(dice: Dice) -> Body:
    """Make a bag with a handle."""
    high = dice.uniform(0.5, 0.8)
    angle = np.linspace(0, np.pi, 25)
    path = np.stack([0.45 * np.cos(angle), high + 0.5 * np.sin(angle), 0 * angle], -1)
    parts = [_pad(0.9, high, dice.uniform(0.25, 0.45), dice.uniform(0.2, 0.5))]
    parts.append(tube_along(path.astype(np.float32), 0.05))
    return standing(joined(parts))


def strap(dice: Dice) -> Body:
    """Make a belt or band, rolled or bent."""
    turns, along = dice.uniform(0.3, 2.5), np.linspace(0, 1, 90)
    angle = 2 * np.pi * turns * along
    radius = 1 - 0.25 * along * turns * dice.uniform(0.3, 1)
    across = np.linspace(-1, 1, 5) * dice.uniform(0.1, 0.45)
    x = np.broadcast_to((radius * np.cos(angle))[:, None], (90, 5))
    z = np.broadcast_to((radius * np.sin(angle))[:, None], (90, 5))
    y = np.broadcast_to(across, (90, 5))
    return lying(patch(np.stack([x, y, z], -1)), open_=True)


def tyre(dice: Dice) -> Body:
    """Make a tyre, with tread."""
    wide, high = dice.uniform(0.2, 0.45), dice.uniform(0.2, 0.4)
    angle = np.linspace(-np.pi * 0.92, np.pi * 0.92, 33)
    power = dice.uniform(0.45, 0.9)
    swing = np.sign(np.cos(angle)) * np.abs(np.cos(angle)) ** power
    flank = np.sign(np.sin(angle)) * np.abs(np.sin(angle)) ** power
    profile = np.stack([1 + high * swing, -wide * flank], -1)
    mesh = turned_body(profile.astype(np.float32), 145)
    points = mesh.points.copy()
    around = np.arctan2(points[:, 2], points[:, 0])
    tread = np.sin(around * dice.integer(24, 60) + points[:, 1] * dice.uniform(0, 20)) > 0.2
    outer = np.hypot(points[:, 0], points[:, 2]) > 1 + 0.8 * high
    points *= np.where(outer & tread, 0.965, 1.0)[:, None].astype(np.float32)
    ring = Mesh(points, mesh.normals, mesh.tangents, mesh.bitangents, mesh.uv, mesh.faces)
    return lying(ring, open_=True)
