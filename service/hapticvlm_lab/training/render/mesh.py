"""Triangle meshes as bodies are made of: points, normals, texture frame. Knows no material.

Bodies are joined from patches, grids of points whose edges are creases. Texture coordinates are
lengths on the surface, so that one material looks equally coarse all over a body.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

Floats = NDArray[np.float32]
Indices = NDArray[np.int64]


@dataclass(frozen=True, slots=True)
class Mesh:
    """points, normals, tangents, bitangents (V, 3) and uv (V, 2) float32; faces (F, 3) int64.

    Tangent and bitangent point where u and v grow; faces turn left seen from outside.
    """

    points: Floats
    normals: Floats
    tangents: Floats
    bitangents: Floats
    uv: Floats
    faces: Indices

    def moved(self, turn: Floats, shift: Floats, scale: float = 1.0) -> Mesh:
        """Scaled, turned by a rotation (3, 3), then shifted by (3,)."""
        points = (scale * self.points) @ turn.T + shift
        frames = (self.normals @ turn.T, self.tangents @ turn.T, self.bitangents @ turn.T)
        return Mesh(points.astype(np.float32), *frames, self.uv * np.float32(scale), self.faces)

    def textured(self, density: float, angle: float, offset: Floats) -> Mesh:
        """With texture coordinates turned by `angle` (rad), scaled by `density` and shifted."""
        c, s = np.float32(np.cos(angle)), np.float32(np.sin(angle))
        turn = np.array([[c, -s], [s, c]], np.float32)
        uv = (self.uv @ turn.T) * np.float32(density) + offset
        across = c * self.tangents - s * self.bitangents
        down = s * self.tangents + c * self.bitangents
        return Mesh(self.points, self.normals, across, down, uv.astype(np.float32), self.faces)

    @property
    def radius(self) -> float:
        """Distance of the farthest point from the origin."""
        return float(np.linalg.norm(self.points, axis=1).max())


def floats(values: ArrayLike) -> Floats:
    """Put numbers into an array of float32."""
    return np.asarray(values, np.float32)


def patch(points: Floats, *, closed: bool = False, stretch: tuple[float, float] = (1, 1)) -> Mesh:
    """Return a smooth grid of points (rows, columns, 3); `closed`: the last column meets the first.

    Faces look to the side of (along a row) x (down a column). `stretch` scales u and v.
    """
    points = points.astype(np.float32)
    rows, columns = points.shape[:2]
    across, down = _along(points, 1, closed), _along(points, 0, False)
    normals = _unit(_smooth_normals(points, closed), floats([0, 1, 0]))
    tangents = _unit(across - _dot(across, normals) * normals, floats([1, 0, 0]))
    bitangents = _unit(down - _dot(down, normals) * normals, floats([0, 0, 1]))
    uv = np.stack([_lengths(points, 1) * stretch[0], _lengths(points, 0) * stretch[1]], -1)
    corner = np.arange(rows * columns, dtype=np.int64).reshape(rows, columns)
    a, b, c, d = corner[:-1, :-1], corner[:-1, 1:], corner[1:, :-1], corner[1:, 1:]
    faces = np.stack([np.stack([a, b, c], -1), np.stack([b, d, c], -1)]).reshape(-1, 3)
    fields = (points, normals, tangents, bitangents)
    first, second, third, fourth = (field.reshape(-1, 3) for field in fields)
    return Mesh(first, second, third, fourth, uv.reshape(-1, 2).astype(np.float32), faces)


def joined(meshes: Sequence[Mesh]) -> Mesh:
    """Many meshes as one."""
    starts = np.cumsum([0] + [len(mesh.points) for mesh in meshes[:-1]])
    faces = [mesh.faces + start for mesh, start in zip(meshes, starts, strict=True)]
    return Mesh(
        np.concatenate([mesh.points for mesh in meshes]),
        np.concatenate([mesh.normals for mesh in meshes]),
        np.concatenate([mesh.tangents for mesh in meshes]),
        np.concatenate([mesh.bitangents for mesh in meshes]),
        np.concatenate([mesh.uv for mesh in meshes]),
        np.concatenate(faces),
    )


def faceted(mesh: Mesh) -> Mesh:
    """With flat faces: creased paper, split rock, models of few faces."""
    corners = mesh.faces.reshape(-1)
    a, b, c = (mesh.points[mesh.faces[:, corner]] for corner in range(3))
    normals = _unit(_cross(b - a, c - a), floats([0, 1, 0])).repeat(3, 0)
    tangents = mesh.tangents[corners]
    tangents = _unit(tangents - _dot(tangents, normals) * normals, floats([1, 0, 0]))
    faces = np.arange(len(corners), dtype=np.int64).reshape(-1, 3)
    across = (mesh.bitangents[corners], mesh.uv[corners])
    return Mesh(mesh.points[corners], normals, tangents, *across, faces)


def placed(mesh: Mesh, x: float = 0.0, y: float = 0.0, z: float = 0.0, turn: float = 0.0) -> Mesh:
    """Return turned about the vertical by `turn` (rad), then shifted."""
    return mesh.moved(about_y(turn), floats([x, y, z]))


def about_y(angle: float) -> Floats:
    """Return the rotation about the vertical: (3, 3)."""
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]], np.float32)


def about_x(angle: float) -> Floats:
    """Return the rotation about the x axis: (3, 3)."""
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[1, 0, 0], [0, c, -s], [0, s, c]], np.float32)


def any_turn(numbers: np.random.Generator) -> Floats:
    """Return an even rotation: (3, 3)."""
    q = numbers.normal(size=4)
    w, x, y, z = q / np.linalg.norm(q)
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ],
        np.float32,
    )


def fitted(mesh: Mesh, also: Mesh | None = None) -> Mesh:
    """Centre a mesh on its bounding box and scale it to radius 1.

    With `also`, that mesh is moved and scaled as `mesh` would be.
    """
    middle = (mesh.points.min(0) + mesh.points.max(0)) / 2
    radius = float(np.linalg.norm(mesh.points - middle, axis=1).max())
    scale = np.float32(1 / max(radius, 1e-6))
    moved = mesh if also is None else also
    points = ((moved.points - middle) * scale).astype(np.float32)
    frames = (moved.normals, moved.tangents, moved.bitangents)
    return Mesh(points, *frames, moved.uv * scale, moved.faces)


def _along(points: Floats, axis: int, closed: bool) -> Floats:
    """Difference between the neighbours of each point along an axis, one-sided at the ends."""
    lines = np.swapaxes(points, 0, axis)
    difference = np.empty_like(lines)
    difference[1:-1] = lines[2:] - lines[:-2]
    difference[0], difference[-1] = lines[1] - lines[0], lines[-1] - lines[-2]
    if closed:
        difference[0] = difference[-1] = lines[1] - lines[-2]
    return np.swapaxes(difference, 0, axis)


def _cross(a: Floats, b: Floats) -> Floats:
    x, y, z = (a[..., axis] for axis in range(3))
    u, v, w = (b[..., axis] for axis in range(3))
    return np.stack([y * w - z * v, z * u - x * w, x * v - y * u], -1)


def _smooth_normals(points: Floats, closed: bool) -> Floats:
    diagonal = points[1:, 1:] - points[:-1, :-1]
    other = points[1:, :-1] - points[:-1, 1:]
    quads = _cross(diagonal, other)
    rows, columns = points.shape[:2]
    normals = np.zeros((rows, columns, 3), np.float32)
    for dy in (0, 1):
        for dx in (0, 1):
            normals[dy : rows - 1 + dy, dx : columns - 1 + dx] += quads
    if closed:
        normals[:, 0] += normals[:, -1]
        normals[:, -1] = normals[:, 0]
    return normals


def _lengths(points: Floats, axis: int) -> Floats:
    """Lengths along an axis, of a middling line of the grid: (rows, columns)."""
    steps = np.linalg.norm(np.diff(points, axis=axis), axis=-1)
    mean = steps.mean(axis=1 - axis)
    line = np.concatenate([[0], np.cumsum(mean)]) - mean.sum() / 2
    shape = (1, -1) if axis == 1 else (-1, 1)
    result: Floats = np.broadcast_to(line.reshape(shape), points.shape[:2]).astype(np.float32)
    return result


def _dot(a: Floats, b: Floats) -> Floats:
    product: Floats = a[..., :1] * b[..., :1] + a[..., 1:2] * b[..., 1:2]
    product += a[..., 2:] * b[..., 2:]
    return product


def _unit(vectors: Floats, otherwise: Floats) -> Floats:
    lengths = np.sqrt(_dot(vectors, vectors))
    unit: Floats = np.where(lengths > 1e-9, vectors / np.maximum(lengths, 1e-9), otherwise)
    return unit.astype(np.float32)
