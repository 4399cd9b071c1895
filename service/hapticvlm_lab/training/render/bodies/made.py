"""Bodies people make: boards, rods, toys, tubes, tyres, cartons, bags, gears."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from hapticvlm_lab.training.render.bodies.body import Body, lying, standing
from hapticvlm_lab.training.render.bodies.furniture import padded
from hapticvlm_lab.training.render.bodies.solids import (
    cuboid,
    cylinder_mesh,
    spherical,
    tube_along,
    turned_body,
)
from hapticvlm_lab.training.render.dice import Dice
from hapticvlm_lab.training.render.mesh import Mesh, about_x, floats, joined, patch, placed


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
    parts = [padded(0.9, high, dice.uniform(0.25, 0.45), dice.uniform(0.2, 0.5))]
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


def pot(dice: Dice) -> Mesh:
    """Make a flower pot, its rim at the origin."""
    wide, high = dice.uniform(0.3, 0.6), dice.uniform(0.4, 0.8)
    return placed(cylinder_mesh(wide, high / 2, dice.uniform(1, 1.3)), 0, -high / 2)


def pan(dice: Dice) -> Body:
    """Make a pan or ladle, its handle often of another material."""
    deep = dice.uniform(0.15, 0.6)
    profile = floats([[1.0, deep], [dice.uniform(0.75, 1), 0], [1e-3, 0.0]])
    inside = profile[::-1] * floats([0.95, 1]) + floats([0, 0.04])
    dish = joined([turned_body(profile), turned_body(inside)])
    lift = dice.uniform(0, 0.5)
    long = [[0.95 + 1.3 * t, deep * 0.9 + lift * t, 0] for t in np.linspace(0, 1, 8)]
    handle = tube_along(floats(long), dice.uniform(0.05, 0.1))
    if dice.chance(0.5):
        return standing(dish, open_=True, companion=handle)
    return standing(joined([dish, handle]), open_=True)


def gear(dice: Dice) -> Body:
    """Cut a gear, star, knob or washer out of a plate."""
    angle = np.linspace(0, 2 * np.pi, 97)
    wave = np.sin(angle * dice.integer(3, 16))
    teeth = np.tanh(wave * dice.uniform(1, 8)) * dice.uniform(0.04, 0.3)
    outer, inner = 1 + teeth, np.full_like(angle, dice.uniform(0.01, 0.7))
    thick = dice.spread(0.04, 0.5)
    rings = [(inner, thick), (outer, thick), (outer, -thick), (inner, -thick), (inner, thick)]
    parts = []
    for (radius, y), (other, down) in pairwise(rings):
        rows = [
            np.stack([r * np.cos(angle), np.full_like(angle, h), r * np.sin(angle)], -1)
            for r, h in ((radius, y), (other, down))
        ]
        parts.append(patch(floats(rows), closed=True))
    return lying(joined(parts))
