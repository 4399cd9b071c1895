"""Bilinear look-ups in tables of rows, many maps in one table. Knows nothing of what is in them.

Every map is stored with a border of one pixel that repeats or wraps its edge, so that the four
pixels around any place are always there and no index needs to be folded back.
"""

from __future__ import annotations

import torch
from torch import Tensor
from torch.nn import functional


def weighed(table: Tensor, index: Tensor, weight: Tensor) -> Tensor:
    """Weighted sums of rows: table (R, C), index and weight (P, K) -> (C, P) contiguous."""
    summed = functional.embedding_bag(index, table, per_sample_weights=weight, mode="sum")
    return summed.T.contiguous()


def corners(x: Tensor, y: Tensor, stride: Tensor | int) -> tuple[Tensor, Tensor]:
    """Pixels around places in a bordered map with rows of `stride`: index and weight (P, 4).

    x and y (P,) are in pixels of the map without its border, -0.5 to its size - 0.5.
    """
    left, top = x.floor(), y.floor()
    right, low = x - left, y - top
    first = (top.long() + 1) * stride + left.long() + 1
    both = right * low
    weight = torch.stack([1 - right - low + both, right - both, low - both, both], 1)
    if isinstance(stride, int):
        offsets = torch.tensor([0, 1, stride, stride + 1], device=x.device)
        return first[:, None] + offsets, weight
    below = first + stride
    return torch.stack([first, first + 1, below, below + 1], 1), weight


def bordered(maps: Tensor, *, wraps: bool = False) -> Tensor:
    """Lay maps (N, C, H, W) out as rows (N, (H + 2) * (W + 2), C); `wraps`: left meets right."""
    wide = functional.pad(maps, (1, 1, 0, 0), mode="circular" if wraps else "replicate")
    tall = functional.pad(wide, (0, 0, 1, 1), mode="replicate")
    return tall.permute(0, 2, 3, 1).reshape(len(maps), -1, maps.shape[1])
