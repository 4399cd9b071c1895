"""Plastic and rubber: gloss, grain, ribs, printed wood, chrome; matt black, treads, foam.

A picture's label is what the thing is made of, whatever it pretends to be: plastic printed with a
wood grain and plastic plated with chrome are plastic, told by their gloss, relief and shapes.
"""

from __future__ import annotations

import math

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
    turned,
    vary,
)
from hapticvlm_lab.training.render.surface import Finish, Surface
from hapticvlm_lab.training.render.surfaces import wood


def glossy(dice: Dice) -> Surface:
    """Injection moulded, shiny, one colour or two."""
    x, _ = plane(dice.device)
    two = (x > dice.uniform(0.2, 0.8)).float() * float(dice.chance(0.15))
    albedo = mix(paint(_colour(dice)), paint(_colour(dice)), two)
    relief = 0.5 * fractal(dice, 24, 3, 0.7) * float(dice.chance(0.4))
    return _plastic(dice, albedo, relief, dice.spread(0.06, 0.25))


def grained(dice: Dice) -> Surface:
    """Moulded with a leather-like or sandy grain."""
    if dice.chance(0.5):
        first, second, _ = cells(dice, dice.integer(24, 54))
        relief = second - first
    else:
        relief = 0.5 * noise(dice, 230)
    albedo = paint(_colour(dice)).expand(3, *relief.shape)
    return _plastic(dice, albedo, relief, dice.spread(0.25, 0.65))


def ribbed(dice: Dice) -> Surface:
    """With ribs or steps, as crates and grips have."""
    x, y = turned(*plane(dice.device), dice.choose((0.0, math.pi / 2)))
    wave = torch.sin(y * dice.uniform(30, 140))
    relief = 0.8 * (wave if dice.chance(0.5) else torch.sign(wave)) + 0 * x
    albedo = paint(_colour(dice)) * (1 + 0.02 * fractal(dice, 4, 3))
    return _plastic(dice, albedo, relief, dice.spread(0.1, 0.5))


def marked(dice: Dice) -> Surface:
    """With a label, letters or stripes printed on."""
    x, y = plane(dice.device)
    albedo = paint(_colour(dice)).expand(3, *x.shape)
    low, high = sorted((dice.uniform(), dice.uniform()))
    band = ((y > low) & (y < high)).float()
    albedo = mix(albedo, paint(_colour(dice)), band * float(dice.chance(0.7)))
    rows = dice.integer(3, 9)
    line = torch.floor(y * rows * 4)
    letters = (noise(dice, 90, 20) > 0.1).float() * ((line % 4) == 1) * band
    albedo = mix(albedo, paint(_colour(dice)), letters)
    return _plastic(dice, albedo, 0.05 * fractal(dice, 4, 3), dice.spread(0.08, 0.4))


def worn(dice: Dice) -> Surface:
    """Faded, scuffed and dusty."""
    fade = ramp(-1.5, 1.5, fractal(dice, 3, 4))
    colour = _colour(dice)
    pale = mix(colour, colour.mean() + 0 * colour + 0.15, 0.6)
    scuffs = ramp(0.8, 1.6, noise(dice, 20, 200)) * ramp(0, 1, noise(dice, 4))
    albedo = mix(paint(colour), paint(pale), fade) * (1 + 0.25 * scuffs)
    rough = dice.uniform(0.3, 0.6) + 0.2 * fade
    finish = Finish(wrap=dice.uniform(0, 0.3))
    return Surface(albedo, 0.3 * scuffs, rough, dice.uniform(0.05, 0.25), finish=finish)


def wood_print(dice: Dice) -> Surface:
    """Laminate: a picture of wood under plastic, flat, glossy, of too regular a pattern."""
    print_ = wood.planks(dice) if dice.chance(0.5) else wood.board(dice)
    dots = 0.03 * torch.sign(noise(dice, 250))
    rough = dice.uniform(0.12, 0.35) + 0 * dots
    return Surface(print_.albedo * 0.9 + 0.03, 0.1 * noise(dice, 220), rough + dots, 0.08)


def chrome(dice: Dice) -> Surface:
    """Metallised plastic: a mirror, somewhat dull and wavy, tinted, with a moulded relief."""
    colour = vary(dice, rgb(dice, 0.62, 0.63, 0.65), 0.08, 0.15)
    waves = 0.8 * fractal(dice, 5, 2)
    finish = Finish(coat=0.8, coat_roughness=0.12)
    rough = dice.uniform(0.12, 0.3) + 0 * waves
    albedo = paint(colour).expand(3, *waves.shape)
    return Surface(albedo, waves, rough, dice.uniform(0.1, 0.3), dice.uniform(0.6, 0.9), finish)


def translucent(dice: Dice) -> Surface:
    """Milky or coloured plastic that light passes: bottles, boxes, films."""
    tint = hue(dice, dice.uniform(), dice.uniform(0, 0.7), dice.uniform(0.8, 1))
    red, green, blue = (float(channel) for channel in tint)
    finish = Finish(
        transmission=dice.uniform(0.5, 0.85), tint=(red, green, blue), thin=1.0,
        frost=dice.uniform(0.4, 1.0), reflectance=0.04, wrap=0.5,
    )  # fmt: skip
    relief = 0.3 * fractal(dice, 3, 3)
    albedo = paint(tint * 0.75).expand(3, *relief.shape)
    rough = dice.uniform(0.2, 0.45) + 0 * relief
    return Surface(albedo, relief, rough, dice.uniform(0.05, 0.3), finish=finish)


def matt_rubber(dice: Dice) -> Surface:
    """Plain rubber: dull, dark more often than not."""
    grain = 0.5 * noise(dice, 230) + 0.4 * fractal(dice, 20, 3)
    bloom = ramp(0.0, 1.8, fractal(dice, 3, 5)) * dice.uniform(0, 0.4)
    colour = paint(_rubber_colour(dice))
    albedo = mix(colour, colour * 0.7 + 0.08, bloom) * (1 + 0.04 * grain)
    return _rubber(dice, albedo, grain)


def treaded(dice: Dice) -> Surface:
    """With tread, knobs or ribs: mats, tyres, grips."""
    x, y = turned(*plane(dice.device), dice.choose((0.0, 0.78)))
    count = dice.uniform(6, 18)
    pattern = dice.choose(("ribs", "knobs", "chevrons"))
    if pattern == "ribs":
        relief = ramp(-0.3, 0.3, torch.sin(y * count * 6.283))
    elif pattern == "knobs":
        away = ((x * count) % 1 - 0.5) ** 2 + ((y * count) % 1 - 0.5) ** 2
        relief = ramp(0.13, 0.08, away)
    else:
        bent = y * count + 0.5 * ((x * count * 0.5) % 1 - 0.5).abs() * 2
        relief = ramp(-0.2, 0.2, torch.sin(bent * 6.283))
    grain = noise(dice, 220)
    dust = (1 - relief) * dice.uniform(0, 0.5)
    albedo = mix(paint(_rubber_colour(dice)), paint(rgb(dice, 0.25, 0.22, 0.19)), 0.5 * dust)
    return _rubber(dice, albedo * (0.6 + 0.4 * relief), 3 * relief + 0.15 * grain)


def foam(dice: Dice) -> Surface:
    """Foam or crumb rubber: pores or crumbs."""
    first, second, value = cells(dice, dice.integer(26, 60))
    pores = ramp(0.35, 0.0, first)
    crumbs = ramp(0.0, 0.2, second - first)
    flecks = (value > 0.85).float() * float(dice.chance(0.5))
    colour = _rubber_colour(dice)
    albedo = mix(paint(colour), paint(any_colour(dice)), flecks) * (0.6 + 0.5 * crumbs)
    return _rubber(dice, albedo, crumbs - pores)


def silicone(dice: Dice) -> Surface:
    """Silicone or latex: soft colours, faint shine, light reaches around."""
    relief = 0.4 * fractal(dice, 3, 3)
    albedo = paint(any_colour(dice, 0.8, 0.2)).expand(3, *relief.shape)
    finish = Finish(wrap=dice.uniform(0.3, 0.7), sheen=dice.uniform(0, 0.25), reflectance=0.035)
    rough = dice.uniform(0.35, 0.6) + 0 * relief
    return Surface(albedo, relief, rough, dice.uniform(0.05, 0.2), finish=finish)


def _colour(dice: Dice) -> Tensor:
    colour = hue(dice, dice.uniform(), dice.uniform() ** 0.7, dice.uniform(0.04, 0.95))
    return colour.mean() + 0 * colour if dice.chance(0.3) else colour


def _rubber_colour(dice: Dice) -> Tensor:
    if dice.chance(0.65):
        return vary(dice, rgb(dice, 0.035, 0.035, 0.037), 0.05, 0.5)
    return any_colour(dice, 1.0, 0.1) * 0.7


def _plastic(dice: Dice, albedo: Tensor, relief: Tensor, rough: float) -> Surface:
    finish = Finish(wrap=dice.uniform(0, 0.35), reflectance=dice.uniform(0.035, 0.055))
    albedo = albedo * (1 + 0.015 * fractal(dice, 4, 3))
    field = rough + 0.03 * fractal(dice, 4, 3)
    return Surface(albedo, relief, field, dice.uniform(0.02, 0.35), finish=finish)


def _rubber(dice: Dice, albedo: Tensor, height: Tensor) -> Surface:
    finish = Finish(reflectance=dice.uniform(0.03, 0.045), sheen=dice.uniform(0, 0.15))
    rough = dice.uniform(0.5, 0.9) + 0 * height
    return Surface(albedo, height, rough, dice.uniform(0.15, 0.6), finish=finish)


PLASTIC = (
    ("glossy", glossy, 3.0),
    ("grained", grained, 1.5),
    ("ribbed", ribbed, 0.8),
    ("marked", marked, 1.0),
    ("worn", worn, 0.8),
    ("wood-print", wood_print, 0.5),
    ("chrome", chrome, 0.3),
    ("translucent", translucent, 1.0),
)
RUBBER = (
    ("matt", matt_rubber, 2.0),
    ("treaded", treaded, 2.0),
    ("foam", foam, 1.0),
    ("silicone", silicone, 0.8),
)
