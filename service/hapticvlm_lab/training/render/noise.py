"""Fields from which materials are made: noise, cells, ramps and colours. Knows no material.

Fields are (SIDE, SIDE) float32, y down; colours (3,) or (3, SIDE, SIDE), linear RGB.
"""

from __future__ import annotations

import math
from functools import lru_cache

import torch
from torch import Tensor
from torch.nn import functional

from hapticvlm_lab.training.render.dice import Dice

SIDE = 256  # texels a side of every map


@lru_cache(maxsize=4)
def plane(device: str = "cpu") -> tuple[Tensor, Tensor]:
    """Coordinates x and y of the texels, 0 to 1; not to be changed in place."""
    axis = torch.linspace(0, 1, SIDE, device=device)
    y, x = torch.meshgrid(axis, axis, indexing="ij")
    return x.contiguous(), y.contiguous()


def turned(x: Tensor, y: Tensor, angle: float) -> tuple[Tensor, Tensor]:
    """Turn coordinates about the middle of the map; angle in rad."""
    c, s = math.cos(angle), math.sin(angle)
    return c * (x - 0.5) - s * (y - 0.5) + 0.5, s * (x - 0.5) + c * (y - 0.5) + 0.5


def noise(dice: Dice, columns: float, rows: float | None = None) -> Tensor:
    """Smooth noise of about unit deviation with so many knots across and down."""
    rows = columns if rows is None else rows
    knots = (min(SIDE, max(2, int(rows)) + 1), min(SIDE, max(2, int(columns)) + 1))
    drawn = dice.field(*knots)
    if knots == (SIDE, SIDE):
        return drawn
    grown = functional.interpolate(
        drawn[None, None], (SIDE, SIDE), mode="bicubic", align_corners=True
    )
    return grown[0, 0]


def fractal(dice: Dice, knots: int, octaves: int = 5, decay: float = 0.55) -> Tensor:
    """Noise of several octaves, each `decay` times the one before; about unit deviation."""
    total, weight, power = torch.zeros(SIDE, SIDE, device=dice.device), 1.0, 0.0
    for octave in range(octaves):
        total = total + weight * noise(dice, min(SIDE, knots * 2**octave))
        power += weight * weight
        weight *= decay
    return total / math.sqrt(power)


def cells(dice: Dice, count: int) -> tuple[Tensor, Tensor, Tensor]:
    """Jittered cells: distance to the nearest and second nearest seed (in cells), cell value."""
    x, y = (axis * count for axis in plane(dice.device))
    seeds, values = dice.flat(count, count, 2), dice.flat(count, count)
    column, row = x.long().clamp(max=count - 1), y.long().clamp(max=count - 1)
    first, second = torch.full_like(x, 9.0), torch.full_like(x, 9.0)
    value = torch.zeros_like(x)
    for offset in range(9):
        across, down = column + offset % 3 - 1, row + offset // 3 - 1
        seed = seeds[down % count, across % count]
        distance = (across + seed[..., 0] - x) ** 2 + (down + seed[..., 1] - y) ** 2
        nearer = distance < first
        second = torch.where(nearer, first, torch.minimum(second, distance))
        value = torch.where(nearer, values[down % count, across % count], value)
        first = torch.minimum(first, distance)
    return first.sqrt(), second.sqrt(), value


def hashed(index: Tensor, salt: float = 0.0) -> Tensor:
    """Return a repeatable value in [0, 1) for each whole number."""
    value = torch.sin(index * 12.9898 + salt * 78.233) * 43758.5453
    return value - value.floor()


def ramp(low: float, high: float, value: Tensor) -> Tensor:
    """Smooth step from 0 at `low` to 1 at `high` (or down, when low > high)."""
    t = ((value - low) / (high - low)).clamp(0, 1)
    return t * t * (3 - 2 * t)


def mix(first: Tensor, second: Tensor, share: Tensor | float) -> Tensor:
    """`first` where share is 0, `second` where it is 1."""
    return first + (second - first) * share


def paint(colour: Tensor) -> Tensor:
    """Return a colour (3,) as a field that broadcasts over a map: (3, 1, 1)."""
    return colour[:, None, None]


def rgb(dice: Dice, *values: float) -> Tensor:
    """Return a linear colour (3,) on the device."""
    return torch.tensor(values, device=dice.device)


def hue(dice: Dice, turn: float, saturation: float, value: float) -> Tensor:
    """Return a colour (3,) from hue (in turns), saturation and value."""
    sixth = (turn % 1) * 6
    channels = []
    for offset in (5.0, 3.0, 1.0):
        k = (offset + sixth) % 6
        channels.append(value - value * saturation * max(0.0, min(k, 4 - k, 1.0)))
    return rgb(dice, *channels)


def vary(dice: Dice, colour: Tensor, tint: float = 0.06, level: float = 0.2) -> Tensor:
    """Shift a colour's channels and its level by normal factors of these log deviations."""
    factors = [math.exp(dice.normal(tint)) for _ in range(3)]
    return colour * rgb(dice, *factors) * math.exp(dice.normal(level))


def any_colour(dice: Dice, dull: float = 1.3, darkest: float = 0.04) -> Tensor:
    """Any colour (3,); the greater `dull`, the rarer strong ones."""
    value = dice.uniform(darkest, 0.92)
    return hue(dice, dice.uniform(), dice.uniform() ** dull * 0.9, value)


def shifted(field: Tensor, width: int) -> Tensor:
    """Return a field less its mean over windows of `width` texels: what is high there."""
    pooled = functional.avg_pool2d(field[None, None], width)
    wide = functional.interpolate(pooled, field.shape, mode="bilinear", align_corners=False)
    return field - wide[0, 0]
