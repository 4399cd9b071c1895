"""Vessels: profiles turned about the vertical, with walls; bottles, bowls, vases, cups."""

from __future__ import annotations

import numpy as np

from hapticvlm_lab.training.render.bodies.body import Body, standing
from hapticvlm_lab.training.render.bodies.solids import cylinder_mesh, tube_along, turned_body
from hapticvlm_lab.training.render.dice import Dice
from hapticvlm_lab.training.render.mesh import Floats, Mesh, floats, joined, placed


def _smooth(knots: list[tuple[float, float]], count: int = 36) -> Floats:
    """Make a rounded line through radius, height knots, by averaging a fine straight one."""
    fine = floats(knots)
    lengths = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(fine, axis=0), axis=1))])
    at = np.linspace(0, lengths[-1], count)
    line = np.stack([np.interp(at, lengths, fine[:, axis]) for axis in (0, 1)], -1)
    for _ in range(3):
        line[1:-1] = (line[:-2] + 2 * line[1:-1] + line[2:]) / 4
    line[:, 0] = np.maximum(line[:, 0], 1e-3)
    return line.astype(np.float32)


def _hollow(outside: list[tuple[float, float]], wall: float) -> Mesh:
    """Make a vessel open at the top; `outside` goes from the rim down to the foot."""
    outer = _smooth(outside)
    inner = outer[:-2].copy()
    inner[:, 0] = np.maximum(inner[:, 0] - wall, 1e-3)
    inner[:, 1] = np.maximum(inner[:, 1], outer[:, 1].min() + 1.5 * wall)
    lowest = inner[:, 1].argmin()
    inner = np.concatenate([inner[: lowest + 1], [[1e-3, inner[lowest, 1]]]]).astype(np.float32)
    foot = floats([[outer[-1, 0], outer[-1, 1]], [1e-3, outer[-1, 1]]])
    rim = np.stack([inner[0], outer[0]])
    parts = (outer, foot, inner[::-1].copy(), rim)
    return joined([turned_body(part.astype(np.float32)) for part in parts])


def bottle(dice: Dice) -> Body:
    """Make a bottle, closed."""
    neck, shoulder = dice.uniform(0.1, 0.3), dice.uniform(0.3, 0.8)
    belly, waist = dice.uniform(0.35, 0.7), dice.uniform(0.8, 1.05)
    line = [
        (1e-3, 1.55), (neck, 1.55), (neck, 1.0), (belly, shoulder), (belly * waist, -0.4),
        (belly, -1.0), (1e-3, -1.0),
    ]  # fmt: skip
    glass = turned_body(_smooth(line, 44))
    extra = []
    if dice.chance(0.5):
        extra.append(placed(cylinder_mesh(neck * 1.15, 0.14), 0, 1.5))
    if dice.chance(0.3):
        low, high = sorted((dice.uniform(-0.8, 0.2), dice.uniform(-0.8, 0.2)))
        ring = floats([[belly * 1.06, high], [belly * 1.06, low]])
        extra.append(turned_body(ring))
    return standing(glass, walled=True, companion=joined(extra) if extra else None)


def tumbler(dice: Dice) -> Body:
    """Make a drinking glass or cup without a handle."""
    foot, high = dice.uniform(0.4, 0.8), dice.uniform(0.8, 2.2)
    line = [(dice.uniform(0.7, 1.0), high), (foot, 0.0)]
    return standing(_hollow(line, dice.uniform(0.03, 0.09)), open_=True, walled=True)


def wineglass(dice: Dice) -> Body:
    """Make a bowl on a stem on a foot."""
    bowl, stem = dice.uniform(0.5, 0.8), dice.uniform(0.4, 1.1)
    line = [
        (bowl * dice.uniform(0.7, 1), stem + 1.3), (bowl, stem + 0.7), (bowl * 0.6, stem + 0.15),
        (0.06, stem), (0.06, 0.1), (0.5, 0.03), (0.5, 0.0), (1e-3, 0.0),
    ]  # fmt: skip
    return standing(turned_body(_smooth(line, 56)), open_=True, walled=True)


def vase(dice: Dice) -> Body:
    """Make a vase: radius varies along its height."""
    knots = dice.integer(4, 6)
    heights = np.linspace(1.6, 0, knots)
    line = [(dice.uniform(0.22, 0.75), float(height)) for height in heights]
    return standing(_hollow(line, dice.uniform(0.03, 0.07)), open_=True, walled=True)


def bowl(dice: Dice) -> Body:
    """Make a bowl or dish."""
    deep = dice.uniform(0.3, 0.9)
    line = [(1.0, deep), (dice.uniform(0.75, 0.98), deep * 0.5), (0.5, 0.06), (0.4, 0.0)]
    return standing(_hollow(line, dice.uniform(0.03, 0.08)), open_=True, walled=True)


def plate(dice: Dice) -> Body:
    """Make a plate or saucer."""
    line = [(1.0, dice.uniform(0.1, 0.25)), (0.65, 0.05), (0.5, 0.0)]
    return standing(_hollow(line, 0.04), open_=True)


def mug(dice: Dice) -> Body:
    """Make a cup with a handle."""
    high = dice.uniform(1.0, 1.6)
    line = [(0.62, high), (dice.uniform(0.5, 0.7), high / 2), (0.6, 0.05), (0.5, 0.0)]
    angle = np.linspace(-np.pi / 2, np.pi / 2, 17)
    across = 0.58 + 0.38 * np.cos(angle)
    path = np.stack([across, high / 2 + 0.34 * high * np.sin(angle), 0 * angle], -1)
    handle = tube_along(path.astype(np.float32), 0.08)
    return standing(joined([_hollow(line, 0.06), handle]), open_=True)


def pot(dice: Dice) -> Body:
    """Make a flower pot or pan, with or without a lid."""
    high, foot = dice.uniform(0.5, 1.3), dice.uniform(0.5, 0.95)
    line = [(1.0, high), (1.0, high * 0.85), (0.92, high * 0.8), (foot, 0.0)]
    parts = [_hollow(line, 0.06)]
    if dice.chance(0.35):
        lid = [(1e-3, high + 0.3), (0.12, high + 0.25), (0.1, high + 0.16), (1.02, high)]
        parts.append(turned_body(_smooth(lid)))
    return standing(joined(parts), open_=True)


def can(dice: Dice) -> Body:
    """Make a tin: cylinder with rims, sometimes ribbed."""
    half, ribs = dice.uniform(0.6, 1.3), dice.integer(0, 1) * dice.uniform(0.01, 0.03)
    height = np.linspace(half, -half, 60)
    radius = 0.6 + ribs * np.sin(height * dice.uniform(20, 40))
    radius[:2] += 0.03
    radius[-2:] += 0.03
    side = turned_body(np.stack([radius, height], -1).astype(np.float32))
    return standing(joined([side, cylinder_mesh(0.6, half * 0.985)]))


def column(dice: Dice) -> Body:
    """Make a column, baluster or pedestal."""
    heights = np.linspace(2.2, 0, dice.integer(6, 9))
    line = [(dice.uniform(0.28, 0.5), float(height)) for height in heights]
    ends = [(1e-3, 2.25), (0.6, 2.25), (0.6, 2.1), *line[1:-1], (0.6, 0.1), (0.6, 0), (1e-3, 0)]
    return standing(turned_body(_smooth(ends, 70)))
