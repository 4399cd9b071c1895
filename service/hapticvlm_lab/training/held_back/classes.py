"""Surfaces of wood, glass, fabric and metal, drawn by a seeded generator.

Each class is drawn by several recipes (`RECIPES`): from held-back textures if there are any, and
from patterns and measured values if there are few. Independent of shapes and of any renderer.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from hapticvlm_lab.training.held_back import patterns
from hapticvlm_lab.training.held_back.catalogue import Catalogue, Texture
from hapticvlm_lab.training.held_back.surfaces import (
    Clear,
    Conductor,
    Opaque,
    Relief,
    Rng,
    Surface,
    Triple,
    any_colour,
    dressed,
    lightness,
    read_map,
    to_srgb,
)

Recipe = Callable[[Rng, Catalogue], Surface]

BARE_METALS = (
    *("Aluminum", "Brass", "Chromium", "Cobalt", "Copper", "Gold", "Iron", "Nickel", "Silver"),
    *("Stainless Steel", "Titanium", "Tungsten", "Zinc", "Lead", "Platinum"),
)
_PAINTED = ("CorrugatedSteel", "DiamondPlate")
# Linear tints per crossing: clear, soda-lime green, bottle green, amber, blue, smoke, rose.
_TINTS: tuple[Triple, ...] = (
    *((0.98, 0.99, 0.985), (0.98, 0.99, 0.985), (0.98, 0.99, 0.985), (0.92, 0.98, 0.95)),
    *((0.55, 0.8, 0.5), (0.85, 0.62, 0.3), (0.5, 0.65, 0.9), (0.6, 0.6, 0.62), (0.95, 0.7, 0.72)),
)


def pick(rng: Rng, catalogue: Catalogue, material: str, kinds: tuple[str, ...] = ()) -> Texture:
    """Pick a held-back texture of a class, only of some kinds if any are named."""
    pool = [t for t in catalogue.textures[material] if not kinds or t.kind in kinds]
    return pool[int(rng.integers(len(pool)))]


def _raw_wood(rng: Rng, catalogue: Catalogue) -> Surface:
    return dressed(rng, pick(rng, catalogue, "wood"))


def _varnished_wood(rng: Rng, catalogue: Catalogue) -> Surface:
    surface = dressed(rng, pick(rng, catalogue, "wood"), depth=0.006)
    return replace(surface, coat=rng.uniform(0.3, 0.9), roughness=rng.uniform(0.25, 0.5))


def _bare_metal(rng: Rng, catalogue: Catalogue, relief: Relief | None = None) -> Conductor:
    name = str(rng.choice(BARE_METALS))
    index = catalogue.values[name]["complexIor"]
    rough = float(rng.uniform(0.03, 0.25))
    return Conductor(
        made_of=f"measured {name}",
        eta=tuple(index["n"]),
        k=tuple(index["k"]),
        rough_u=rough,
        rough_v=rough,
        relief=relief,
    )


def _brushed_metal(rng: Rng, catalogue: Catalogue) -> Surface:
    relief = Relief(height=patterns.streaks(rng), depth=rng.uniform(0.0006, 0.0018))
    bare = _bare_metal(rng, catalogue, relief)
    rough = float(rng.uniform(0.08, 0.15))
    return replace(bare, made_of=f"brushed {bare.made_of}", rough_u=rough, rough_v=rough * 2.5)


def _hammered_metal(rng: Rng, catalogue: Catalogue) -> Surface:
    near, _ = patterns.cells(rng, int(rng.integers(25, 70)))
    bare = _bare_metal(rng, catalogue, Relief(height=near**2, depth=rng.uniform(0.015, 0.035)))
    return replace(bare, made_of=f"hammered {bare.made_of}")


def _metal_texture(rng: Rng, catalogue: Catalogue) -> Surface:
    texture = pick(rng, catalogue, "metal")
    surface = dressed(rng, texture, depth=0.01)
    if "roughness" in texture.maps:
        return surface
    worn = 1 - lightness(read_map(texture.maps["albedo"]))
    rough = np.clip(rng.uniform(0.15, 0.35) + 0.35 * worn, 0.1, 0.8).astype(np.float32)
    if texture.kind == "Rust":
        return replace(surface, metallic=0.25, roughness=0.6 + 0.3 * worn)
    if texture.kind == "CorrugatedSteel":
        ribs = patterns.grooves(int(rng.integers(8, 14)), 0.7)
        surface = replace(surface, relief=Relief(height=ribs, depth=0.05))
    painted = texture.kind in _PAINTED
    return replace(surface, roughness=rough, metallic=0.35 if painted else 1.0)


def _clear_glass(rng: Rng, catalogue: Catalogue) -> Clear:
    name = str(rng.choice(["Glass (Soda-lime)", "Glass (Borosilicate)"]))
    tint = _TINTS[int(rng.integers(len(_TINTS)))]
    return Clear(made_of=f"measured {name}", ior=catalogue.values[name]["ior"], tint=tint)


def _frosted_glass(rng: Rng, catalogue: Catalogue) -> Surface:
    del catalogue
    tint = _TINTS[int(rng.integers(len(_TINTS)))]
    return Clear(made_of="frosted glass", ior=1.52, tint=tint, roughness=rng.uniform(0.08, 0.3))


def _pressed_glass(rng: Rng, catalogue: Catalogue) -> Surface:
    ribs = patterns.grooves(int(rng.integers(5, 12)))
    near, _ = patterns.cells(rng, int(rng.integers(15, 40)))
    height = ribs if rng.random() < 0.5 else near
    clear = _clear_glass(rng, catalogue)
    relief = Relief(height=height, depth=rng.uniform(0.006, 0.015))
    return replace(clear, made_of="pressed glass", relief=relief)


def _cloth_texture(rng: Rng, catalogue: Catalogue) -> Surface:
    texture = pick(rng, catalogue, "fabric")
    surface = dressed(rng, texture, depth=0.015)
    soft = replace(surface, roughness=0.9, sheen=rng.uniform(0.2, 0.9), specular=0.2)
    if "roughness" in texture.maps:
        return replace(soft, roughness=surface.roughness)
    threads = _cloth(rng)
    shade = 0.72 + 0.28 * threads[..., None]
    colour = read_map(texture.maps["albedo"]) * shade
    return replace(soft, colour=colour, relief=Relief(height=threads, depth=0.02))


def _plain_cloth(rng: Rng, catalogue: Catalogue) -> Surface:
    del catalogue
    return _woven(rng, "plain cloth, woven by us", np.array(any_colour(rng, saturation=(0.1, 0.8))))


def _patterned_cloth(rng: Rng, catalogue: Catalogue) -> Surface:
    del catalogue
    bands = patterns.grooves(int(rng.integers(3, 7))) > rng.uniform(0.3, 0.8)
    share = bands.astype(np.float64)
    if rng.random() < 0.5:
        share = (share + share.T) / 2
    first = np.array(any_colour(rng))
    second = np.array(any_colour(rng))
    colour = first + (second - first) * share[..., None]
    return _woven(rng, "striped or checked cloth, woven by us", colour)


def _woven(rng: Rng, made_of: str, colour: NDArray[np.float64]) -> Opaque:
    """Weave cloth of a linear colour (3,) or (H, W, 3)."""
    threads = _cloth(rng)
    light = np.clip(threads * 0.8 + 0.4 * patterns.noise(rng, 0.6) - 0.1, 0, 1)
    return Opaque(
        made_of=made_of,
        colour=to_srgb(colour * (0.45 + 0.55 * light[..., None])),
        roughness=0.95,
        specular=0.15,
        sheen=rng.uniform(0.3, 1.0),
        relief=Relief(height=threads, depth=rng.uniform(0.015, 0.03)),
        repeat=rng.uniform(0.7, 1.2),
    )


def _cloth(rng: Rng) -> patterns.Plane:
    match int(rng.integers(4)):
        case 0:
            return patterns.weave(2 * int(rng.integers(12, 24)))
        case 1:
            return patterns.weave(3 * int(rng.integers(9, 16)), 2)
        case 2:
            return patterns.knit(int(rng.integers(9, 18)))
        case _:
            return patterns.noise(rng, 0.5)


RECIPES: dict[str, tuple[Recipe, ...]] = {
    "wood": (_raw_wood, _raw_wood, _varnished_wood),
    "metal": (
        *(_bare_metal, _bare_metal, _brushed_metal, _brushed_metal, _hammered_metal),
        *(_metal_texture, _metal_texture, _metal_texture),
    ),
    "glass": (_clear_glass, _clear_glass, _clear_glass, _frosted_glass, _pressed_glass),
    "fabric": (_cloth_texture, _cloth_texture, _plain_cloth, _patterned_cloth),
}
