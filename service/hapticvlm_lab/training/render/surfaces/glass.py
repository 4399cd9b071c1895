"""Glass: clear, tinted, frosted, rippled, dirty. What it lets through is the shader's affair."""

from __future__ import annotations

import torch
from torch import Tensor

from hapticvlm_lab.training.render.dice import Dice
from hapticvlm_lab.training.render.noise import cells, fractal, hue, noise, paint, plane, ramp, rgb
from hapticvlm_lab.training.render.surface import Finish, Surface


def clear(dice: Dice) -> Surface:
    """Clear, seen by what it bends and mirrors."""
    tint = rgb(dice, 1.0, 1.0, 1.0) - rgb(dice, 0.12, 0.02, 0.06) * dice.uniform()
    return _glass(dice, tint, 0.12 * fractal(dice, 2, 3), dice.uniform(0.02, 0.12))


def tinted(dice: Dice) -> Surface:
    """Coloured through: bottle green, amber, blue, smoky."""
    tint = hue(dice, dice.uniform(), dice.uniform(0.15, 0.85), dice.uniform(0.45, 1))
    return _glass(dice, tint, 0.12 * fractal(dice, 2, 3), dice.uniform(0.02, 0.12))


def frosted(dice: Dice) -> Surface:
    """Etched: milky, blurs what is behind."""
    tint = hue(dice, dice.uniform(), dice.uniform(0, 0.3), dice.uniform(0.8, 1))
    rough = dice.uniform(0.2, 0.55)
    return _glass(dice, tint, 0.3 * noise(dice, 200), 0.1, frost=dice.uniform(0.5, 1), rough=rough)


def rippled(dice: Dice) -> Surface:
    """Pressed or blown: ripples, dimples or flutes that scatter what is behind."""
    x, _ = plane(dice.device)
    near, _, _ = cells(dice, dice.integer(8, 22))
    relief = dice.choose(
        (
            1.5 * fractal(dice, 9, 3, 0.6),
            3.0 * near,
            1.5 * torch.sin(x * dice.uniform(30, 110)),
        )
    )
    tint = hue(dice, dice.uniform(), dice.uniform(0, 0.4), 1.0)
    return _glass(dice, tint, relief, dice.uniform(0.2, 0.5))


def _glass(
    dice: Dice,
    tint: Tensor,
    relief: Tensor,
    bump: float,
    *,
    frost: float = 0.0,
    rough: float = 0.03,
) -> Surface:
    dirt = ramp(0.2, 1.4, fractal(dice, 4, 5)) * float(dice.chance(0.25)) * dice.uniform(0, 0.25)
    red, green, blue = (float(channel) for channel in tint.clamp(0, 1))
    finish = Finish(
        transmission=1.0,
        tint=(red, green, blue),
        thin=float(dice.chance(0.5)),
        frost=frost,
        ior=dice.uniform(1.45, 1.7),
        reflectance=0.045,
    )
    albedo = paint(rgb(dice, 0.8, 0.8, 0.78)) * dirt + 0.01 + 0.25 * frost * dice.uniform()
    return Surface(albedo, relief, rough + 0.5 * dirt, bump, finish=finish)


KINDS = (("clear", clear, 3.0), ("tinted", tinted, 2.5), ("frosted", frosted, 1.2),
         ("rippled", rippled, 1.0))  # fmt: skip
