"""Plants: many leaves or blades, each a small bent patch seen from both sides."""

from __future__ import annotations

import numpy as np

from hapticvlm_lab.training.render.bodies.body import Body, lying, standing
from hapticvlm_lab.training.render.bodies.made import pot
from hapticvlm_lab.training.render.bodies.solids import tube_along
from hapticvlm_lab.training.render.dice import Dice
from hapticvlm_lab.training.render.mesh import Floats, Mesh, any_turn, floats, joined, patch


def _leaf(dice: Dice, wide: float, bend: float, rows: int = 7) -> Mesh:
    """One leaf from its stem at the origin along +y, length 1."""
    along = np.linspace(0, 1, rows)
    tip = dice.uniform(0.6, 1.4)
    half = wide * np.sin(np.pi * along**tip) ** dice.uniform(0.6, 1.1) + 0.01
    across = np.linspace(-1, 1, 5)
    x = half[:, None] * across
    crease = dice.uniform(0, 0.6) * half[:, None] * np.abs(across)
    z = bend * along[:, None] ** 2 + crease
    y = np.broadcast_to(along[:, None], x.shape)
    return patch(np.stack([x, y, z], -1).astype(np.float32))


def _towards(direction: Floats, roll: float) -> Floats:
    """Return a rotation that takes +y to a direction: (3, 3)."""
    up = direction / np.linalg.norm(direction)
    helper = floats([np.cos(roll), 0.3, np.sin(roll)])
    across = np.cross(up, helper)
    across = across / (np.linalg.norm(across) + 1e-9)
    turn: Floats = np.stack([across, up, np.cross(across, up)], 1).astype(np.float32)
    return turn


def bush(dice: Dice) -> Body:
    """Leaves all over a crown."""
    wide, size = dice.uniform(0.12, 0.4), dice.uniform(0.25, 0.6)
    kinds = [_leaf(dice, wide, dice.normal(0.3), 5) for _ in range(4)]
    parts = []
    for direction in dice.directions(dice.integer(90, 220)):
        root = direction * np.float32(dice.uniform(0.3, 1) ** 0.5 * 0.75)
        toward = direction + floats([0, 0.4, 0]) + dice.normal(0.5)
        turn = _towards(toward, dice.uniform(0, 6))
        parts.append(dice.choose(kinds).moved(turn, root, size * dice.uniform(0.6, 1.2)))
    return standing(joined(parts), open_=True)


def grass(dice: Dice) -> Body:
    """Make a tuft or patch of blades."""
    kinds = [_leaf(dice, dice.uniform(0.02, 0.05), dice.uniform(0.1, 0.8), 6) for _ in range(4)]
    wide, parts = dice.uniform(0.3, 1.0), []
    for _ in range(dice.integer(120, 260)):
        root = floats([dice.normal(wide), 0, dice.normal(wide)])
        turn = _towards(floats([dice.normal(0.3), 1, dice.normal(0.3)]), dice.uniform(0, 6))
        parts.append(dice.choose(kinds).moved(turn, root, dice.uniform(0.5, 1.1)))
    return standing(joined(parts), open_=True)


def branch(dice: Dice) -> Body:
    """Make a stem with leaves along it, or a rosette of a house plant."""
    count, wide = dice.integer(7, 24), dice.uniform(0.15, 0.45)
    rosette = dice.chance(0.4)
    stem = floats([[0, t * 2, 0.3 * t * t] for t in np.linspace(0, 1, 12)])
    parts = [] if rosette else [tube_along(stem, 0.025, 7)]
    for number in range(count):
        share, angle = number / count, number * 2.4
        lift = dice.uniform(0.3, 1.5)
        toward = floats([np.cos(angle), lift, np.sin(angle)])
        root = np.zeros(3, np.float32) if rosette else stem[int(share * 11)]
        size = dice.uniform(0.6, 1.0) * (1.2 if rosette else 1 - 0.5 * share)
        leaf = _leaf(dice, wide, -dice.uniform(0, 0.6))
        parts.append(leaf.moved(_towards(toward, angle), root, size))
    potted = pot(dice) if dice.chance(0.4) else None
    return standing(joined(parts), open_=True, companion=potted)


def leaf(dice: Dice) -> Body:
    """One or a few large leaves."""
    parts = []
    for _ in range(dice.integer(1, 4)):
        turn = any_turn(dice.numbers)
        bent = _leaf(dice, dice.uniform(0.15, 0.5), dice.normal(0.3), 17)
        parts.append(bent.moved(turn, np.zeros(3, np.float32)))
    return lying(joined(parts), open_=True)
