"""Made-up surroundings: a sky or ceiling, a floor, walls and furniture, windows and lamps."""

from __future__ import annotations

import torch
from torch import Tensor
from torch.nn import functional

from hapticvlm_lab.training.render.dice import Dice
from hapticvlm_lab.training.render.light import SHARP, Lights
from hapticvlm_lab.training.render.noise import hue, mix, paint, ramp, rgb

_HEIGHT, _WIDTH = SHARP


def surroundings(dice: Dice, lights: Lights | None) -> Tensor:
    """Choose a photographed one (in two of three cases) or make one up: (3, H, W)."""
    if lights is None or not lights.names or dice.chance(0.35):
        return room(dice)
    picture = lights.pictures[dice.integer(0, len(lights.names) - 1)].to(dice.device)
    picture = picture.roll(dice.integer(0, _WIDTH), -1)
    return picture.flip(-1) if dice.chance(0.5) else picture


def room(dice: Dice) -> Tensor:
    """Return a made-up surrounding: (3, H, W) linear."""
    x, y = _chart(dice.device)
    picture = _shell(dice, y)
    for _ in range(dice.integer(4, 10)):
        colour = hue(dice, dice.uniform(), dice.uniform(0, 0.7), dice.spread(0.03, 1.2))
        place = (dice.uniform(), dice.uniform(0.35, 0.8))
        size = (dice.spread(0.01, 0.12), dice.spread(0.02, 0.25))
        cover = _rectangle((x, y), place, size, dice.uniform(0.003, 0.02))
        if dice.chance(0.25):
            colour = paint(colour) * (1 + 0.5 * torch.sign(torch.sin(x * dice.uniform(40, 400))))
        else:
            colour = paint(colour)
        picture = mix(picture, colour, cover)
    for number in range(4):
        if number == 0 or dice.chance(0.75):
            picture = _lamp(dice, picture, (x, y))
    return picture


def _shell(dice: Dice, y: Tensor) -> Tensor:
    """Sky or ceiling, walls and floor."""
    top = hue(dice, dice.uniform(0.5, 0.72), dice.uniform(0, 0.5), dice.spread(0.15, 1.6))
    middle = hue(dice, dice.uniform(), dice.uniform(0, 0.25), dice.spread(0.2, 1.5))
    bottom = hue(dice, dice.uniform(0.02, 0.15), dice.uniform(0, 0.6), dice.spread(0.04, 0.6))
    if dice.chance(0.6):
        top = middle * dice.spread(0.7, 1.4)
    above = mix(paint(middle), paint(top), ramp(0.5, 0.05, y))
    below = mix(paint(middle), paint(bottom), ramp(0.5, 0.6, y))
    grain = 0.25 * _patchy(dice, 9, 17) + 0.15 * _patchy(dice, 33, 65)
    return torch.where(y > 0.5, below, above) * torch.exp(grain)


def _lamp(dice: Dice, picture: Tensor, chart: tuple[Tensor, Tensor]) -> Tensor:
    """Add a window or a lamp."""
    x, y = chart
    tint = hue(dice, dice.uniform(0.05, 0.65), dice.uniform(0.1, 0.4), 1.0)
    colour = (tint if dice.chance(0.6) else rgb(dice, 1.0, 1.0, 1.0)) * dice.spread(3, 40)
    wide, high = dice.spread(0.006, 0.07), dice.spread(0.01, 0.12)
    place = (dice.uniform(), dice.uniform(0.02, 0.48))
    across = ((x - place[0] + 0.5) % 1 - 0.5) / wide
    down = (y - place[1]) / high
    if dice.chance(0.35):
        return mix(picture, paint(colour), ramp(1.1, 0.9, across**2 + down**2))
    cover = _rectangle(chart, place, (wide, high), dice.uniform(0.003, 0.03))
    if dice.chance(0.4):
        bars = torch.maximum(torch.exp(-((across / 0.08) ** 2)), torch.exp(-((down / 0.08) ** 2)))
        cover = cover * (1 - bars)
    return mix(picture, paint(colour), cover)


def _rectangle(
    chart: tuple[Tensor, Tensor],
    place: tuple[float, float],
    size: tuple[float, float],
    soft: float,
) -> Tensor:
    across = ((chart[0] - place[0] + 0.5) % 1 - 0.5).abs()
    down = (chart[1] - place[1]).abs()
    inside = ramp(-0.5, 0.5, (size[0] - across) / soft)
    return inside * ramp(-0.5, 0.5, (size[1] - down) / soft)


def _patchy(dice: Dice, rows: int, columns: int) -> Tensor:
    drawn = dice.field(1, 1, rows, columns)
    size = (_HEIGHT, _WIDTH)
    return functional.interpolate(drawn, size, mode="bicubic", align_corners=False)[0, 0]


def _chart(device: str) -> tuple[Tensor, Tensor]:
    y = torch.linspace(0, 1, _HEIGHT, device=device)
    x = torch.linspace(0, 1, _WIDTH, device=device)
    down, across = torch.meshgrid(y, x, indexing="ij")
    return across, down
