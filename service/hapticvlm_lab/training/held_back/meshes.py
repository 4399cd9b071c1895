"""Triangle meshes of the held-back set's own shapes, and operations on any mesh.

A mesh is y up and smooth, with texture coordinates in scene units (1 is the object's bounding
radius once it is `fitted`). Independent of materials and of any renderer.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Faces = NDArray[np.int64]
Warp = Callable[[Array], Array]
_PLY = ("x", "y", "z", "nx", "ny", "nz", "u", "v")


@dataclass(frozen=True, slots=True)
class Mesh:
    """points (V, 3), normals (V, 3) unit, uv (V, 2), faces (F, 3); closed: it has an inside."""

    points: Array
    normals: Array
    uv: Array
    faces: Faces
    closed: bool = True


def grid_mesh(points: Array, uv: Array, *, closed: bool) -> Mesh:
    """Join a grid of points (N, M, 3) with uv (N, M, 2) into triangles."""
    n, m = points.shape[:2]
    a = (np.arange(n - 1)[:, None] * m + np.arange(m - 1)[None, :]).ravel()
    faces = np.concatenate(
        [np.stack([a, a + 1, a + m], -1), np.stack([a + 1, a + m + 1, a + m], -1)]
    )
    flat = points.reshape(-1, 3)
    return Mesh(flat, smooth_normals(flat, faces), uv.reshape(-1, 2), faces, closed)


def smooth_normals(points: Array, faces: Faces) -> Array:
    """Average the faces' normals at each place, also where vertices are doubled along a seam."""
    corners = points[faces]
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    size = max(float(np.abs(points).max()), 1e-9)
    _, place = np.unique(np.round(points / size, 6), axis=0, return_inverse=True)
    place = place.reshape(-1)
    total = np.zeros((int(place.max()) + 1, 3))
    for corner in range(3):
        np.add.at(total, place[faces[:, corner]], across)
    return _unit(total[place])


def creased(mesh: Mesh, angle: float = 0.7) -> Mesh:
    """Compute normals for a model without any; edges above `angle` (radians) stay sharp."""
    corners = mesh.points[mesh.faces]
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    unit = _unit(across)
    flat = mesh.faces.ravel()
    size = max(float(np.abs(mesh.points).max()), 1e-9)
    _, place = np.unique(np.round(mesh.points / size, 6), axis=0, return_inverse=True)
    at = place.reshape(-1)[flat]
    order = np.argsort(at, kind="stable")
    normals = np.empty((len(flat), 3))
    for group in np.split(order, np.flatnonzero(np.diff(at[order])) + 1):
        face = group // 3
        normals[group] = (unit[face] @ unit[face].T > np.cos(angle)) @ across[face]
    faces = np.arange(len(flat)).reshape(-1, 3)
    return replace(
        mesh, points=mesh.points[flat], normals=_unit(normals), uv=mesh.uv[flat], faces=faces
    )


def outwards(mesh: Mesh) -> Mesh:
    """Flip a closed mesh's faces if they enclose a negative volume."""
    a, b, c = np.moveaxis(mesh.points[mesh.faces], 1, 0)
    if not mesh.closed or float(np.einsum("ij,ij->", a, np.cross(b, c))) >= 0:
        return mesh
    return replace(mesh, faces=mesh.faces[:, ::-1], normals=-mesh.normals)


def join(meshes: list[Mesh]) -> Mesh:
    """Join meshes into one."""
    starts = np.cumsum([0, *(len(mesh.points) for mesh in meshes[:-1])])
    return Mesh(
        np.concatenate([mesh.points for mesh in meshes]),
        np.concatenate([mesh.normals for mesh in meshes]),
        np.concatenate([mesh.uv for mesh in meshes]),
        np.concatenate([mesh.faces + start for mesh, start in zip(meshes, starts, strict=True)]),
        all(mesh.closed for mesh in meshes),
    )


def moved(mesh: Mesh, turn: Array, shift: Array) -> Mesh:
    """Turn by a rotation (3, 3), then shift (3,)."""
    return replace(mesh, points=mesh.points @ turn.T + shift, normals=mesh.normals @ turn.T)


def fitted(meshes: list[Mesh]) -> list[Mesh]:
    """Scale the parts of an object to a bounding radius of 1, centred in x and z, on y = 0."""
    points = np.concatenate([mesh.points for mesh in meshes])
    low = points.min(axis=0)
    high = points.max(axis=0)
    radius = float(np.linalg.norm(points - (low + high) / 2, axis=1).max())
    foot = np.array([(low[0] + high[0]) / 2, low[1], (low[2] + high[2]) / 2])
    return [replace(mesh, points=(mesh.points - foot) / radius) for mesh in meshes]


def box_mapped(mesh: Mesh) -> Mesh:
    """Project each face along its main axis for its uv: for models with a new surface."""
    corners = mesh.points[mesh.faces]
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    axis = np.abs(across).argmax(axis=1)
    along = np.array([[2, 1], [0, 2], [0, 1]])[axis]
    uv = np.take_along_axis(corners, along[:, None, :].repeat(3, axis=1), axis=2)
    flat = mesh.faces.ravel()
    faces = np.arange(len(flat)).reshape(-1, 3)
    return replace(
        mesh,
        points=mesh.points[flat],
        normals=mesh.normals[flat],
        uv=uv.reshape(-1, 2),
        faces=faces,
    )


def rotation(axis: Array, angle: float) -> Array:
    """Return the rotation matrix (3, 3) about a unit axis by an angle in radians (Rodrigues)."""
    x, y, z = axis
    k = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    turn: Array = np.eye(3) + np.sin(angle) * k + (1 - np.cos(angle)) * k @ k
    return turn


def any_rotation(rng: np.random.Generator) -> Array:
    """Return a random rotation matrix (3, 3)."""
    axis = rng.normal(size=3)
    return rotation(axis / np.linalg.norm(axis), rng.uniform(0, 2 * np.pi))


def write_ply(mesh: Mesh, path: Path) -> None:
    """Write a binary PLY with normals and texture coordinates (u, v)."""
    rows = np.hstack([mesh.points, mesh.normals, mesh.uv]).astype("<f4")
    faces = np.empty(len(mesh.faces), dtype=[("n", "u1"), ("v", "<i4", (3,))])
    faces["n"], faces["v"] = 3, mesh.faces
    fields = "".join(f"property float {name}\n" for name in _PLY)
    head = f"ply\nformat binary_little_endian 1.0\nelement vertex {len(rows)}\n{fields}"
    head += f"element face {len(faces)}\nproperty list uchar int vertex_indices\nend_header\n"
    path.write_bytes(head.encode() + rows.tobytes() + faces.tobytes())


def revolved(profile: Array, steps: int = 64) -> Mesh:
    """Turn a closed or axis-to-axis profile (N, 2) of radius and height about y."""
    angle = np.linspace(0, 2 * np.pi, steps + 1)
    radius = profile[:, :1]
    height = profile[:, 1:]
    points = np.stack(
        np.broadcast_arrays(radius * np.cos(angle), height, radius * np.sin(angle)), -1
    )
    length = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(profile, axis=0), axis=1))])
    # All rows share one turn of u, so that a texture keeps its scale at the widest place.
    around = angle * max(float(profile[:, 0].max()), 1e-6)
    uv = np.stack(np.broadcast_arrays(around[None, :], length[:, None]), -1)
    return grid_mesh(points, uv, closed=True)


def cube_sphere(warp: Warp, side: int = 24) -> Mesh:
    """Warp the surface of a cube, (V, 3) in -1..1; uv are the face's own coordinates."""
    axis = np.tan(np.linspace(-np.pi / 4, np.pi / 4, side + 1))
    a, b = np.meshgrid(axis, axis, indexing="ij")
    patches = []
    for normal in range(3):
        for sign in (-1.0, 1.0):
            cube = np.empty((side + 1, side + 1, 3))
            cube[..., normal], cube[..., (normal + 1) % 3] = sign, a
            cube[..., (normal + 2) % 3] = b if sign > 0 else -b
            points = warp(cube.reshape(-1, 3)).reshape(cube.shape)
            patches.append(grid_mesh(points, np.stack([a, b], -1), closed=True))
    whole = join(patches)
    return replace(whole, normals=smooth_normals(whole.points, whole.faces))


def sheet(height: Warp, half: tuple[float, float], side: int = 72) -> Mesh:
    """Lift a rectangle of half sizes along x and z by `height` of (V, 2): an open surface."""
    x, z = np.meshgrid(
        np.linspace(-half[0], half[0], side), np.linspace(-half[1], half[1], side), indexing="ij"
    )
    flat = np.stack([x, z], -1)
    y = height(flat.reshape(-1, 2)).reshape(side, side)
    lengths = [
        np.concatenate([[0], np.cumsum(np.hypot(np.diff(c), np.diff(h)))])
        for c, h in ((x[:, 0], y[:, side // 2]), (z[0], y[side // 2]))
    ]
    uv = np.stack(np.meshgrid(*lengths, indexing="ij"), -1)
    points = np.stack([x, y, z], -1)
    return grid_mesh(points[::-1], uv[::-1], closed=False)


def _unit(vectors: Array) -> Array:
    """Scale (N, 3) to length 1; a zero vector stays."""
    return np.asarray(vectors / np.maximum(np.linalg.norm(vectors, axis=1, keepdims=True), 1e-12))
