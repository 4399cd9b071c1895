"""Shapes that are turned about an axis: vessels with walls, plates, rings, pipes; seeded."""

from __future__ import annotations

import numpy as np

from hapticvlm_lab.training.held_back.meshes import Array, Mesh, moved, revolved, rotation

Rng = np.random.Generator
X, _, Z = np.eye(3)
ORIGIN = np.zeros(3)


def vase(rng: Rng) -> Mesh:
    """Turn a vase: foot, belly, neck, lip."""
    belly = rng.uniform(0.4, 0.7)
    neck = rng.uniform(0.15, 0.3)
    height = rng.uniform(1.3, 2.2)
    knots = [(0.3, 0.0), (belly, 0.38 * height), (neck, 0.78 * height), (neck * 1.5, height)]
    return _vessel(_spline(knots), rng.uniform(0.03, 0.06))


def bottle(rng: Rng) -> Mesh:
    """Turn a bottle with a straight neck."""
    width = rng.uniform(0.32, 0.5)
    height = rng.uniform(1.6, 2.2)
    shoulder = rng.uniform(0.5, 0.65) * height
    neck = rng.uniform(0.1, 0.16)
    knots = [(width * 0.9, 0.0), (width, 0.06), (width, shoulder), (neck, shoulder + 0.35)]
    return _vessel(_spline([*knots, (neck, height)]), rng.uniform(0.03, 0.05))


def tumbler(rng: Rng) -> Mesh:
    """Turn a drinking glass that widens."""
    low = rng.uniform(0.3, 0.45)
    high = rng.uniform(0.42, 0.6)
    height = rng.uniform(0.9, 1.5)
    return _vessel(_spline([(low, 0.0), (low + 0.03, 0.05), (high, height)]), 0.05)


def bowl(rng: Rng) -> Mesh:
    """Turn a bowl."""
    depth = rng.uniform(0.4, 0.8)
    knots = [(0.35, 0.0), (0.5, 0.08), (0.85, 0.45 * depth), (1.0, depth)]
    return _vessel(_spline(knots), rng.uniform(0.04, 0.08))


def goblet(rng: Rng) -> Mesh:
    """Turn a bowl on a stem."""
    bowl = rng.uniform(0.35, 0.5)
    stem = rng.uniform(0.5, 0.9)
    outer = [(0.4, 0.0), (0.38, 0.05), (0.07, 0.14), (0.06, stem), (bowl * 0.6, stem + 0.12)]
    outer += [(bowl, stem + 0.5), (bowl * 0.85, stem + 0.95)]
    inner = [(bowl * 0.8, stem + 0.93), (bowl * 0.92, stem + 0.5), (bowl * 0.5, stem + 0.2)]
    profile = np.concatenate([[[0.0, 0.0]], _spline(outer), _spline(inner, 24), [[0, stem + 0.15]]])
    return revolved(profile)


def plate(rng: Rng) -> Mesh:
    """Turn a plate and lean it."""
    lift = rng.uniform(0.1, 0.25)
    outer = _spline([(0.55, 0.0), (0.65, 0.03), (1.0, lift)])
    lean = rotation(X, rng.uniform(0.2, 1.2))
    return moved(_vessel(outer, 0.05), lean, ORIGIN)


def cylinder(rng: Rng) -> Mesh:
    """Turn a solid cylinder with rounded rims."""
    radius = rng.uniform(0.35, 0.7)
    height = rng.uniform(0.8, 1.6)
    return revolved(_rounded_rim(radius, height, 0.05))


def ring(rng: Rng, least: float = 0.15, most: float = 0.4) -> Mesh:
    """Turn a ring with a round section and lean it."""
    thick = rng.uniform(least, most)
    turn = np.linspace(0, 2 * np.pi, 33)
    profile = np.stack([1 - thick + thick * np.cos(turn), thick * np.sin(turn)], -1)
    ring = revolved(profile + np.array([0.05, 0.0]), 96)
    return moved(ring, rotation(X, rng.uniform(0.2, 1.5)), ORIGIN)


def pipe(rng: Rng) -> Mesh:
    """Turn a pipe, standing or lying."""
    radius = rng.uniform(0.25, 0.5)
    height = rng.uniform(1.2, 2.0)
    wall = rng.uniform(0.05, 0.12)
    turn = np.linspace(0, np.pi, 9)
    rim = np.stack([radius - wall / 2 * (1 - np.cos(turn)), height + wall / 2 * np.sin(turn)], -1)
    tube = revolved(np.concatenate([rim, [0, height] - rim[::-1] * [-1, 1], rim[:1]])[::-1])
    return moved(tube, rotation(Z, np.pi / 2 * (rng.random() < 0.5)), ORIGIN)


def _spline(knots: list[tuple[float, float]], count: int = 48) -> Array:
    """Draw a smooth profile (count, 2) of radius and height through knots."""
    from scipy.interpolate import PchipInterpolator

    points = np.array(knots)
    at = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
    return np.asarray(PchipInterpolator(at, points)(np.linspace(0, at[-1], count)))


def _vessel(outer: Array, wall: float) -> Mesh:
    """Revolve an outer profile, bottom to rim, with an inner wall."""
    inner = outer.copy()
    inner[:, 0] = np.maximum(inner[:, 0] - wall, 0.0)
    inner[:, 1] = np.maximum(inner[:, 1], outer[0, 1] + 1.6 * wall)
    foot = np.array([[0.0, outer[0, 1]]])
    rim = np.array([[outer[-1, 0] - wall / 2, outer[-1, 1] + wall / 2]])
    base = np.array([[0.0, outer[0, 1] + 1.6 * wall]])
    return revolved(np.concatenate([foot, outer, rim, inner[::-1], base]))


def _rounded_rim(radius: float, height: float, bevel: float) -> Array:
    turn = np.linspace(-np.pi / 2, np.pi / 2, 14)
    x = radius - bevel + bevel * np.cos(turn)
    y = bevel * np.sin(turn) + np.where(turn < 0, bevel, height - bevel)
    ends = np.linspace(0, radius - bevel, 6)
    low = np.stack([ends, np.zeros(6)], -1)
    return np.concatenate([low, np.stack([x, y], -1), low[::-1] + np.array([0, height])])
