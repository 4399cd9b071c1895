"""Which triangle each pixel sees: a batched z-buffer. Knows no light and no material.

As game engines do it. Triangles become rows, rows become pixels, each with its inverse depth (which
is linear across the screen); the greatest inverse depth of a pixel wins. Everything is flat tensors
over all pictures of a batch at once, so it runs on CPU or GPU without a loop over triangles.
"""

from __future__ import annotations

from dataclasses import dataclass

import torch
from torch import Tensor


@dataclass(frozen=True, slots=True)
class Triangles:
    """x, y (F, 3) in pixels, y down, and inverse depth (F, 3) of corners; picture (F,) int64."""

    x: Tensor
    y: Tensor
    nearness: Tensor
    picture: Tensor


@dataclass(frozen=True, slots=True)
class Seen:
    """pixel, face (P,) int64 of pixels that see a triangle; weights (P, 3) of its corners."""

    pixel: Tensor
    face: Tensor
    weights: Tensor


def facing(triangles: Triangles) -> Tensor:
    """Twice the signed area on screen: (F,), positive when the front is seen."""
    x, y = triangles.x, triangles.y
    return (x[:, 2] - x[:, 0]) * (y[:, 1] - y[:, 0]) - (x[:, 1] - x[:, 0]) * (y[:, 2] - y[:, 0])


def nearest(triangles: Triangles, keep: Tensor, side: int, behind: Tensor) -> tuple[Tensor, Tensor]:
    """Draw the triangles where keep (F,) is true, over `behind` (N * side * side,).

    Returns inverse depth per pixel, and the face seen there (int64, -1: none), both flat.
    """
    chosen = keep.nonzero()[:, 0]
    index, pixel, near = _fragments(triangles, chosen, side)
    depth = behind.scatter_reduce(0, pixel, near, "amax")
    winner = near >= depth[pixel]
    face = torch.full_like(behind, -1, dtype=torch.int64)
    face[pixel[winner]] = index[winner]
    return depth, face


def seen(triangles: Triangles, face: Tensor, side: int) -> Seen:
    """Perspective-correct corner weights at the pixels where face (N * side * side,) >= 0."""
    pixel = (face >= 0).nonzero()[:, 0]
    of = face[pixel]
    px = (pixel % side).to(triangles.x) + 0.5
    py = (pixel // side % side).to(triangles.x) + 0.5
    x, y, near = triangles.x[of], triangles.y[of], triangles.nearness[of]
    dx, dy = x - px[:, None], y - py[:, None]
    after, last = [1, 2, 0], [2, 0, 1]
    areas = dx[:, after] * dy[:, last] - dx[:, last] * dy[:, after]
    weights = areas * near
    total = weights.sum(1, keepdim=True)
    tiny = total.abs() < 1e-12
    weights = torch.where(tiny, torch.full_like(weights, 1 / 3), weights / total)
    return Seen(pixel, of, weights.clamp(-0.5, 1.5))


def _fragments(triangles: Triangles, chosen: Tensor, side: int) -> tuple[Tensor, Tensor, Tensor]:
    """All covered pixels: face, pixel, inverse depth, each (K,)."""
    x, y, near = triangles.x[chosen], triangles.y[chosen], triangles.nearness[chosen]
    top = (y.amin(1) - 0.5).ceil().clamp(0, side).long()
    bottom = (y.amax(1) - 0.5).floor().clamp(-1, side - 1).long()
    of, row = _counted((bottom - top + 1).clamp(min=0))
    row = row + top[of]
    left, right = _span(x[of], y[of], row + 0.5)
    start = (left - 0.5).ceil().clamp(0, side).long()
    end = (right - 0.5).floor().clamp(-1, side - 1).long()
    line, column = _counted((end - start + 1).clamp(min=0))
    column = column + start[line]
    slope_x, slope_y, base = _plane(x, y, near)
    begin = base[of] + slope_y[of] * (row + 0.5)
    depth = begin[line] + slope_x[of][line] * (column + 0.5)
    first = (triangles.picture[chosen][of] * side + row) * side
    return chosen[of][line], first[line] + column, depth


def _counted(counts: Tensor) -> tuple[Tensor, Tensor]:
    """For every unit of counts (K,): whose it is, and its number within that one."""
    owner = torch.repeat_interleave(counts)
    starts = torch.cumsum(counts, 0) - counts
    return owner, torch.arange(len(owner), device=counts.device) - starts[owner]


def _span(x: Tensor, y: Tensor, row: Tensor) -> tuple[Tensor, Tensor]:
    """Where a row (K,) enters and leaves its triangle, corners (K, 3)."""
    left, right = torch.full_like(row, 1e9), torch.full_like(row, -1e9)
    for a, b in ((0, 1), (1, 2), (2, 0)):
        ya, yb = y[:, a], y[:, b]
        crossed = (torch.minimum(ya, yb) <= row) & (row <= torch.maximum(ya, yb)) & (ya != yb)
        share = (row - ya) / torch.where(ya == yb, 1.0, yb - ya)
        at = x[:, a] + share * (x[:, b] - x[:, a])
        left = torch.where(crossed, torch.minimum(left, at), left)
        right = torch.where(crossed, torch.maximum(right, at), right)
    return left, right


def _plane(x: Tensor, y: Tensor, near: Tensor) -> tuple[Tensor, Tensor, Tensor]:
    """Slopes of inverse depth along x and y, and its value at the screen's origin: (F,) each."""
    x1, x2 = x[:, 1] - x[:, 0], x[:, 2] - x[:, 0]
    y1, y2 = y[:, 1] - y[:, 0], y[:, 2] - y[:, 0]
    n1, n2 = near[:, 1] - near[:, 0], near[:, 2] - near[:, 0]
    area = x1 * y2 - x2 * y1
    area = torch.where(area.abs() < 1e-6, 1e9, area)
    slope_x = (n1 * y2 - n2 * y1) / area
    slope_y = (x1 * n2 - x2 * n1) / area
    return slope_x, slope_y, near[:, 0] - slope_x * x[:, 0] - slope_y * y[:, 0]
