"""From scenes to what each pixel sees: positions, normals, texture places.

All pictures of a batch lie in one flat run of pixels, picture after picture, row after row. Vectors
of points are (3, P). Knows nothing of colour.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor

from hapticvlm_lab.training.render import raster
from hapticvlm_lab.training.render.lookup import weighed
from hapticvlm_lab.training.render.mesh import Floats
from hapticvlm_lab.training.render.noise import SIDE
from hapticvlm_lab.training.render.scene import Part, Scene

_NEAREST = 0.05  # nothing nearer to the eye is drawn
_FARTHEST = 1 / 45.0  # inverse depth at which planes end


@dataclass(frozen=True, slots=True)
class Points:
    """What P pixels see. Vectors (3, P), uv (2, P), the rest (P,).

    `pixel` counts over all pictures; `to_eye` points at the eye; `level` is the mip level; `target`
    tells the target's pixels, `plane` floors and walls.
    """

    pixel: Tensor
    picture: Tensor
    material: Tensor
    place: Tensor
    normal: Tensor
    across: Tensor
    down: Tensor
    uv: Tensor
    level: Tensor
    to_eye: Tensor
    target: Tensor
    plane: Tensor


@dataclass(frozen=True, slots=True)
class View:
    """A batch's cameras and triangles on the device; pictures of `side` pixels."""

    side: int
    scenes: tuple[Scene, ...]
    eye: Tensor  # (3, N)
    turn: Tensor  # (N, 3, 3) rows right, up, forward
    focal: Tensor  # (N,) px
    centre: Tensor  # (2, N) px
    vertices: Tensor  # (V, 14): point, normal, across, down, uv
    owner: Tensor  # (V,) picture of each vertex
    faces: Tensor  # (F, 3)
    material: Tensor  # (F,)
    flags: Tensor  # (F, 3) bool: target, open, glass
    triangles: raster.Triangles


def view(scenes: Sequence[Scene], side: int, device: str) -> View:
    """Put scenes on the device and project them."""
    cameras = [scene.camera for scene in scenes]
    eye = stacked([camera.eye for camera in cameras], device).T.contiguous()
    turn = stacked([camera.turn for camera in cameras], device)
    focal = torch.tensor([camera.focal * side for camera in cameras], device=device)
    middles = [[part * side for part in camera.centre] for camera in cameras]
    centre = torch.tensor(middles, device=device).T.contiguous()
    vertices, owner, faces, material, flags = _gathered(scenes, device)
    local = torch.einsum("vij,vj->vi", turn[owner], vertices[:, :3] - eye.T[owner])
    near = 1 / local[:, 2].clamp(min=1e-4)
    x = centre[0, owner] + focal[owner] * local[:, 0] * near
    y = centre[1, owner] - focal[owner] * local[:, 1] * near
    triangles = raster.Triangles(x[faces], y[faces], near[faces], owner[faces[:, 0]])
    return View(side, tuple(scenes), eye, turn, focal, centre, vertices, owner, faces, material,
                flags, triangles)  # fmt: skip


def rays(seen: View, pixel: Tensor) -> Tensor:
    """Directions from the eye through pixels (P,), with forward part 1: (3, P)."""
    picture = torch.div(pixel, seen.side * seen.side, rounding_mode="floor")
    px = (pixel % seen.side).float() + 0.5
    py = (torch.div(pixel, seen.side, rounding_mode="floor") % seen.side).float() + 0.5
    right = (px - seen.centre[0, picture]) / seen.focal[picture]
    up = (seen.centre[1, picture] - py) / seen.focal[picture]
    axes = (
        seen.turn.permute(1, 2, 0)[:, :, picture]
        if len(seen.scenes) > 1
        else seen.turn[0, :, :, None]
    )
    return axes[0] * right + axes[1] * up + axes[2]


def opaque(seen: View) -> tuple[Points, Tensor]:
    """See meshes and planes, glass left out: points, and inverse depth (N * S * S,)."""
    glass, open_ = seen.flags[:, 2], seen.flags[:, 1]
    front = raster.facing(seen.triangles) > 0
    keep = ~glass & (front | open_) & _ahead(seen)
    count = len(seen.scenes) * seen.side**2
    empty = torch.full((count,), _FARTHEST, device=seen.eye.device)
    depth, face = raster.nearest(seen.triangles, keep, seen.side, empty)
    every = torch.arange(count, device=depth.device)
    direction = rays(seen, every)
    depth, which = _planes(seen, direction, depth)
    face = torch.where(which >= 0, -1, face)
    on_planes = (which >= 0).nonzero()[:, 0]
    drawn = raster.seen(seen.triangles, face, seen.side)
    first = mesh_points(seen, drawn)
    second = _plane_points(seen, on_planes, which[on_planes], direction, depth)
    return joined(first, second), depth


def glass(seen: View, depth: Tensor, *, back: bool) -> Points:
    """Front (or back) faces of glass before the opaque ones of inverse depth (N S S,)."""
    facing = raster.facing(seen.triangles)
    keep = seen.flags[:, 2] & ((facing < 0) if back else (facing > 0)) & _ahead(seen)
    _, face = raster.nearest(seen.triangles, keep, seen.side, depth)
    return mesh_points(seen, raster.seen(seen.triangles, face, seen.side))


def mesh_points(seen: View, drawn: raster.Seen) -> Points:
    """Interpolate the corners of what was drawn; normals are turned to the eye."""
    corners = seen.faces[drawn.face]
    fields = weighed(seen.vertices, corners, drawn.weights)
    picture = seen.triangles.picture[drawn.face]
    place, normal = fields[0:3], unit(fields[3:6])
    to_eye = unit(seen.eye[:, picture] - place)
    flip = torch.where((normal * to_eye).sum(0) < 0, -1.0, 1.0)
    coarse = torch.tensor([scene.coarse for scene in seen.scenes], device=place.device)
    level = _mesh_level(seen)[drawn.face] + coarse[picture]
    none = torch.zeros_like(picture, dtype=torch.bool)
    return Points(
        drawn.pixel, picture, seen.material[drawn.face], place, normal * flip, unit(fields[6:9]),
        unit(fields[9:12]), fields[12:14], level, to_eye, seen.flags[drawn.face, 0], none,
    )  # fmt: skip


def joined(first: Points, second: Points) -> Points:
    """Both sets of points as one."""
    pairs = ((getattr(first, name), getattr(second, name)) for name in Points.__slots__)
    return Points(*(torch.cat(pair, -1) for pair in pairs))


def on_screen(seen: View, picture: Tensor, place: Tensor) -> tuple[Tensor, Tensor]:
    """Pixel coordinates (2, P) of places (3, P), and which are ahead of the eye (P,) bool."""
    away = place - seen.eye[:, picture]
    axes = seen.turn.permute(1, 2, 0)[:, :, picture]
    right, up, forward = ((axes[axis] * away).sum(0) for axis in range(3))
    near = 1 / forward.clamp(min=1e-3)
    x = seen.centre[0, picture] + seen.focal[picture] * right * near
    y = seen.centre[1, picture] - seen.focal[picture] * up * near
    return torch.stack([x, y]), forward > _NEAREST


def unit(vectors: Tensor) -> Tensor:
    """Vectors (3, P) at unit length."""
    squared = vectors[0] * vectors[0] + vectors[1] * vectors[1] + vectors[2] * vectors[2]
    return vectors * torch.rsqrt(squared + 1e-12)


def stacked(arrays: Sequence[Floats], device: str) -> Tensor:
    """Put arrays of one shape on the device, one after another."""
    return torch.from_numpy(np.stack(arrays).astype(np.float32)).to(device)


def _gathered(
    scenes: Sequence[Scene], device: str
) -> tuple[Tensor, Tensor, Tensor, Tensor, Tensor]:
    """All meshes: vertices (V, 14), their picture, faces (F, 3), their material and flags."""
    vertices, owner, faces, material, flags = [], [], [], [], []
    start = 0
    for number, scene in enumerate(scenes):
        parts: tuple[Part, ...] = (scene.target, *scene.others)
        for part in parts:
            mesh, is_target = part.mesh, part is scene.target
            count = len(mesh.faces)
            vertices.append(np.concatenate(
                [mesh.points, mesh.normals, mesh.tangents, mesh.bitangents, mesh.uv], 1
            ))  # fmt: skip
            owner.append(np.full(len(mesh.points), number))
            faces.append(mesh.faces + start)
            material.append(np.full(count, part.material))
            flag = (is_target, part.open, is_target and scene.glass)
            flags.append(np.broadcast_to(flag, (count, 3)))
            start += len(mesh.points)
    arrays = (vertices, owner, faces, material, flags)
    both = [torch.from_numpy(np.concatenate(array)).to(device) for array in arrays]
    return both[0].float(), both[1].long(), both[2].long(), both[3].long(), both[4].bool()


def _ahead(seen: View) -> Tensor:
    return (seen.triangles.nearness < 1 / _NEAREST).all(1)


def _mesh_level(seen: View) -> Tensor:
    """Mip level of each face (F,): half the logarithm of texels per pixel."""
    uv = seen.vertices[:, 12:14][seen.faces]
    a, b = uv[:, 1] - uv[:, 0], uv[:, 2] - uv[:, 0]
    texels = (a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]).abs() * SIDE**2
    pixels = raster.facing(seen.triangles).abs()
    return 0.5 * torch.log2((texels / pixels.clamp(min=0.05)).clamp(1e-2, 1e6))


def _planes(seen: View, direction: Tensor, depth: Tensor) -> tuple[Tensor, Tensor]:
    """Let planes hide what is behind them: inverse depth, and index of the plane seen or -1."""
    which = torch.full_like(depth, -1, dtype=torch.int64)
    area = seen.side**2
    for number, scene in enumerate(seen.scenes):
        span = slice(number * area, (number + 1) * area)
        for index, plane in enumerate(scene.planes):
            normal = torch.from_numpy(plane.normal).to(depth)
            away = plane.offset - float(plane.normal @ scene.camera.eye)
            near = (normal[:, None] * direction[:, span]).sum(0) / away
            nearer = near > depth[span]
            depth[span] = torch.where(nearer, near, depth[span])
            which[span] = torch.where(nearer, index, which[span])
    return depth, which


def _plane_points(
    seen: View, pixel: Tensor, which: Tensor, direction: Tensor, depth: Tensor
) -> Points:
    picture = torch.div(pixel, seen.side**2, rounding_mode="floor")
    device = depth.device
    most = max((len(scene.planes) for scene in seen.scenes), default=0)
    table = torch.zeros(len(seen.scenes), max(most, 1), 8, device=device)
    for number, scene in enumerate(seen.scenes):
        for index, plane in enumerate(scene.planes):
            row = [*plane.normal.tolist(), *plane.across.tolist(), plane.material, plane.density]
            table[number, index] = torch.tensor(row)
    facts = table[picture, which].T
    normal, across = facts[0:3], facts[3:6]
    towards = direction[:, pixel]
    place = seen.eye[:, picture] + towards / depth[pixel]
    down = torch.linalg.cross(normal, across, dim=0)
    uv = torch.stack([(place * across).sum(0), (place * down).sum(0)]) * facts[7]
    to_eye = unit(-towards)
    slope = (normal * to_eye).sum(0).abs().clamp(min=0.02)
    size = SIDE * facts[7] / (depth[pixel] * seen.focal[picture])
    level = torch.log2((size / slope.sqrt()).clamp(min=1e-2))
    yes = torch.ones_like(picture, dtype=torch.bool)
    return Points(pixel, picture, facts[6].long(), place, normal, across, down, uv, level, to_eye,
                  ~yes, yes)  # fmt: skip
