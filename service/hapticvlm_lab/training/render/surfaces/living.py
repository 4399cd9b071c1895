"""Foliage, and what none of our classes is: skin, soil, snow, food, water, fur."""

from __future__ import annotations

import torch
from torch import Tensor

from hapticvlm_lab.training.render.dice import Dice
from hapticvlm_lab.training.render.noise import (
    cells,
    fractal,
    hue,
    mix,
    noise,
    paint,
    plane,
    ramp,
    rgb,
    vary,
)
from hapticvlm_lab.training.render.surface import Finish, Surface


def leaf(dice: Dice) -> Surface:
    """Make a leaf's face: midrib and side veins, spots of age."""
    x, y = plane(dice.device)
    across = (x - 0.5).abs()
    side = torch.sin((y * dice.uniform(8, 16) - across * dice.uniform(6, 12)) * 6.283)
    veins = torch.maximum(ramp(0.012, 0.004, across), 0.7 * ramp(0.93, 0.99, side))
    colour = _green(dice)
    old = ramp(0.4, 1.4, fractal(dice, 4, 5)) * dice.uniform(0, 0.8)
    albedo = mix(paint(colour), paint(colour * 0.6 + 0.15), 0.6 * veins)
    albedo = mix(albedo, paint(rgb(dice, 0.4, 0.27, 0.08)), 0.7 * old)
    height = -0.8 * veins + 0.3 * noise(dice, 60)
    finish = Finish(wrap=dice.uniform(0.2, 0.6), reflectance=0.04)
    rough = dice.uniform(0.3, 0.7) + 0 * veins
    return Surface(albedo * (1 + 0.08 * noise(dice, 100)), height, rough, 0.4, finish=finish)


def lawn(dice: Dice) -> Surface:
    """Grass, moss or a hedge seen flat: blades over dark gaps."""
    blades = torch.relu(
        noise(dice, 120, 30) + 0.8 * noise(dice, 200, 60) + 0.6 * noise(dice, 60, 20)
    )
    patches = fractal(dice, 4, 5)
    albedo = paint(_green(dice)) * (0.25 + 0.6 * blades) * (1 + 0.15 * patches)
    dry = ramp(0.3, 1.5, patches) * dice.uniform(0, 0.5)
    albedo = mix(albedo, albedo.mean(0, keepdim=True) * paint(rgb(dice, 1.6, 1.3, 0.6)), dry)
    return _plant(dice, albedo, blades)


def litter(dice: Dice) -> Surface:
    """Leaves lying over one another."""
    albedo = paint(_green(dice) * 0.3).expand(3, *plane(dice.device)[0].shape)
    height = torch.zeros_like(albedo[0])
    for _ in range(4):
        first, second, value = cells(dice, dice.integer(6, 12))
        shape = ramp(0.05, 0.12, second - first) * (value > 0.45)
        vein = ramp(0.03, 0.0, first)
        colour = mix(paint(_green(dice)), paint(_green(dice) * 0.6), value)
        albedo = mix(albedo, colour * (1 - 0.3 * first) * (1 + 0.3 * vein), shape)
        height = mix(height, 1.5 - first, shape)
    return _plant(dice, albedo, height)


def skin(dice: Dice) -> Surface:
    """Human or animal skin."""
    _, second, _ = cells(dice, dice.integer(26, 44))
    colour = vary(dice, rgb(dice, 0.62, 0.38, 0.28), 0.06, 0.4)
    albedo = paint(colour) * (1 + 0.05 * fractal(dice, 4, 5) + 0.02 * _fine(dice))
    finish = Finish(wrap=dice.uniform(0.3, 0.6), reflectance=0.03)
    rough = dice.uniform(0.35, 0.6) + 0 * second
    return Surface(albedo, 0.3 * second, rough, dice.uniform(0.05, 0.3), finish=finish)


def soil(dice: Dice) -> Surface:
    """Soil, mud or sand."""
    clods = fractal(dice, 14, 5, 0.8)
    colour = vary(dice, rgb(dice, *dice.choose(((0.25, 0.17, 0.11), (0.6, 0.5, 0.36)))), 0.06, 0.3)
    albedo = paint(colour) * (1 + 0.3 * clods).clamp(0.1, 2)
    return Surface(albedo, clods, dice.uniform(0.85, 1) + 0 * clods, dice.uniform(0.5, 1.6))


def snow(dice: Dice) -> Surface:
    """Snow or foam."""
    lumps = fractal(dice, 5, 6, 0.6)
    albedo = paint(vary(dice, rgb(dice, 0.88, 0.9, 0.93), 0.01, 0.03)) * (1 + 0.03 * lumps)
    finish = Finish(wrap=0.6, reflectance=0.02)
    return Surface(albedo, lumps, 0.8 + 0 * lumps, dice.uniform(0.3, 0.9), finish=finish)


def food(dice: Dice) -> Surface:
    """Bread, fruit, cheese, meat."""
    spots, fine = fractal(dice, 7, 5), _fine(dice)
    colour = hue(dice, dice.uniform(-0.03, 0.2), dice.uniform(0.4, 0.9), dice.uniform(0.25, 0.9))
    albedo = mix(paint(colour), paint(vary(dice, colour, 0.2, 0.5)), ramp(-0.5, 1.2, spots))
    holes = torch.relu(noise(dice, 25) - 1.3).clamp(0, 1) * float(dice.chance(0.4))
    rough = dice.uniform(0.25, 0.8) + 0 * spots
    finish = Finish(wrap=dice.uniform(0.2, 0.6))
    height = 0.5 * spots + 0.1 * fine - 2 * holes
    return Surface(albedo * (1 - 0.4 * holes), height, rough, dice.uniform(0.1, 0.7), finish=finish)


def water(dice: Dice) -> Surface:
    """Water or another liquid from above: ripples that mirror."""
    ripples = noise(dice, 10) + 0.5 * noise(dice, 26) + 0.2 * noise(dice, 60)
    colour = hue(dice, dice.uniform(0.4, 0.65), dice.uniform(0.2, 0.8), dice.uniform(0.02, 0.3))
    albedo = paint(colour).expand(3, *ripples.shape)
    rough = torch.full_like(ripples, 0.04)
    return Surface(albedo, 3 * ripples, rough, dice.uniform(0.2, 0.8), finish=Finish(coat=1.0))


def fur(dice: Dice) -> Surface:
    """Fur or hair: long strands."""
    strands = noise(dice, 160, 12) + 0.7 * noise(dice, 220, 30) + 0.4 * fractal(dice, 3, 4)
    colour = vary(dice, rgb(dice, *dice.choose(((0.35, 0.22, 0.12), (0.7, 0.65, 0.58)))), 0.1, 0.5)
    albedo = paint(colour) * (0.75 + 0.25 * strands).clamp(0.1, 1.6)
    finish = Finish(sheen=dice.uniform(0.1, 0.5), anisotropy=0.6)
    rough = dice.uniform(0.5, 0.9) + 0 * strands
    return Surface(albedo, strands, rough, dice.uniform(0.4, 1.2), finish=finish)


def _fine(dice: Dice) -> Tensor:
    return 0.6 * noise(dice, 230) + 0.5 * noise(dice, 120)


def _green(dice: Dice) -> Tensor:
    turn = dice.uniform(0.02, 0.14) if dice.chance(0.12) else dice.uniform(0.17, 0.37)
    return hue(dice, turn, dice.uniform(0.45, 0.95), dice.uniform(0.1, 0.5))


def _plant(dice: Dice, albedo: Tensor, height: Tensor) -> Surface:
    finish = Finish(wrap=dice.uniform(0.1, 0.5), reflectance=0.03)
    rough = dice.uniform(0.5, 0.9) + 0 * height
    return Surface(albedo, height, rough, dice.uniform(0.5, 1.4), finish=finish)


FOLIAGE = (("leaf", leaf, 2.5), ("lawn", lawn, 1.5), ("litter", litter, 1.2))
UNKNOWN = (
    ("skin", skin, 1.5),
    ("soil", soil, 1.0),
    ("snow", snow, 0.7),
    ("food", food, 1.5),
    ("water", water, 0.8),
    ("fur", fur, 1.0),
)
