"""Compact bodies: boxes, balls, cylinders, rings, blobs, rocks."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from hapticvlm_lab.training.render.bodies.body import Body, lying, standing
from hapticvlm_lab.training.render.dice import Dice
from hapticvlm_lab.training.render.mesh import (
    Floats,
    Mesh,
    about_x,
    about_y,
    faceted,
    floats,
    joined,
    patch,
    placed,
)

_UP = (0.0, 1.0, 0.0)


def cuboid(x: float, y: float, z: float, cuts: int = 5) -> Mesh:
    """Make a box with sharp edges, half sizes given."""
    unit = _cube(cuts)
    sizes = floats([x, y, z])
    axes = np.stack([np.abs(unit.tangents).argmax(1), np.abs(unit.bitangents).argmax(1)], 1)
    frames = (unit.normals, unit.tangents, unit.bitangents)
    return Mesh(unit.points * sizes, *frames, unit.uv * sizes[axes], unit.faces)


@lru_cache(maxsize=8)
def _cube(cuts: int) -> Mesh:
    """Make a box of half size 1."""
    u, v = np.meshgrid(np.linspace(1, -1, cuts), np.linspace(-1, 1, cuts))
    one = np.ones_like(u)
    sides = (np.stack([u, -v, one], -1), np.stack([one, -v, -u], -1), np.stack([u, one, v], -1))
    turns = (about_y(np.pi), about_y(np.pi), about_x(np.pi))
    opposite = [(points @ turn.T) for points, turn in zip(sides, turns, strict=True)]
    return joined([patch(points.astype(np.float32)) for points in (*sides, *opposite)])


def spherical(rows: int = 25, columns: int = 41) -> Floats:
    """Directions over a sphere: (rows, columns, 3), top to bottom, closed."""
    polar, around = np.meshgrid(
        np.linspace(0, np.pi, rows), np.linspace(0, 2 * np.pi, columns), indexing="ij"
    )
    flat = np.sin(polar)
    grid = np.stack([flat * np.cos(around), np.cos(polar), flat * np.sin(around)], -1)
    return grid.astype(np.float32)


def turned_body(profile: Floats, columns: int = 41) -> Mesh:
    """Turn a profile (K, 2) of radius and height, top to bottom outside, about the vertical."""
    around = np.linspace(0, 2 * np.pi, columns)
    radius, height = profile[:, :1], profile[:, 1:]
    points = np.stack(
        [radius * np.cos(around), np.broadcast_to(height, (len(profile), columns)),
         radius * np.sin(around)], -1,
    )  # fmt: skip
    return patch(points.astype(np.float32), closed=True)


def tube_along(path: Floats, radius: Floats | float, columns: int = 13) -> Mesh:
    """Make a round tube along a path (K, 3)."""
    forward = np.gradient(path, axis=0)
    forward /= np.linalg.norm(forward, axis=1, keepdims=True) + 1e-9
    helper = np.where(np.abs(forward[:, 1:2]) > 0.95, [[1.0, 0, 0]], [_UP])
    across = np.cross(forward, helper)
    across /= np.linalg.norm(across, axis=1, keepdims=True) + 1e-9
    over = np.cross(across, forward)
    around = np.linspace(0, 2 * np.pi, columns)[None, :, None]
    wide = np.broadcast_to(np.asarray(radius, np.float32), (len(path),))[:, None, None]
    ring = np.sin(around) * across[:, None] + np.cos(around) * over[:, None]
    return patch((path[:, None] + wide * ring).astype(np.float32), closed=True)


def cylinder_mesh(radius: float, half: float, taper: float = 1.0) -> Mesh:
    """Make a cylinder (or stump of a cone) with flat ends."""
    steps = np.linspace(0, 1, 6)
    side = np.stack([radius * (taper + (1 - taper) * steps), half * (1 - 2 * steps)], -1)
    top = np.stack([radius * taper * np.linspace(1e-3, 1, 4), np.full(4, half)], -1)
    bottom = np.stack([radius * np.linspace(1, 1e-3, 4), np.full(4, -half)], -1)
    return joined([turned_body(part.astype(np.float32)) for part in (top, side, bottom)])


def box(dice: Dice) -> Body:
    """Make a box."""
    mesh = cuboid(dice.uniform(0.3, 1), dice.uniform(0.3, 1), dice.uniform(0.3, 1))
    return standing(mesh) if dice.chance(0.6) else lying(mesh)


def rounded(dice: Dice) -> Body:
    """Make a box with round edges, or a cushion-like one: a superellipsoid."""
    power = dice.spread(0.12, 0.7)
    grid = spherical(33, 57)
    squashed = np.sign(grid) * np.abs(grid) ** power
    level = np.linalg.norm(grid[..., [0, 2]], axis=-1, keepdims=True)
    flat = grid[..., [0, 2]] / np.maximum(level, 1e-6)
    ring = np.sign(flat) * np.abs(flat) ** power * level**power
    squashed[..., [0, 2]] = ring
    sizes = [dice.uniform(0.35, 1) for _ in range(3)]
    mesh = patch((squashed * sizes).astype(np.float32), closed=True)
    return standing(mesh) if dice.chance(0.6) else lying(mesh)


def ball(dice: Dice) -> Body:
    """Make a ball, often not quite round."""
    sizes = [1.0] * 3 if dice.chance(0.5) else [dice.uniform(0.5, 1) for _ in range(3)]
    return standing(patch(spherical(29, 49) * floats(sizes), closed=True))


def cylinder(dice: Dice) -> Body:
    """Make a cylinder, disc or stump of a cone."""
    taper = 1.0 if dice.chance(0.7) else dice.uniform(0.3, 1)
    mesh = cylinder_mesh(dice.uniform(0.3, 1), dice.spread(0.12, 1.2), taper)
    return standing(mesh) if dice.chance(0.6) else lying(mesh)


def torus(dice: Dice) -> Body:
    """Make a ring."""
    thick = dice.uniform(0.12, 0.42)
    angle = np.linspace(0, 2 * np.pi, 49)
    path = np.stack([np.cos(angle), 0 * angle, np.sin(angle)], -1)
    return lying(tube_along(path.astype(np.float32), thick, 21))


def capsule(dice: Dice) -> Body:
    """Make a rod with round ends."""
    grid, half = spherical(25, 29), dice.uniform(0.3, 3)
    grid[..., 1] += np.where(grid[..., 1] > 0, half, -half)
    return lying(patch(grid, closed=True))


def blob(dice: Dice) -> Body:
    """Make a smooth lump, such as figures and toys are."""
    grid = spherical(33, 57)
    radius = np.ones(grid.shape[:2])
    for direction in dice.directions(5):
        phase = grid @ direction * dice.uniform(1.5, 5) + dice.uniform(0, 6)
        radius += dice.uniform(0.05, 0.2) * np.sin(phase)
    stretch = floats([dice.uniform(0.6, 1) for _ in range(3)])
    return standing(patch(grid * np.asarray(radius, np.float32)[..., None] * stretch, closed=True))


def rock_mesh(dice: Dice, rows: int = 33) -> Mesh:
    """Make a rock: planes cut off a ball, then roughened."""
    grid = spherical(rows, rows * 2 - 9)
    reach = np.ones(grid.shape[:2])
    for direction in dice.directions(dice.integer(5, 14)):
        facing = np.maximum(grid @ direction, 1e-3)
        reach = np.minimum(reach, dice.uniform(0.6, 0.95) / facing)
    for scale in (3, 7, 13):
        for direction in dice.directions(2):
            wave = np.sin(grid @ direction * scale * dice.uniform(0.7, 1.4) + dice.uniform(0, 6))
            reach = reach + dice.uniform(0, 0.12) / scale**0.7 * wave
    stretch = floats([dice.uniform(0.6, 1) for _ in range(3)])
    return patch((grid * reach[..., None] * stretch).astype(np.float32), closed=True)


def rock(dice: Dice) -> Body:
    """One rock."""
    mesh = rock_mesh(dice) if dice.chance(0.7) else faceted(rock_mesh(dice, 17))
    return lying(mesh)


def pebbles(dice: Dice) -> Body:
    """Make a handful of pebbles."""
    parts = []
    for _ in range(dice.integer(5, 14)):
        size, angle = dice.uniform(0.15, 0.45), dice.uniform(0, 6.28)
        stone = rock_mesh(dice, 13).moved(about_y(angle), np.zeros(3, np.float32), size)
        away = dice.uniform(0, 1)
        parts.append(placed(stone, away * np.cos(angle), size * 0.5, away * np.sin(angle)))
    return standing(joined(parts))
