"""How a training batch is varied: frame, light, sharpness, mask, surroundings. Batched torch."""

from __future__ import annotations

import math

import torch
from torch import Tensor
from torch.nn import functional

SWAP, DISC, WHOLE, LOOSE = 0.25, 0.12, 0.08, 0.15  # shares of crops
GREY = 0.06
LUMA = (0.299, 0.587, 0.114)


def vary(crops: Tensor, side: int, dice: torch.Generator) -> Tensor:
    """Vary (N, S, S, 4) uint8 into (N, side, side, 4) uint8."""
    planes = crops.permute(0, 3, 1, 2).float() / 255.0
    planes = _frame(planes, side, dice)
    colour, mask = planes[:, :3], (planes[:, 3:] > 0.5).float()
    colour = _surround(colour, mask, dice)
    colour = _sharpness(_light(colour, dice), dice)
    mask = _mask(mask, dice)
    both = torch.cat([colour.clamp(0.0, 1.0), mask], dim=1)
    return (both * 255.0).round().byte().permute(0, 2, 3, 1).contiguous()


def _frame(planes: Tensor, side: int, dice: torch.Generator) -> Tensor:
    """Scale, shift, turn, mirror."""
    n = len(planes)
    scale = _between(n, 0.6, 1.02, dice)
    shift = (torch.rand(n, 2, generator=dice) * 2 - 1) * (1.02 - scale)[:, None]
    turn = torch.randn(n, generator=dice) * math.radians(12)
    mirror = torch.where(torch.rand(n, generator=dice) < 0.5, -1.0, 1.0)
    cos, sin = torch.cos(turn) * scale, torch.sin(turn) * scale
    rows = torch.stack(
        [
            torch.stack([cos * mirror, -sin, shift[:, 0]], dim=1),
            torch.stack([sin * mirror, cos, shift[:, 1]], dim=1),
        ],
        dim=1,
    )
    grid = functional.affine_grid(rows, [n, 4, side, side], align_corners=False)
    return functional.grid_sample(planes, grid, padding_mode="reflection", align_corners=False)


def _surround(colour: Tensor, mask: Tensor, dice: torch.Generator) -> Tensor:
    """Put some objects before another picture of the batch."""
    n = len(colour)
    chosen = (torch.rand(n, generator=dice) < SWAP).float().view(n, 1, 1, 1)
    keep = torch.maximum(mask, 1.0 - chosen)
    return colour * keep + colour.roll(1, dims=0) * (1.0 - keep)


def _light(colour: Tensor, dice: torch.Generator) -> Tensor:
    """Exposure, gamma, white balance, contrast, saturation; some without colour."""
    n = len(colour)
    gamma = torch.exp(torch.randn(n, 1, 1, 1, generator=dice) * 0.18)
    gain = torch.exp(torch.randn(n, 1, 1, 1, generator=dice) * 0.22)
    balance = torch.exp(torch.randn(n, 3, 1, 1, generator=dice) * 0.06)
    lit = colour.clamp(1e-3, 1.0) ** gamma * gain * balance
    mean = lit.mean(dim=(1, 2, 3), keepdim=True)
    lit = mean + (lit - mean) * _between(n, 0.7, 1.3, dice).view(n, 1, 1, 1)
    luma = (lit * torch.tensor(LUMA).view(1, 3, 1, 1)).sum(dim=1, keepdim=True)
    saturation = _between(n, 0.6, 1.3, dice)
    saturation = torch.where(torch.rand(n, generator=dice) < GREY, 0.0, saturation)
    return luma + (lit - luma) * saturation.view(n, 1, 1, 1)


def _sharpness(colour: Tensor, dice: torch.Generator) -> Tensor:
    """Blur some by a smaller picture of them, sharpen some, add noise to some."""
    n, side = len(colour), colour.shape[-1]
    order = torch.randperm(n, generator=dice)
    soft, hard = order[: n * 3 // 10], order[n * 17 // 20 :]
    factor = 1 / float(_between(1, 1.3, 3.0, dice))
    small = functional.interpolate(
        colour[soft], scale_factor=factor, mode="bilinear", antialias=True, align_corners=False
    )
    wide = functional.interpolate(small, (side, side), mode="bilinear", align_corners=False)
    mean = functional.avg_pool2d(colour[hard], 3, stride=1, padding=1)
    mixed = colour.clone()
    mixed[soft] = wide
    mixed[hard] = colour[hard] + (colour[hard] - mean) * 0.7
    noisy = torch.randperm(n, generator=dice)[: n // 3]
    amount = _between(len(noisy), 0.0, 0.04, dice).view(-1, 1, 1, 1)
    mixed[noisy] += torch.randn(mixed[noisy].shape, generator=dice) * amount
    return mixed


def _mask(mask: Tensor, dice: torch.Generator) -> Tensor:
    """Replace some masks by a disc or the whole crop; loosen the edge of some."""
    n, side = len(mask), mask.shape[-1]
    axis = (torch.arange(side) + 0.5) / side - 0.5
    disc = ((axis[:, None] ** 2 + axis[None, :] ** 2) <= 0.16).float().view(1, 1, side, side)
    fate = torch.rand(n, 1, 1, 1, generator=dice)
    few = functional.avg_pool2d(mask, 4)
    wide = functional.interpolate(functional.avg_pool2d(few, 3, stride=1, padding=1), (side, side))
    loose = (wide > _between(n, 0.1, 0.9, dice).view(n, 1, 1, 1)).float()
    mask = torch.where(fate < LOOSE, loose, mask)
    mask = torch.where(fate > 1 - WHOLE, torch.ones_like(mask), mask)
    changed = torch.where((fate < 1 - WHOLE) & (fate > 1 - WHOLE - DISC), disc, mask)
    empty = changed.sum(dim=(1, 2, 3), keepdim=True) < 4
    return torch.where(empty, torch.ones_like(changed), changed)


def _between(n: int, low: float, high: float, dice: torch.Generator) -> Tensor:
    return torch.rand(n, generator=dice) * (high - low) + low
