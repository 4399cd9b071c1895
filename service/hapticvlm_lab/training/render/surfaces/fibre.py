"""Paper and leather: plain, written, corrugated; smooth, brushed, stitched, embossed."""

from __future__ import annotations

import torch
from torch import Tensor

from hapticvlm_lab.training.render.dice import Dice
from hapticvlm_lab.training.render.noise import (
    any_colour,
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


def white_paper(dice: Dice) -> Surface:
    """Plain or tinted paper."""
    colour = vary(dice, rgb(dice, 0.86, 0.85, 0.81), 0.02, 0.08)
    if dice.chance(0.2):
        colour = hue(dice, dice.uniform(), dice.uniform(0.1, 0.6), dice.uniform(0.5, 0.9))
    return _paper(
        dice, paint(colour).expand(3, *plane(dice.device)[0].shape), dice.uniform(0, 0.25)
    )


def written(dice: Dice) -> Surface:
    """Make printed or written paper: lines of words, a picture, ruled lines."""
    x, y = plane(dice.device)
    colour = vary(dice, rgb(dice, 0.85, 0.83, 0.77), 0.03, 0.08)
    rows = dice.integer(22, 56)
    in_line = ((y * rows) % 1 < 0.55).float()
    letters = (noise(dice, rows * 5, rows * 2) > 0.0).float()
    gaps = (noise(dice, rows * 1.2, 2) > -1.0).float()
    margin = ((x > 0.08) & (x < 0.92)).float()
    ink = in_line * letters * gaps * margin
    albedo = mix(paint(colour), paint(rgb(dice, 0.05, 0.05, 0.07)), 0.85 * ink)
    if dice.chance(0.35):
        left, top = dice.uniform(0.1, 0.6), dice.uniform(0.1, 0.6)
        inside = (x > left) & (x < left + 0.35) & (y > top) & (y < top + 0.3)
        picture = mix(paint(any_colour(dice)), paint(any_colour(dice)), ramp(-1, 1, noise(dice, 7)))
        albedo = torch.where(inside, picture, albedo)
    return _paper(dice, albedo, dice.uniform(0, 0.2))


def cardboard(dice: Dice) -> Surface:
    """Brown board, corrugation showing faintly."""
    x, y = plane(dice.device)
    colour = paint(vary(dice, rgb(dice, 0.5, 0.35, 0.21), 0.05, 0.15))
    flutes = torch.sin(x * dice.uniform(120, 260)) * dice.uniform(0, 0.25)
    specks = ramp(1.6, 2.2, noise(dice, 160))
    albedo = colour * (1 + 0.04 * flutes - 0.35 * specks + 0.04 * fractal(dice, 3, 4))
    tape = ((y - dice.uniform(0.2, 0.8)).abs() < 0.06).float() * float(dice.chance(0.25))
    albedo = mix(albedo, paint(rgb(dice, 0.55, 0.42, 0.25)), 0.7 * tape)
    surface = _paper(dice, albedo, 0.15)
    rough = mix(surface.roughness, torch.full_like(tape, 0.25), tape)
    return Surface(albedo, surface.height + flutes, rough, 0.4, finish=surface.finish)


def wallpaper(dice: Dice) -> Surface:
    """Patterned paper."""
    x, y = plane(dice.device)
    count = dice.integer(2, 6)
    petals = torch.sin(x * 6.283 * count) * torch.sin(y * 6.283 * count + torch.sin(x * 19))
    stripes = torch.sin(x * 6.283 * count * 2)
    drawn = ramp(0.2, 0.3, petals if dice.chance(0.6) else stripes)
    albedo = mix(paint(any_colour(dice, 1.5, 0.3)), paint(any_colour(dice, 1.5, 0.2)), drawn)
    return _paper(dice, albedo, dice.uniform(0.05, 0.4))


def hide(dice: Dice) -> Surface:
    """Smooth leather: a net of fine creases, worn bright or dark."""
    first, second, _ = cells(dice, dice.integer(30, 60))
    grain, worn = ramp(0.0, 0.35, second - first), fractal(dice, 3, 5)
    wrinkles = ramp(0.12, 0.0, fractal(dice, 5, 4).abs()) * dice.uniform(0, 1)
    albedo = paint(_leather(dice)) * (0.72 + 0.28 * grain + 0.12 * worn) * (1 - 0.25 * wrinkles)
    rough = dice.uniform(0.28, 0.6) - 0.08 * worn + 0.1 * (1 - grain)
    height = 0.9 * grain + 0.1 * _fine(dice) - 0.8 * wrinkles
    return Surface(albedo, height, rough, dice.uniform(0.3, 1.0), finish=_soft(dice))


def suede(dice: Dice) -> Surface:
    """Suede: a soft nap, brushed this way and that."""
    nap, fine = fractal(dice, 4, 4), _fine(dice)
    albedo = paint(_leather(dice)) * (0.9 + 0.18 * nap + 0.08 * fine)
    finish = Finish(sheen=dice.uniform(0.2, 0.7), reflectance=0.02, wrap=0.2)
    return Surface(albedo, 0.3 * fine, 0.95 + 0 * nap, dice.uniform(0.2, 0.6), finish=finish)


def stitched(dice: Dice) -> Surface:
    """Leather with seams, quilting or punched holes."""
    x, y = plane(dice.device)
    base = hide(dice)
    count = dice.integer(2, 4)
    away = (x * count % 1 - 0.5).abs() / count
    if dice.chance(0.5):
        away = torch.minimum(away, (y * count % 1 - 0.5).abs() / count)
    seam = torch.exp(-((away / 0.01) ** 2))
    dashes = ((x + y) * 40 % 1 < 0.6).float()
    thread = (((away - 0.022).abs() < 0.006).float()) * dashes
    albedo = mix(base.albedo * (1 - 0.5 * seam), paint(any_colour(dice)), thread)
    height = base.height - 4 * seam + 1.2 * thread
    return Surface(albedo, height, base.roughness, base.bump, finish=base.finish)


def reptile(dice: Dice) -> Surface:
    """Embossed like crocodile: large plates."""
    first, second, value = cells(dice, dice.integer(8, 15))
    plates = ramp(0.0, 0.3, second - first)
    albedo = paint(_leather(dice)) * (0.45 + 0.5 * plates + 0.15 * value)
    rough = dice.uniform(0.2, 0.45) + 0.2 * (1 - plates)
    return Surface(albedo, 2.5 * plates, rough, dice.uniform(0.4, 0.9), finish=_soft(dice))


def _fine(dice: Dice) -> Tensor:
    return 0.6 * noise(dice, 230) + 0.5 * noise(dice, 120)


def _paper(dice: Dice, albedo: Tensor, creased: float) -> Surface:
    fibres = noise(dice, 60, 220) + noise(dice, 220, 60)
    folds = creased * ramp(0.08, 0.0, fractal(dice, 3, 3).abs())
    albedo = albedo * (1 + 0.02 * fibres + 0.02 * fractal(dice, 4, 4)) * (1 - 0.2 * folds)
    finish = Finish(reflectance=0.03, wrap=dice.uniform(0, 0.35))
    rough = (dice.uniform(0.35, 0.6) if dice.chance(0.15) else dice.uniform(0.75, 1)) + 0 * folds
    height = 0.12 * fibres + 0.1 * _fine(dice) - 2 * folds
    return Surface(albedo, height, rough, dice.uniform(0.05, 0.3), finish=finish)


def _leather(dice: Dice) -> Tensor:
    if dice.chance(0.55):
        return vary(dice, rgb(dice, 0.28, 0.14, 0.07), 0.15, 0.5)
    if dice.chance(0.5):
        return vary(dice, rgb(dice, 0.03, 0.03, 0.03), 0.05, 0.4)
    return any_colour(dice, 1.0, 0.05) * 0.8


def _soft(dice: Dice) -> Finish:
    return Finish(wrap=dice.uniform(0, 0.25), reflectance=dice.uniform(0.035, 0.05))


PAPER = (
    ("white", white_paper, 2.0),
    ("written", written, 2.0),
    ("cardboard", cardboard, 2.0),
    ("wallpaper", wallpaper, 0.7),
)
LEATHER = (
    ("hide", hide, 3.0),
    ("suede", suede, 0.8),
    ("stitched", stitched, 1.5),
    ("reptile", reptile, 0.6),
)
