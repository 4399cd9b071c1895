"""Samples of materials: of each class many kinds, each drawn anew. Knows no shapes and no light."""

from __future__ import annotations

from collections.abc import Callable

import torch

from hapticvlm import materials
from hapticvlm_lab.training.render.dice import Dice
from hapticvlm_lab.training.render.noise import any_colour, paint, plane, rgb, vary
from hapticvlm_lab.training.render.surface import Surface
from hapticvlm_lab.training.render.surfaces import (
    fabric,
    fibre,
    glass,
    living,
    metal,
    mineral,
    polymer,
    wood,
)
from hapticvlm_lab.training.render.tiles import Tiles, dressed

TILED = 0.7  # share of the samples of a class dressed with photographed tiles, when it has some
FEW_TILES = 25  # classes with fewer take fewer, lest they be learned by heart

Kinds = tuple[tuple[str, Callable[[Dice], Surface], float], ...]
KINDS: dict[str, Kinds] = {
    "wood": wood.KINDS,
    "glass": glass.KINDS,
    "fabric": fabric.KINDS,
    "metal": metal.KINDS,
    "plastic": polymer.PLASTIC,
    "stone": mineral.STONE,
    "ceramic": mineral.CERAMIC,
    "paper": fibre.PAPER,
    "leather": fibre.LEATHER,
    "rubber": polymer.RUBBER,
    "foliage": living.FOLIAGE,
    materials.UNKNOWN: living.UNKNOWN,
}


def sample(dice: Dice, material: str, tiles: Tiles | None) -> tuple[str, Surface]:
    """Draw a sample of a class: its kind ("wood/planks") and its maps. KeyError: no such class."""
    kinds = KINDS[material]
    if tiles is not None and dice.chance(_tiled(material, tiles)):
        found = dressed(dice, material, tiles)
        if found is not None:
            return f"{material}/{found[0]}", found[1]
    name, make = dice.weigh([((name, make), weight) for name, make, weight in kinds])
    return f"{material}/{name}", make(dice)


def plain(dice: Dice) -> Surface:
    """Make a surface of one colour and no class: painted walls, liquids."""
    level = torch.zeros_like(plane(dice.device)[0])
    grey = vary(dice, rgb(dice, 0.6, 0.58, 0.55), 0.05, 0.5)
    white = vary(dice, rgb(dice, 0.86, 0.86, 0.86), 0.02, 0.05)
    colour = dice.weigh(((white, 1.0), (grey, 1.5), (any_colour(dice, 1.5), 1.0)))
    albedo = paint(colour).expand(3, *level.shape)
    return Surface(albedo, level, level + dice.uniform(0.15, 0.9))


def _tiled(material: str, tiles: Tiles) -> float:
    count = len(tiles.by_material.get(material, ()))
    return TILED * min(1.0, count / FEW_TILES)
