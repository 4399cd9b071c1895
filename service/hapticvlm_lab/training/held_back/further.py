"""Surfaces of plastic, stone, ceramic, paper, leather, rubber and foliage.

Few or no held-back textures exist of plastic, paper, leather and rubber: most of these are drawn
from patterns (`made_of` names them). Independent of shapes and of any renderer.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from hapticvlm_lab.training.held_back import patterns
from hapticvlm_lab.training.held_back.catalogue import Catalogue
from hapticvlm_lab.training.held_back.classes import Recipe, pick
from hapticvlm_lab.training.held_back.surfaces import (
    Opaque,
    Relief,
    Rng,
    Surface,
    Triple,
    any_colour,
    dressed,
    mixed,
    scaled,
)

_POLISHABLE = ("Marble", "Granite", "Onyx", "Terrazzo", "Travertine")
_HIDES: tuple[Triple, ...] = (
    *((0.22, 0.09, 0.035), (0.09, 0.035, 0.018), (0.02, 0.018, 0.017), (0.35, 0.17, 0.07)),
    *((0.25, 0.02, 0.02), (0.5, 0.4, 0.28), (0.03, 0.05, 0.09)),
)
_GREENS: tuple[Triple, ...] = (
    *((0.05, 0.16, 0.025), (0.1, 0.24, 0.03), (0.03, 0.09, 0.03), (0.2, 0.26, 0.04)),
)


def _moulded_plastic(rng: Rng, catalogue: Catalogue) -> Surface:
    del catalogue
    glossy = rng.random() < 0.5
    grain = Relief(height=patterns.noise(rng, 0.7), depth=rng.uniform(0.003, 0.008))
    return Opaque(
        made_of="moulded plastic",
        colour=any_colour(rng, saturation=(0.0, 1.0)),
        roughness=rng.uniform(0.08, 0.2) if glossy else rng.uniform(0.25, 0.5),
        coat=0.4 if glossy else 0.0,
        relief=None if glossy else grain,
    )


def _plastic_texture(rng: Rng, catalogue: Catalogue) -> Surface:
    surface = dressed(rng, pick(rng, catalogue, "plastic"), depth=0.006)
    return replace(surface, roughness=rng.uniform(0.15, 0.4))


def _polished_stone(rng: Rng, catalogue: Catalogue) -> Surface:
    texture = pick(rng, catalogue, "stone", _POLISHABLE)
    surface = dressed(rng, texture, depth=0.002)
    return replace(surface, roughness=rng.uniform(0.1, 0.35), coat=0.4)


def _rough_stone(rng: Rng, catalogue: Catalogue) -> Surface:
    texture = pick(rng, catalogue, "stone", ("Rock", "Bricks", "Concrete", "godot_rock"))
    surface = dressed(rng, texture, depth=0.06)
    return replace(surface, roughness=rng.uniform(0.7, 0.95), specular=0.3)


def _glazed(rng: Rng, catalogue: Catalogue) -> Surface:
    white = catalogue.values["Porcelain"]["color"]["color"]
    base: Triple = (white[0], white[1], white[2])
    other = any_colour(rng) if rng.random() < 0.6 else scaled(base, 0.85)
    share = patterns.noise(rng, rng.uniform(1.2, 2.0))
    if rng.random() < 0.4:
        share = (patterns.grooves(2, 0.4) > 0.85).astype(np.float32).T
    return Opaque(
        made_of="glazed porcelain, glaze by us",
        colour=mixed(base, other, share),
        roughness=rng.uniform(0.08, 0.25),
        coat=1.0,
        repeat=rng.uniform(0.5, 0.9),
    )


def _terracotta(rng: Rng, catalogue: Catalogue) -> Surface:
    red = catalogue.values["Terracotta"]["color"]["color"]
    base: Triple = (red[0], red[1], red[2])
    turned = Relief(height=patterns.noise(rng, 0.9, 12.0), depth=0.015)
    colour = mixed(scaled(base, 0.6), base, patterns.noise(rng, 1.0))
    return Opaque(made_of="measured Terracotta", colour=colour, roughness=0.9, relief=turned)


def _tiled(rng: Rng, catalogue: Catalogue) -> Surface:
    surface = dressed(rng, pick(rng, catalogue, "ceramic"), depth=0.01)
    return replace(surface, coat=0.8, roughness=rng.uniform(0.1, 0.3))


def _white_paper(rng: Rng, catalogue: Catalogue) -> Surface:
    surface = dressed(rng, pick(rng, catalogue, "paper"), depth=0.006)
    return replace(surface, roughness=0.9, specular=0.2)


def _cardboard(rng: Rng, catalogue: Catalogue) -> Surface:
    brown = catalogue.values["Cardboard"]["color"]["color"]
    base: Triple = (brown[0], brown[1], brown[2])
    fibres = 0.5 * patterns.noise(rng, 0.3, 6.0) + 0.5 * patterns.noise(rng, 1.0)
    flutes = Relief(height=patterns.grooves(30), depth=0.004)
    colour = mixed(scaled(base, 0.75), scaled(base, 1.25), fibres)
    return Opaque(
        made_of="measured Cardboard", colour=colour, roughness=0.9, specular=0.2, relief=flutes
    )


def _printed_paper(rng: Rng, catalogue: Catalogue) -> Surface:
    white = catalogue.values["Office Paper"]["color"]["color"]
    base: Triple = (white[0], white[1], white[2])
    page = mixed(
        (0.03, 0.03, 0.03), scaled(base, rng.uniform(0.75, 1.0)), patterns.print_lines(rng)
    )
    return Opaque(made_of="page printed by us", colour=page, roughness=0.85, specular=0.25)


def _hide(rng: Rng, catalogue: Catalogue) -> Surface:
    del catalogue
    base = _HIDES[int(rng.integers(len(_HIDES)))]
    _, border = patterns.cells(rng, int(rng.integers(1500, 4000)))
    pebbles = np.sqrt(np.clip(border * 1.6, 0, 1))
    worn = 0.7 * pebbles + 0.3 * patterns.noise(rng, 1.4)
    height = 0.75 * pebbles + 0.25 * patterns.noise(rng, 1.6)
    return Opaque(
        made_of="pebbled hide, grain by us",
        colour=mixed(scaled(base, 0.6), scaled(base, 1.15), worn),
        roughness=rng.uniform(0.3, 0.5),
        relief=Relief(height=height.astype(np.float32), depth=rng.uniform(0.008, 0.016)),
        repeat=rng.uniform(0.7, 1.1),
    )


def _moulded_rubber(rng: Rng, catalogue: Catalogue) -> Surface:
    black = catalogue.values["Tire"]["color"]["color"]
    base: Triple = (black[0], black[1], black[2])
    if rng.random() < 0.35:
        base = scaled(any_colour(rng), 0.5)
    tread = patterns.grooves(int(rng.integers(6, 14)), 0.3)
    tread = np.minimum(tread, patterns.grooves(int(rng.integers(4, 9)), 0.3).T)
    treaded = rng.random() < 0.6
    return Opaque(
        made_of="moulded rubber",
        colour=mixed(scaled(base, 0.7), scaled(base, 1.3), patterns.noise(rng, 0.8)),
        roughness=rng.uniform(0.6, 0.85),
        specular=0.4,
        relief=Relief(height=tread, depth=0.04) if treaded else None,
    )


def _rubber_texture(rng: Rng, catalogue: Catalogue) -> Surface:
    surface = dressed(rng, pick(rng, catalogue, "rubber"), depth=0.012)
    return replace(surface, roughness=rng.uniform(0.6, 0.85))


def _lawn(rng: Rng, catalogue: Catalogue) -> Surface:
    surface = dressed(rng, pick(rng, catalogue, "foliage"), depth=0.07)
    return replace(surface, roughness=0.8, specular=0.3)


def leaf(rng: Rng, catalogue: Catalogue) -> Surface:
    """Draw the surface of a single leaf, one repeat to the leaf."""
    del catalogue
    base = _GREENS[int(rng.integers(len(_GREENS)))]
    veins = np.clip(patterns.leaf(rng) * 0.7 + 0.5 * patterns.noise(rng, 1.2), 0, 1)
    return Opaque(
        made_of="leaves, veins by us",
        colour=mixed(scaled(base, 0.7), scaled(base, 1.9), veins),
        roughness=rng.uniform(0.3, 0.55),
        repeat=1.0,
    )


RECIPES: dict[str, tuple[Recipe, ...]] = {
    "plastic": (_moulded_plastic, _moulded_plastic, _plastic_texture),
    "stone": (_polished_stone, _rough_stone),
    "ceramic": (_glazed, _glazed, _terracotta, _tiled),
    "paper": (_white_paper, _cardboard, _printed_paper),
    "leather": (_hide,),
    "rubber": (_moulded_rubber, _moulded_rubber, _rubber_texture),
    "foliage": (_lawn,),
}
