"""Wood: annual rings seen along and across, planks, parquet, plywood, chipboard, paint, varnish."""

from __future__ import annotations

import torch
from torch import Tensor

from hapticvlm_lab.training.render.dice import Dice
from hapticvlm_lab.training.render.noise import (
    any_colour,
    fractal,
    hashed,
    mix,
    noise,
    paint,
    plane,
    ramp,
    rgb,
    turned,
    vary,
)
from hapticvlm_lab.training.render.surface import Finish, Surface

# Early and late wood of common kinds, linear colour as seen in photographs; our choice.
_TIMBER = (
    (0.72, 0.52, 0.31, 0.42, 0.23, 0.10),
    (0.62, 0.42, 0.24, 0.36, 0.20, 0.10),
    (0.80, 0.66, 0.45, 0.60, 0.40, 0.20),
    (0.33, 0.19, 0.11, 0.13, 0.07, 0.04),
    (0.50, 0.25, 0.13, 0.27, 0.10, 0.05),
    (0.17, 0.12, 0.09, 0.07, 0.05, 0.04),
    (0.55, 0.50, 0.44, 0.30, 0.27, 0.24),
    (0.76, 0.60, 0.42, 0.50, 0.33, 0.19),
    (0.46, 0.30, 0.17, 0.23, 0.13, 0.07),
)


def board(dice: Dice) -> Surface:
    """Make a sawn board: rings cut along."""
    x, y = turned(*plane(dice.device), dice.uniform(-0.12, 0.12))
    return _grain(dice, x, y, torch.zeros_like(x))


def planks(dice: Dice) -> Surface:
    """Planks side by side, each from another tree."""
    x, y = plane(dice.device)
    count = dice.integer(2, 7)
    number = torch.floor(y * count)
    joint = torch.exp(-((((y * count) - torch.round(y * count)) / count / 0.006) ** 2))
    long = dice.choose((1, 1, 2, 3))
    across = x * long + hashed(number, 3.0)
    if long > 1:
        ends = torch.exp(-(((across - torch.round(across)) / long / 0.005) ** 2))
        joint = torch.maximum(joint, ends)
        number = number + 17 * torch.floor(across)
    return _jointed(_grain(dice, x, y, hashed(number, dice.uniform(0, 9))), joint, 0.8)


def parquet(dice: Dice) -> Surface:
    """Basket parquet: squares of strips, turned by turns."""
    x, y = plane(dice.device)
    count, strips = dice.integer(2, 4), dice.integer(3, 5)
    column, row = torch.floor(x * count), torch.floor(y * count)
    flip = ((column + row) % 2) > 0
    u, v = torch.where(flip, y, x), torch.where(flip, x, y)
    number = torch.floor(v * count * strips) + 31 * torch.floor(u * count)
    lines = v * count * strips
    joint = torch.exp(-(((lines - torch.round(lines)) / 0.05) ** 2))
    return _jointed(_grain(dice, u, v, hashed(number, dice.uniform(0, 9))), joint, 0.6)


def end(dice: Dice) -> Surface:
    """End grain: rings seen across, with cracks from the heart."""
    x, y = plane(dice.device)
    middle = (dice.uniform(0.1, 0.9), dice.uniform(0.1, 0.9))
    dx, dy = x - middle[0], y - middle[1]
    bend = 0.03 * noise(dice, 3) + 0.01 * noise(dice, 9)
    radius = torch.sqrt(dx**2 + dy**2 + 1e-5) + bend
    ring = _rings(dice, radius * dice.spread(8, 30))
    light, dark = _timber(dice)
    angle = torch.atan2(dy, dx)
    rays = torch.sin(angle * dice.integer(40, 90) + 3 * noise(dice, 8)) * 0.05
    crack = torch.relu(torch.cos(angle * dice.integer(1, 3) + dice.uniform(0, 6)) - 0.999) * 800
    crack = crack.clamp(0, 1) * float(dice.chance(0.4))
    albedo = mix(paint(light), paint(dark), (ring + rays).clamp(0, 1.2))
    albedo = albedo * (1 - 0.8 * crack) * (1 + 0.05 * noise(dice, 200))
    rough = dice.uniform(0.6, 0.95) + 0 * ring
    return Surface(albedo, -0.3 * ring - 2 * crack, rough, dice.uniform(0.05, 0.4))


def chipboard(dice: Dice) -> Surface:
    """Chips pressed together (chipboard, OSB)."""
    light, dark = _timber(dice)
    total = torch.zeros_like(plane(dice.device)[0])
    height = total
    for _ in range(7):
        x, y = turned(*plane(dice.device), dice.uniform(0, 3.14))
        count = dice.uniform(8, 20)
        chip = hashed(torch.floor(x * count * 0.4) + 57 * torch.floor(y * count), dice.uniform())
        shown = (noise(dice, 9) > 0.2).float()
        total = mix(total, chip, shown)
        height = height + 0.15 * shown * chip
    grain = noise(dice, 60, 160) * 0.08
    albedo = mix(paint(light), paint(dark), (total + grain).clamp(0, 1)) * (1 + grain)
    rough = dice.uniform(0.6, 0.95) + 0 * total
    return Surface(albedo, total + height, rough, dice.uniform(0.1, 0.6))


def bark(dice: Dice) -> Surface:
    """Bark: deep upright furrows."""
    ridges = noise(dice, 26, 5) + 0.6 * noise(dice, 50, 12) + 0.4 * fractal(dice, 12)
    light, dark = vary(dice, rgb(dice, 0.3, 0.23, 0.17)), rgb(dice, 0.05, 0.035, 0.025)
    albedo = mix(paint(dark), paint(light), ramp(-1.2, 1.3, ridges)) * (1 + 0.12 * noise(dice, 200))
    return Surface(albedo, 2.5 * ridges, dice.uniform(0.85, 1) + 0 * ridges, dice.uniform(0.3, 0.9))


def painted(dice: Dice) -> Surface:
    """Painted wood: grain shows in the paint's relief, bare wood where it has worn off."""
    bare = planks(dice) if dice.chance(0.6) else board(dice)
    coat = paint(any_colour(dice)) * (1 + 0.03 * fractal(dice, 3))
    worn = ramp(0.0, 0.3, fractal(dice, 5) + 0.3 * bare.height - dice.uniform(0.3, 2.0))
    albedo = mix(coat, bare.albedo, worn)
    rough = mix(dice.uniform(0.2, 0.7) + 0 * worn, bare.roughness, worn)
    return Surface(albedo, bare.height - 0.5 * worn, rough, dice.uniform(0.1, 0.6))


def _timber(dice: Dice) -> tuple[Tensor, Tensor]:
    """Early and late wood of one tree: (3,) each."""
    both = rgb(dice, *dice.choose(_TIMBER)).view(2, 3)
    level = 2.718 ** dice.normal(0.2)
    return vary(dice, both[0], 0.08, 0.05) * level, vary(dice, both[1], 0.08, 0.05) * level


def _rings(dice: Dice, radius: Tensor) -> Tensor:
    """Annual rings over a radius in ring widths: late wood 0 to 1, years of unlike strength."""
    share = radius - radius.floor()
    late = share ** dice.uniform(1.2, 4) * ramp(1.0, 0.88, share)
    return late * (0.55 + 0.6 * hashed(radius.floor(), 1.0))


def _grain(dice: Dice, x: Tensor, y: Tensor, piece: Tensor) -> Surface:
    """Long grain of a log cut at coordinates x along and y across; `piece` 0..1 tells boards."""
    bend = noise(dice, 2, 5) * 0.06 + noise(dice, 4, 12) * 0.018
    across = y - 0.5 - dice.uniform(-0.5, 0.5) + piece * 2.3 + bend
    depth = dice.uniform(-0.5, 0.9) + dice.uniform(-0.7, 0.7) * x + noise(dice, 3, 2) * 0.05
    radius = torch.sqrt(across**2 + (depth + 1.7 * piece) ** 2 * dice.uniform(0.1, 1.2) + 1e-4)
    for _ in range(2 * dice.chance(0.35)):
        knot = ((x - dice.uniform()) * 0.5) ** 2 + (y - dice.uniform()) ** 2
        radius = radius + 0.25 * torch.exp(-knot / dice.uniform(0.02, 0.06) ** 2)
    ring = _rings(dice, radius * dice.spread(5, 32))
    fibre = noise(dice, 6, 200) + 0.6 * noise(dice, 14, 255)
    pores = torch.relu(noise(dice, 24, 190) - dice.uniform(0.9, 2.0))
    light, dark = _timber(dice)
    share = ring * dice.uniform(0.3, 1) + 0.08 * fibre + 0.09 * fractal(dice, 2, 3)
    share = (share + 0.25 * (piece - 0.4) * (piece > 0)).clamp(-0.3, 1.2)
    albedo = mix(paint(light), paint(dark), share) * (1 - 0.35 * pores.clamp(0, 1))
    albedo = albedo * (1 + 0.05 * fibre * dice.uniform(0.2, 1.5))
    height = 0.25 * fibre - 0.9 * pores - 0.3 * ring
    rough = dice.uniform(0.35, 0.85) + 0.08 * fibre
    coat = dice.uniform(0.3, 1) if dice.chance(0.4) else 0.0
    finish = Finish(coat=coat, coat_roughness=dice.uniform(0.05, 0.35))
    return Surface(albedo, height, rough, dice.uniform(0.05, 0.7), finish=finish)


def _jointed(surface: Surface, joint: Tensor, dark: float) -> Surface:
    """With grooves where `joint` is 1."""
    albedo = surface.albedo * (1 - dark * joint)
    height = surface.height - 3 * joint
    return Surface(albedo, height, surface.roughness, surface.bump, finish=surface.finish)


KINDS = (
    ("board", board, 3.0),
    ("planks", planks, 3.0),
    ("parquet", parquet, 0.8),
    ("end", end, 0.8),
    ("chipboard", chipboard, 0.6),
    ("bark", bark, 0.6),
    ("painted", painted, 0.8),
)
