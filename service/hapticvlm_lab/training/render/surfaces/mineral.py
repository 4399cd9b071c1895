"""Stone and ceramic: concrete, granite, marble, brick, cobbles, rock; glazes, tiles, clay."""

from __future__ import annotations

import torch
from torch import Tensor

from hapticvlm_lab.training.render.dice import Dice
from hapticvlm_lab.training.render.noise import (
    any_colour,
    cells,
    fractal,
    hashed,
    mix,
    noise,
    paint,
    plane,
    ramp,
    rgb,
    vary,
)
from hapticvlm_lab.training.render.surface import Finish, Surface

_STONES = (
    (0.5, 0.48, 0.45),
    (0.62, 0.6, 0.57),
    (0.35, 0.34, 0.33),
    (0.6, 0.5, 0.38),
    (0.45, 0.25, 0.18),
    (0.8, 0.78, 0.74),
    (0.2, 0.2, 0.21),
    (0.5, 0.42, 0.38),
)
_CLAYS = ((0.55, 0.26, 0.15), (0.62, 0.4, 0.28), (0.45, 0.2, 0.12), (0.7, 0.6, 0.48))


def concrete(dice: Dice) -> Surface:
    """Concrete or plaster: blotches, pores, sometimes joints of the shuttering."""
    x, y = plane(dice.device)
    blotches, fine = fractal(dice, 3, 7, 0.6), _fine(dice)
    pits = torch.relu(noise(dice, 60) - dice.uniform(1.2, 2.4))
    colour = _stone(dice)
    albedo = paint(colour) * (1 - 0.35 * (0.5 + 0.3 * blotches)) * (1 + 0.1 * fine)
    height = 0.35 * blotches + 0.18 * fine - 1.5 * pits
    if dice.chance(0.25):
        joint = torch.minimum((x * 2 % 1 - 0.5).abs(), (y * 2 % 1 - 0.5).abs())
        height, albedo = height - 3 * ramp(0.02, 0.01, joint), albedo * ramp(0.0, 0.015, joint)
    albedo = albedo * (1 - 0.4 * pits.clamp(0, 1))
    return _rough(dice, albedo, height)


def granite(dice: Dice) -> Surface:
    """Granite: grains of several minerals."""
    first = noise(dice, 110) + 0.5 * noise(dice, 200)
    second = noise(dice, 70) + 0.5 * noise(dice, 160)
    albedo = mix(paint(_stone(dice)), paint(_stone(dice)), ramp(0.2, 0.8, first))
    albedo = mix(albedo, albedo * 0.2, ramp(0.9, 1.3, second)) * (1 + 0.08 * fractal(dice, 3, 5))
    return _cut(dice, albedo, 0.1 * first)


def marble(dice: Dice) -> Surface:
    """Marble or onyx: veins."""
    x, y = plane(dice.device)
    along = x * dice.uniform(1, 4) + y * dice.uniform(-3, 3) + 0.35 * fractal(dice, 2, 6, 0.6)
    vein = (1 - torch.abs(torch.sin(along * torch.pi))) ** dice.uniform(3, 12)
    fine = (1 - fractal(dice, 3, 6, 0.6).abs().clamp(0, 1)) ** 10 * 0.7
    clouds = fractal(dice, 3, 7, 0.6)
    share = (0.8 * torch.maximum(vein, fine)).clamp(0, 1)
    ground = paint(_stone(dice) if dice.chance(0.5) else vary(dice, rgb(dice, 0.82, 0.8, 0.77)))
    albedo = mix(ground, paint(_stone(dice) * 0.5), share) * (1 + 0.08 * clouds)
    return _cut(dice, albedo, 0.03 * clouds)


def travertine(dice: Dice) -> Surface:
    """Layered stone (travertine, sandstone, slate): bands and holes along them."""
    bands = noise(dice, 3, 30) + 0.6 * noise(dice, 8, 90) + 0.3 * fractal(dice, 4, 5)
    holes = torch.relu(noise(dice, 30, 90) - dice.uniform(1.3, 2.2)).clamp(0, 1)
    colour = _stone(dice)
    albedo = mix(paint(colour), paint(vary(dice, colour, 0.12, 0.3)), ramp(-1, 1, bands))
    albedo = albedo * (1 - 0.6 * holes) * (1 + 0.06 * _fine(dice))
    return _rough(dice, albedo, 0.4 * bands - 2 * holes)


def brick(dice: Dice) -> Surface:
    """Bricks or blocks in mortar."""
    x, y = plane(dice.device)
    count = dice.integer(3, 7)
    row = torch.floor(y * count * 2)
    across, down = x * count + 0.5 * (row % 2), y * count * 2
    edge_x = (across - across.floor() - 0.5).abs()
    edge_y = (down - down.floor() - 0.5).abs()
    wobble = 0.012 * noise(dice, 60)
    mortar = torch.maximum(ramp(0.455, 0.475, edge_x + wobble), ramp(0.41, 0.45, edge_y + wobble))
    value, fine, blotches = hashed(across.floor() + 6.1 * row), _fine(dice), fractal(dice, 3, 6)
    colour = paint(vary(dice, rgb(dice, *dice.choose((*_CLAYS, *_STONES)))))
    bricks = colour * (0.7 + 0.6 * value) * (1 + 0.12 * fine + 0.1 * blotches)
    grout = paint(vary(dice, rgb(dice, 0.6, 0.58, 0.55))) * (1 + 0.1 * fine)
    height = 0.3 * fine + 0.3 * blotches - 3 * mortar
    return _rough(dice, mix(bricks, grout, mortar), height)


def cobbles(dice: Dice) -> Surface:
    """Cobbles, gravel or a dry stone wall."""
    first, second, value = cells(dice, dice.integer(5, 17))
    stone, fine = ramp(0.0, 0.25, second - first), _fine(dice)
    light = paint(_stone(dice)) * (0.6 + 0.8 * value) * (1 + 0.1 * fine)
    albedo = mix(paint(_stone(dice) * 0.35), light, stone)
    return _rough(dice, albedo, 2 * stone - first + 0.1 * fine)


def rock(dice: Dice) -> Surface:
    """Natural rock: cracks, lichen, rough all over."""
    rough, fine = fractal(dice, 4, 7, 0.7), _fine(dice)
    cracks = ramp(0.06, 0.0, fractal(dice, 4, 5).abs())
    albedo = paint(_stone(dice)) * (0.85 + 0.2 * rough + 0.12 * fine) * (1 - 0.5 * cracks)
    lichen = ramp(0.6, 1.1, fractal(dice, 6, 5)) * float(dice.chance(0.3))
    albedo = mix(albedo, paint(vary(dice, rgb(dice, 0.45, 0.45, 0.25))), 0.7 * lichen)
    return _rough(dice, albedo, 1.5 * rough + 0.3 * fine - 1.5 * cracks)


def terrazzo(dice: Dice) -> Surface:
    """Chips of stone set in cement and ground flat."""
    first, second, value = cells(dice, dice.integer(12, 34))
    chips = ramp(0.05, 0.12, second - first) * (value > 0.35)
    colours = mix(paint(_stone(dice)), paint(_stone(dice)), (value * 7 % 1))
    albedo = mix(paint(_stone(dice)) * (1 + 0.05 * _fine(dice)), colours, chips)
    return _cut(dice, albedo, 0.03 * chips)


def glazed(dice: Dice) -> Surface:
    """Glazed pottery or porcelain: one colour under a bright glassy coat, sometimes run."""
    white = vary(dice, rgb(dice, 0.84, 0.82, 0.78), 0.02, 0.06)
    colour = white if dice.chance(0.5) else any_colour(dice)
    run = ramp(-0.2, 0.2, plane(dice.device)[1] - dice.uniform() + 0.08 * noise(dice, 12, 3))
    share = run * float(dice.chance(0.3))
    albedo = mix(paint(colour), paint(any_colour(dice)), share) * (1 + 0.02 * fractal(dice, 4, 4))
    specks = ramp(1.9, 2.3, noise(dice, 150)) * float(dice.chance(0.25))
    return _coated(dice, albedo * (1 - 0.7 * specks), 0.15 * fractal(dice, 3, 3))


def decorated(dice: Dice) -> Surface:
    """Glazed and painted: bands or flowers on white."""
    x, y = plane(dice.device)
    white = vary(dice, rgb(dice, 0.82, 0.8, 0.76), 0.02, 0.06)
    count = dice.integer(3, 8)
    petals = torch.sin(x * 6.283 * count) * torch.sin(y * 6.283 * count + torch.sin(x * 25))
    bands = (torch.sin(y * 6.283 * dice.integer(1, 4)) > 0.93).float()
    drawn = torch.maximum(ramp(0.5, 0.6, petals) * float(dice.chance(0.6)), bands)
    albedo = mix(paint(white), paint(any_colour(dice, 0.6)), drawn)
    return _coated(dice, albedo, 0.1 * fractal(dice, 3, 3))


def tiled(dice: Dice) -> Surface:
    """Glazed tiles with grout."""
    x, y = plane(dice.device)
    count, shift = dice.integer(3, 9), 0.5 * float(dice.chance(0.3))
    row = torch.floor(y * count)
    across, down = x * count + shift * (row % 2), y * count
    edge = torch.maximum((across % 1 - 0.5).abs(), (down % 1 - 0.5).abs())
    grout = ramp(0.46, 0.475, edge)
    value = hashed(across.floor() + 13.7 * row)
    colour = any_colour(dice) if dice.chance(0.6) else vary(dice, rgb(dice, 0.8, 0.79, 0.76))
    checks = ((across.floor() + row) % 2) * float(dice.chance(0.2))
    tiles = mix(paint(colour), paint(any_colour(dice)), checks)
    tiles = tiles * (1 + dice.uniform(0, 0.35) * (value - 0.5))
    albedo = mix(tiles, paint(vary(dice, rgb(dice, 0.55, 0.53, 0.5))), grout)
    pillow = -2 * grout - 0.8 * ramp(0.4, 0.47, edge)
    surface = _coated(dice, albedo, pillow + 0.05 * fractal(dice, 4, 3))
    rough = mix(surface.roughness, torch.full_like(grout, 0.9), grout)
    return Surface(albedo, surface.height, rough, 0.3, finish=surface.finish)


def terracotta(dice: Dice) -> Surface:
    """Unglazed clay: turning marks, chalky blooms."""
    turning = noise(dice, 3, 60) + 0.5 * noise(dice, 3, 140)
    bloom = ramp(0.3, 1.6, fractal(dice, 3, 5)) * dice.uniform(0, 0.6)
    clay = paint(vary(dice, rgb(dice, *dice.choose(_CLAYS)), 0.05, 0.15))
    albedo = mix(clay, paint(rgb(dice, 0.75, 0.7, 0.65)), 0.6 * bloom) * (1 + 0.04 * turning)
    height = 0.5 * turning + 0.2 * _fine(dice)
    return Surface(albedo, height, dice.uniform(0.7, 1) + 0 * bloom, dice.uniform(0.1, 0.5))


def _stone(dice: Dice) -> Tensor:
    return vary(dice, rgb(dice, *dice.choose(_STONES)), 0.06, 0.2)


def _fine(dice: Dice) -> Tensor:
    return 0.6 * noise(dice, 240) + 0.5 * noise(dice, 100)


def _rough(dice: Dice, albedo: Tensor, height: Tensor) -> Surface:
    rough = dice.uniform(0.65, 1) + 0 * height
    return Surface(albedo, height, rough, dice.uniform(0.3, 1.3))


def _cut(dice: Dice, albedo: Tensor, height: Tensor) -> Surface:
    """Cut stone: polished more often than not."""
    if dice.chance(0.35):
        return _rough(dice, albedo, height)
    rough = dice.uniform(0.08, 0.35) + 0 * height
    return Surface(albedo, height, rough, 0.03, finish=Finish(reflectance=dice.uniform(0.04, 0.05)))


def _coated(dice: Dice, albedo: Tensor, height: Tensor) -> Surface:
    finish = Finish(coat=dice.uniform(0.6, 1), coat_roughness=dice.uniform(0.03, 0.18))
    rough = dice.uniform(0.15, 0.6) + 0 * height
    return Surface(albedo, height, rough, dice.uniform(0.05, 0.3), finish=finish)


STONE = (
    ("concrete", concrete, 1.5),
    ("granite", granite, 1.2),
    ("marble", marble, 1.5),
    ("travertine", travertine, 0.8),
    ("brick", brick, 1.2),
    ("cobbles", cobbles, 1.0),
    ("rock", rock, 1.5),
    ("terrazzo", terrazzo, 0.6),
)
CERAMIC = (
    ("glazed", glazed, 2.5),
    ("decorated", decorated, 1.0),
    ("tiled", tiled, 2.0),
    ("terracotta", terracotta, 1.5),
)
