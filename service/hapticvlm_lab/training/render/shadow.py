"""Where the sun arrives: a shadow map, drawn from the sun as game engines do. Hard-edged."""

from __future__ import annotations

import numpy as np
import torch
from torch import Tensor

from hapticvlm_lab.training.render import raster
from hapticvlm_lab.training.render.mesh import Floats, floats
from hapticvlm_lab.training.render.scene import Scene
from hapticvlm_lab.training.render.view import Points, View, stacked

_MAP = 192  # px a side of a shadow map
_REACH = 2.4  # half side of what it covers, around the target
_BIAS = 0.03  # a surface nearer to what hides it than this stays lit
_FAR = 50.0  # added to heights, which the rasteriser wants positive


def sunlit(seen: View, points: Points) -> Tensor:
    """How much of the sun reaches points: (P,), 0 in hard shadow, 1 in the open."""
    lit = [bool(scene.sun.colour.any()) for scene in seen.scenes]
    if not any(lit):
        return torch.ones_like(points.level)
    device = str(seen.eye.device)
    frames = stacked([_sun_frame(scene) for scene in seen.scenes], device)
    local = torch.einsum("vij,vj->vi", frames[seen.owner], seen.vertices[:, :3])
    scale = _MAP / (2 * _REACH)
    x, y = (local[:, axis] * scale + _MAP / 2 for axis in (0, 1))
    height = local[:, 2] + _FAR
    owner = seen.triangles.picture
    shadowing = torch.tensor(lit, device=device)[owner] & ~seen.flags[:, 2]
    triangles = raster.Triangles(x[seen.faces], y[seen.faces], height[seen.faces], owner)
    empty = torch.zeros(len(seen.scenes) * _MAP**2, device=device)
    tops, _ = raster.nearest(triangles, shadowing, _MAP, empty)
    axes = frames.permute(1, 2, 0)[:, :, points.picture]
    lifted = points.place + _BIAS * points.normal
    px, py, level = ((axes[axis] * lifted).sum(0) for axis in range(3))
    column, row = ((part * scale + _MAP / 2).long() for part in (px, py))
    inside = (column >= 0) & (column < _MAP) & (row >= 0) & (row < _MAP)
    index = (points.picture * _MAP + row.clamp(0, _MAP - 1)) * _MAP + column.clamp(0, _MAP - 1)
    hidden = inside & (tops[index] > level + _FAR + _BIAS)
    return 1 - hidden.float()


def _sun_frame(scene: Scene) -> Floats:
    towards = scene.sun.direction
    helper = floats([1, 0, 0]) if abs(towards[1]) > 0.9 else floats([0, 1, 0])
    across = np.cross(helper, towards)
    across = across / np.linalg.norm(across)
    return np.stack([across, np.cross(towards, across), towards])
