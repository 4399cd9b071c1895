"""Fabric: plain, twill, satin and basket weave, knit, felt, pile, denim, stripes and prints."""

from __future__ import annotations

import math
from collections.abc import Callable

import torch
from torch import Tensor

from hapticvlm_lab.training.render.dice import Dice
from hapticvlm_lab.training.render.noise import (
    any_colour,
    fractal,
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


def plain(dice: Dice) -> Surface:
    """Plain weave: over one, under one."""
    return _woven(dice, lambda i, j: (i + j) % 2)


def basket(dice: Dice) -> Surface:
    """Basket weave: over two, under two."""
    return _woven(dice, lambda i, j: (torch.floor(i / 2) + torch.floor(j / 2)) % 2)


def twill(dice: Dice) -> Surface:
    """Twill: diagonal ribs."""
    step, over = dice.integer(3, 4), dice.choose((1, 1, 2))
    return _woven(dice, lambda i, j: ((i + j) % step < over).float())


def satin(dice: Dice) -> Surface:
    """Satin: long floats that shine along the thread."""
    surface = _woven(dice, lambda i, j: ((i * 2 + j) % 5 < 1).float(), fine=True)
    finish = Finish(sheen=dice.uniform(0.1, 0.5), anisotropy=dice.uniform(0.5, 1), reflectance=0.06)
    rough = surface.roughness * dice.uniform(0.35, 0.55)
    return Surface(surface.albedo, surface.height, rough, dice.uniform(0.1, 0.4), finish=finish)


def denim(dice: Dice) -> Surface:
    """Denim: twill of blue and white threads, faded in places."""
    blue = vary(dice, rgb(dice, 0.05, 0.09, 0.22), 0.15, 0.4)
    white = vary(dice, rgb(dice, 0.6, 0.6, 0.58))
    weft = mix(blue, white, dice.uniform(0.3, 0.8))
    surface = _woven(dice, lambda i, j: ((i + j) % 3 < 1).float(), colours=(blue, weft))
    faded = ramp(-0.5, 1.5, fractal(dice, 3, 5)) * dice.uniform(0, 0.7)
    albedo = mix(surface.albedo, paint(white) * 0.7, faded)
    return Surface(albedo, surface.height, surface.roughness, surface.bump, 0.0, surface.finish)


def knit(dice: Dice) -> Surface:
    """Knitted: columns of V-shaped stitches."""
    x, y = _warped(dice)
    count = dice.spread(8, 34)
    column = x * count * 0.5
    slant = (column - column.floor() - 0.5).abs() * 2
    row = y * count * 0.7 + slant * 0.8
    part = row - row.floor() - 0.5
    stitch = torch.cos(part * math.pi).clamp(0, 1)
    stitch = stitch * (0.4 + 0.6 * torch.cos((slant - 0.5) * math.pi).clamp(0, 1))
    threads = _fuzz(dice) * dice.uniform(0.06, 0.2)
    height = stitch + threads
    colour = _dyed(dice)
    stripes = ((torch.floor(row) % dice.integer(4, 14)) < 2).float() * float(dice.chance(0.3))
    albedo = mix(paint(colour), paint(any_colour(dice)), stripes)
    albedo = albedo * (0.35 + 0.7 * height.clamp(0, 1.1)) * (1 + threads)
    return _cloth(dice, albedo, height, dice.uniform(0.6, 1.8))


def felt(dice: Dice) -> Surface:
    """Felt or fleece: no weave, only fibres."""
    fibres = 0.35 * fractal(dice, 30, 4, 0.8)
    fibres = fibres + 0.15 * noise(dice, 40, 200) + 0.15 * noise(dice, 200, 40)
    albedo = paint(_dyed(dice)) * (0.75 + 0.3 * fibres) * (1 + 0.06 * fractal(dice, 3, 3))
    return _cloth(dice, albedo, 0.8 * fibres, dice.uniform(0.4, 1.4))


def pile(dice: Dice) -> Surface:
    """Carpet, terry or plush: tufts, brushed here and there."""
    tufts = noise(dice, dice.uniform(70, 160)) + 0.6 * noise(dice, 220)
    brushed = fractal(dice, 3, 3) * dice.uniform(0, 0.25)
    colour, other = _dyed(dice), any_colour(dice)
    flecks = ramp(0.6, 1.0, noise(dice, 120)) * dice.uniform(0, 1) * float(dice.chance(0.4))
    albedo = mix(paint(colour), paint(other), flecks) * (0.65 + 0.25 * tufts + brushed).clamp(
        0.1, 2
    )
    return _cloth(dice, albedo, tufts, dice.uniform(0.8, 2.0))


def velvet(dice: Dice) -> Surface:
    """Velvet: dark face on, bright at grazing angles."""
    colour = _dyed(dice) * 0.6
    brushed = fractal(dice, 2, 4) * dice.uniform(0.05, 0.3)
    fine = noise(dice, 255)
    albedo = paint(colour) * (1 + brushed + 0.06 * fine).clamp(0.2, 2)
    finish = Finish(
        sheen=dice.uniform(0.6, 1.5), reflectance=0.02, sheen_colour=_triple(colour * 2 + 0.1)
    )
    rough = torch.full_like(fine, 0.95)
    return Surface(albedo, 0.3 * fine + brushed, rough, dice.uniform(0.2, 0.6), finish=finish)


def printed(dice: Dice) -> Surface:
    """Make a woven ground with a print: stripes, checks, dots or blots."""
    ground = plain(dice) if dice.chance(0.6) else twill(dice)
    x, y = plane(dice.device)
    count = dice.integer(2, 10)
    pattern = dice.choose(("stripes", "checks", "dots", "blots"))
    if pattern == "stripes":
        share = ((x * count) % 1 < dice.uniform(0.2, 0.6)).float()
    elif pattern == "checks":
        share = (((x * count) % 1 < 0.5).float() + ((y * count) % 1 < 0.5).float()) / 2
    elif pattern == "dots":
        away = ((x * count) % 1 - 0.5) ** 2 + ((y * count) % 1 - 0.5) ** 2
        share = ramp(0.07, 0.05, away)
    else:
        share = ramp(-0.05, 0.05, fractal(dice, 4, 3) - 0.4)
    ink = paint(any_colour(dice)) * (0.45 + 0.6 * ground.height.clamp(0, 1.1))
    albedo = mix(ground.albedo, ink, share * dice.uniform(0.6, 1))
    return Surface(albedo, ground.height, ground.roughness, ground.bump, 0.0, ground.finish)


def _woven(
    dice: Dice,
    over: Callable[[Tensor, Tensor], Tensor],
    *,
    fine: bool = False,
    colours: tuple[Tensor, Tensor] | None = None,
) -> Surface:
    """Warp and weft; over(i, j) is 1 where warp thread i passes over weft thread j."""
    x, y = _warped(dice)
    count = dice.spread(36, 72) if fine else dice.spread(16, 64)
    across, down = x * count, y * count * dice.uniform(0.7, 1.3)
    i, j = across.floor(), down.floor()
    u, v = (across - i - 0.5) * math.pi, (down - j - 0.5) * math.pi
    up = 2 * over(i, j) - 1
    warp = torch.cos(u).clamp(0, 1) ** 0.7 * (0.55 + 0.45 * torch.cos(v) * up)
    weft = torch.cos(v).clamp(0, 1) ** 0.7 * (0.55 - 0.45 * torch.cos(u) * up)
    is_warp = (warp > weft).float()
    threads = _fuzz(dice) + 0.4 * mix(noise(dice, 60, 250), noise(dice, 250, 60), is_warp)
    height = torch.maximum(warp, weft) + 0.1 * threads * dice.uniform(0.3, 1.6)
    first, second = colours or _threads(dice)
    albedo = mix(paint(second), paint(first), is_warp) * (0.45 + 0.6 * height.clamp(0, 1.1))
    albedo = albedo * (1 + 0.1 * threads + 0.06 * fractal(dice, 3, 3))
    return _cloth(dice, albedo, height, dice.uniform(0.4, 1.6))


def _warped(dice: Dice) -> tuple[Tensor, Tensor]:
    """Coordinates of a cloth: turned, slightly pulled out of shape."""
    x, y = turned(*plane(dice.device), dice.uniform(-0.5, 0.5))
    return x + noise(dice, 5) * 0.004, y + noise(dice, 5) * 0.004


def _fuzz(dice: Dice) -> Tensor:
    return 0.5 * noise(dice, 220) + 0.4 * noise(dice, 128)


def _dyed(dice: Dice) -> Tensor:
    """Make a colour of cloth: any, often of undyed linen or dull."""
    if dice.chance(0.2):
        return vary(dice, rgb(dice, 0.65, 0.58, 0.46), 0.05, 0.25)
    return any_colour(dice, 1.4, 0.06)


def _threads(dice: Dice) -> tuple[Tensor, Tensor]:
    """Colours of warp and weft, often about the same."""
    warp = _dyed(dice)
    if dice.chance(0.6):
        return warp, warp * dice.spread(0.85, 1.15)
    return warp, _dyed(dice)


def _triple(colour: Tensor) -> tuple[float, float, float]:
    red, green, blue = (float(channel) for channel in colour.clamp(0, 1))
    return red, green, blue


def _cloth(dice: Dice, albedo: Tensor, height: Tensor, bump: float) -> Surface:
    finish = Finish(
        sheen=dice.uniform(0, 0.5) if dice.chance(0.7) else 0.0,
        reflectance=dice.uniform(0.015, 0.04),
        wrap=dice.uniform(0, 0.3),
    )
    rough = torch.full_like(height, dice.uniform(0.7, 1))
    return Surface(albedo, height, rough, bump, finish=finish)


KINDS = (
    ("plain", plain, 2.0),
    ("basket", basket, 0.7),
    ("twill", twill, 1.2),
    ("satin", satin, 1.0),
    ("denim", denim, 0.8),
    ("knit", knit, 1.5),
    ("felt", felt, 1.0),
    ("pile", pile, 1.2),
    ("velvet", velvet, 0.8),
    ("printed", printed, 1.5),
)
