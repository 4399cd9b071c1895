"""Photographed albedo tiles as materials: the picture is the colour, its brightness the height.

After MatSim's trick of making materials of pictures. Tiles that are held back are never opened.
Reads ambientcg_tiles (albedo only, 120 px): what a tile does not say, how rough or how metallic it
is, is drawn by its class.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import torch
from numpy.typing import NDArray
from PIL import Image
from torch import Tensor
from torch.nn import functional

from hapticvlm import materials
from hapticvlm_lab.training import sources
from hapticvlm_lab.training.render.dice import Dice
from hapticvlm_lab.training.render.noise import SIDE, noise, rgb, shifted
from hapticvlm_lab.training.render.surface import Finish, Surface

_FOLDER = "ambientcg_tiles"
_HEIGHT = 8.0  # texels of height per unit of brightness


@dataclass(frozen=True, slots=True)
class Tile:
    """One tile: its family (the asset's name without number) and its pixels (H, W, 3) uint8."""

    family: str
    pixels: NDArray[np.uint8]


@dataclass(frozen=True, slots=True)
class Tiles:
    """Tiles that may teach, by material."""

    by_material: dict[str, tuple[Tile, ...]]


def load_tiles(data: Path) -> Tiles:
    """Read the tiles under data/ambientcg_tiles that are not held back."""
    found: dict[str, list[Tile]] = {}
    for path in sorted((data / _FOLDER).glob("*/*.jpg")):
        material = sources.material_of(path.parent.name)
        if material == materials.UNKNOWN or sources.is_tile_held_back(
            path.relative_to(data).as_posix()
        ):
            continue
        family = re.split(r"[0-9_]", path.stem)[0].lower()
        with Image.open(path) as image:
            tile = Tile(family, np.asarray(image.convert("RGB")))
        found.setdefault(material, []).append(tile)
    return Tiles({material: tuple(tiles) for material, tiles in found.items()})


def dressed(dice: Dice, material: str, tiles: Tiles) -> tuple[str, Surface] | None:
    """Dress a sample with a tile and say what kind it is; None when the class has no tiles."""
    choices = tiles.by_material.get(material, ())
    if not choices or material not in _FINISHES:
        return None
    tile = dice.choose(choices)
    return f"tile-{tile.family}", _FINISHES[material](dice, *_maps(dice, tile))


def _maps(dice: Dice, tile: Tile) -> tuple[Tensor, Tensor, Tensor]:
    """Linear albedo (3, SIDE, SIDE), height and what is bright beside its surroundings."""
    picture = torch.from_numpy(tile.pixels.astype(np.float32) / 255).permute(2, 0, 1)[None]
    times = dice.integer(1, 2)
    picture = picture.to(dice.device).repeat(1, 1, times, times)
    size = (SIDE, SIDE)
    encoded = functional.interpolate(picture, size, mode="bicubic", align_corners=False)[0]
    encoded = encoded.clamp(0, 1)
    bright = shifted(encoded.mean(0), 16)
    sign = 1.0 if dice.chance(0.75) else -1.0
    height = bright * sign * _HEIGHT * dice.spread(0.5, 2) + 0.05 * noise(dice, 240)
    linear = torch.where(encoded < 0.04045, encoded / 12.92, ((encoded + 0.055) / 1.055) ** 2.4)
    shift = rgb(dice, *(2.718 ** dice.normal(0.06) for _ in range(3)))
    return linear * shift[:, None, None] * dice.spread(0.8, 1.25), height, bright


def _wood(dice: Dice, albedo: Tensor, height: Tensor, bright: Tensor) -> Surface:
    coat = dice.uniform(0.3, 1) if dice.chance(0.4) else 0.0
    finish = Finish(coat=coat, coat_roughness=dice.uniform(0.05, 0.35))
    rough = dice.uniform(0.3, 0.85) - 0.2 * bright
    return Surface(albedo, height, rough, dice.uniform(0.05, 0.5), finish=finish)


def _fabric(dice: Dice, albedo: Tensor, height: Tensor, bright: Tensor) -> Surface:
    sheen = dice.uniform(0, 0.5) if dice.chance(0.7) else 0.0
    finish = Finish(sheen=sheen, reflectance=dice.uniform(0.015, 0.04), wrap=dice.uniform(0, 0.3))
    rough = dice.uniform(0.7, 1) + 0 * bright
    return Surface(albedo, height, rough, dice.uniform(0.3, 1.2), finish=finish)


def _metal(dice: Dice, albedo: Tensor, height: Tensor, bright: Tensor) -> Surface:
    """Lit as metal: the tile's colour is what it reflects, brightened to what metals reflect."""
    colour = albedo.clamp(min=0.03) ** dice.uniform(0.45, 1)
    finish = Finish(anisotropy=dice.uniform(0.3, 1) if dice.chance(0.3) else 0.0)
    rough = dice.spread(0.08, 0.5) - 0.3 * bright
    return Surface(colour, height, rough, dice.uniform(0.03, 0.3), dice.uniform(0.85, 1), finish)


def _plastic(dice: Dice, albedo: Tensor, height: Tensor, bright: Tensor) -> Surface:
    finish = Finish(wrap=dice.uniform(0, 0.3), reflectance=dice.uniform(0.035, 0.055))
    rough = dice.spread(0.08, 0.6) + 0 * bright
    return Surface(albedo, height, rough, dice.uniform(0.02, 0.3), finish=finish)


def _stone(dice: Dice, albedo: Tensor, height: Tensor, bright: Tensor) -> Surface:
    rough = dice.uniform(0.1, 0.35) if dice.chance(0.25) else dice.uniform(0.6, 1)
    return Surface(albedo, height, rough - 0.1 * bright, dice.uniform(0.1, 1))


def _ceramic(dice: Dice, albedo: Tensor, height: Tensor, bright: Tensor) -> Surface:
    glazed = dice.uniform(0.5, 1) if dice.chance(0.7) else 0.0
    finish = Finish(coat=glazed, coat_roughness=dice.uniform(0.03, 0.2))
    rough = dice.uniform(0.15, 0.6) - 0.2 * bright
    return Surface(albedo, height, rough, dice.uniform(0.03, 0.35), finish=finish)


def _paper(dice: Dice, albedo: Tensor, height: Tensor, bright: Tensor) -> Surface:
    finish = Finish(reflectance=0.03, wrap=dice.uniform(0, 0.3))
    rough = dice.uniform(0.7, 1) + 0 * bright
    return Surface(albedo, height, rough, dice.uniform(0.05, 0.4), finish=finish)


def _rubber(dice: Dice, albedo: Tensor, height: Tensor, bright: Tensor) -> Surface:
    rough = dice.uniform(0.5, 0.95) - 0.1 * bright
    return Surface(albedo * 0.7, height, rough, dice.uniform(0.1, 0.6))


def _foliage(dice: Dice, albedo: Tensor, height: Tensor, bright: Tensor) -> Surface:
    finish = Finish(wrap=dice.uniform(0.1, 0.5))
    rough = dice.uniform(0.5, 0.95) + 0 * bright
    return Surface(albedo, height, rough, dice.uniform(0.3, 1.2), finish=finish)


_FINISHES: dict[str, Callable[[Dice, Tensor, Tensor, Tensor], Surface]] = {
    "wood": _wood,
    "fabric": _fabric,
    "metal": _metal,
    "plastic": _plastic,
    "stone": _stone,
    "ceramic": _ceramic,
    "paper": _paper,
    "rubber": _rubber,
    "foliage": _foliage,
}
