"""Metal: polished, satin, brushed, turned, cast, hammered, galvanised, rusty, painted, worn."""

from __future__ import annotations

import math

import torch
from torch import Tensor
from torch.nn import functional

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
    turned,
    vary,
)
from hapticvlm_lab.training.render.surface import Finish, Surface

# Reflectance at normal incidence, linear: silver, aluminium, iron, steel, gold, copper, brass,
# chromium, lead, nickel; as commonly tabulated for rendering.
_METALS = (
    (0.95, 0.93, 0.89),
    (0.91, 0.92, 0.92),
    (0.56, 0.57, 0.58),
    (0.77, 0.78, 0.78),
    (1.0, 0.78, 0.34),
    (0.95, 0.64, 0.54),
    (0.83, 0.69, 0.45),
    (0.55, 0.55, 0.55),
    (0.40, 0.40, 0.42),
    (0.66, 0.61, 0.53),
)


def polished(dice: Dice) -> Surface:
    """Polished or chromed: a mirror, with smears."""
    smear = ramp(-0.5, 2, fractal(dice, 3, 4))
    rough = dice.spread(0.03, 0.12) + 0.12 * smear * dice.uniform(0, 1)
    albedo = _colour(dice) * (1 - 0.05 * smear)
    return Surface(albedo, 0.1 * fractal(dice, 2, 3), rough, dice.uniform(0.02, 0.15), 1.0)


def satin(dice: Dice) -> Surface:
    """Bead-blasted or worn: evenly dull."""
    grain = noise(dice, 230)
    rough = dice.uniform(0.2, 0.5) + 0.05 * fractal(dice, 3, 4)
    albedo = _colour(dice) * (1 + 0.02 * grain)
    return _worn(dice, Surface(albedo, 0.2 * grain, rough, dice.uniform(0.03, 0.2), 1.0))


def brushed(dice: Dice) -> Surface:
    """Brushed one way: streaks that stretch the highlight across them."""
    streaks = noise(dice, 3, 250) + 0.7 * noise(dice, 8, 250) + 0.5 * noise(dice, 2, 120)
    return _worn(dice, _streaked(dice, streaks))


def spun(dice: Dice) -> Surface:
    """Make turned on a lathe: circular streaks."""
    x, y = plane(dice.device)
    radius = torch.sqrt((x - 0.5) ** 2 + (y - 0.5) ** 2)
    place = torch.stack([radius * 2.6 - 1, torch.zeros_like(radius)], -1)[None]
    line = dice.field(1, 1, 1, 300).expand(1, 1, 2, 300)
    streaks = 1.5 * functional.grid_sample(line, place, align_corners=False)[0, 0]
    return _streaked(dice, streaks)


def cast(dice: Dice) -> Surface:
    """Cast: grainy and dull."""
    grain = fractal(dice, 40, 3, 0.8)
    rough = dice.uniform(0.35, 0.7) + 0.06 * grain
    albedo = _colour(dice) * dice.uniform(0.4, 1) * (1 + 0.08 * grain + 0.06 * fractal(dice, 4, 4))
    return _worn(dice, Surface(albedo, 0.6 * grain, rough, dice.uniform(0.3, 0.8), 1.0))


def hammered(dice: Dice) -> Surface:
    """Hammered: shallow dents."""
    dents, _, _ = cells(dice, dice.integer(6, 16))
    rough = dice.uniform(0.08, 0.35) + 0.04 * fractal(dice, 4, 4)
    albedo = _colour(dice) * (0.85 + 0.2 * dents)
    return Surface(albedo, 2.2 * dents, rough, dice.uniform(0.3, 0.8), 1.0)


def galvanised(dice: Dice) -> Surface:
    """Galvanised: spangles, each of its own lustre."""
    _, _, value = cells(dice, dice.integer(10, 26))
    fine = noise(dice, 200)
    albedo = paint(vary(dice, rgb(dice, 0.6, 0.62, 0.64))) * (0.7 + 0.5 * value + 0.02 * fine)
    rough = dice.uniform(0.25, 0.45) + 0.15 * value
    return _worn(dice, Surface(albedo, 0.1 * fine, rough, dice.uniform(0.05, 0.2), 1.0))


def plate(dice: Dice) -> Surface:
    """Tread plate or panelling: raised bars, or seams and rivets."""
    x, y = plane(dice.device)
    base = satin(dice)
    count = dice.integer(3, 9)
    if dice.chance(0.5):
        u, v = turned(x, y, math.pi / 4)
        flip = ((torch.floor(u * count) + torch.floor(v * count)) % 2) > 0
        a = torch.where(flip, v, u) * count % 1 - 0.5
        b = torch.where(flip, u, v) * count % 1 - 0.5
        relief = ramp(1.0, 0.6, (a / 0.4) ** 2 + (b / 0.13) ** 2) * 3
    else:
        seam = torch.minimum((x * 2 % 1 - 0.5).abs() / 2, (y * 2 % 1 - 0.5).abs() / 2)
        knobs = ((x * count * 2 % 1 - 0.5) ** 2 + (y * count * 2 % 1 - 0.5) ** 2).sqrt()
        relief = -3 * ramp(0.008, 0.003, seam) + 2 * ramp(0.3, 0.2, knobs) * (seam < 0.05)
    albedo = base.albedo * (1 - 0.3 * (relief < -1).float())
    return Surface(albedo, base.height + relief, base.roughness, 0.25, base.metalness, base.finish)


def rusty(dice: Dice) -> Surface:
    """Rusting: bare metal left in places."""
    bare = dice.choose((satin, cast, brushed))(dice)
    grain = fractal(dice, 40, 3, 0.8)
    rust = ramp(0.0, 0.5, fractal(dice, 3, 6, 0.65) - dice.uniform(-0.9, 0.8))
    colour = paint(vary(dice, rgb(dice, 0.32, 0.13, 0.05), 0.15, 0.25))
    spots = mix(colour, colour * 0.4, ramp(0, 1.2, fractal(dice, 7, 4)))
    albedo = mix(bare.albedo, spots * (1 + 0.3 * grain), rust)
    rough = mix(bare.roughness, torch.full_like(rust, 0.9), rust)
    height = bare.height + 0.5 * rust * grain
    return Surface(albedo, height, rough, dice.uniform(0.2, 0.7), 1 - 0.9 * rust)


def painted(dice: Dice) -> Surface:
    """Painted or lacquered metal: colour under gloss, bright metal where it is chipped."""
    colour = paint(any_colour(dice)) * (1 + 0.02 * fractal(dice, 4, 3))
    flakes = ramp(1.4, 1.8, noise(dice, 255)) * float(dice.chance(0.4))
    chips = ramp(0.0, 0.08, fractal(dice, 6, 5) - dice.uniform(1.0, 2.4))
    scratched = _scratches(dice) * float(dice.chance(0.5))
    bare = torch.maximum(chips, scratched)
    albedo = mix(colour * (1 + flakes), _colour(dice), bare)
    metal = (bare + 0.25 * flakes + dice.choose((0.0, 0.0, 0.35))).clamp(0, 1)
    rough = mix(torch.full_like(bare, dice.uniform(0.15, 0.6)), 0.3 + 0 * bare, bare)
    relief = -1.5 * bare + 0.15 * fractal(dice, 30, 3)
    coat = dice.uniform(0.5, 1) if dice.chance(0.6) else 0.0
    finish = Finish(coat=coat, coat_roughness=dice.uniform(0.03, 0.2))
    return Surface(albedo, relief, rough, dice.uniform(0.05, 0.25), metal, finish)


def _colour(dice: Dice) -> Tensor:
    """Make a metal's colour as a map (3, 1, 1)."""
    return paint(vary(dice, rgb(dice, *dice.choose(_METALS)), 0.03, 0.1).clamp(max=0.98))


def _streaked(dice: Dice, streaks: Tensor) -> Surface:
    rough = dice.uniform(0.12, 0.38) + 0.05 * streaks + 0.05 * fractal(dice, 3, 4) * dice.uniform()
    albedo = _colour(dice) * (1 + 0.05 * streaks - 0.05 * fractal(dice, 4, 4) * dice.uniform())
    finish = Finish(anisotropy=dice.uniform(0.5, 1))
    return Surface(albedo, 0.35 * streaks, rough, dice.uniform(0.05, 0.35), 1.0, finish)


def _scratches(dice: Dice) -> Tensor:
    """Fine lines here and there: 0 to 1."""
    x, y = plane(dice.device)
    total = torch.zeros_like(x)
    for _ in range(dice.integer(3, 12)):
        angle = dice.uniform(0, math.pi)
        away = (x - dice.uniform()) * math.cos(angle) + (y - dice.uniform()) * math.sin(angle)
        line = torch.exp(-((away / 0.0016) ** 2)) * dice.uniform()
        total = total + line * ramp(0.0, 0.5, noise(dice, 4))
    return total.clamp(0, 1)


def _worn(dice: Dice, surface: Surface) -> Surface:
    """Make some of them scratched, dusty or stained."""
    albedo, height, rough = surface.albedo, surface.height, surface.roughness
    metal = torch.as_tensor(surface.metalness, device=height.device)
    if dice.chance(0.4):
        lines = _scratches(dice)
        height, rough = height - 0.7 * lines, rough + 0.15 * lines
    if dice.chance(0.25):
        stain = ramp(0.2, 1.8, fractal(dice, 3, 5)) * dice.uniform(0.2, 0.8)
        dust = paint(vary(dice, rgb(dice, 0.35, 0.32, 0.28)))
        albedo = mix(albedo.expand(3, *height.shape), dust, 0.6 * stain)
        rough, metal = rough + 0.4 * stain, metal * (1 - 0.6 * stain)
    if dice.chance(0.1):
        albedo = albedo * (0.8 + 0.3 * hashed(torch.floor(plane(dice.device)[1] * 3)))
    return Surface(albedo, height, rough, surface.bump, metal, surface.finish)


KINDS = (
    ("polished", polished, 1.6),
    ("satin", satin, 1.6),
    ("brushed", brushed, 2.0),
    ("spun", spun, 0.5),
    ("cast", cast, 1.0),
    ("hammered", hammered, 0.7),
    ("galvanised", galvanised, 0.6),
    ("plate", plate, 0.8),
    ("rusty", rusty, 0.9),
    ("painted", painted, 1.0),
)
