"""Surfaces of none of our classes, which must stay unknown: skin, soil, snow, food, liquids, light.

Colours and indices are the measured ones of pb_renders/values.json; structure is noise. Water, ice
and honey are drawn as transparent bodies, so they resemble glass, as they do in life.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hapticvlm_lab.training.held_back import patterns
from hapticvlm_lab.training.held_back.catalogue import Catalogue
from hapticvlm_lab.training.held_back.surfaces import (
    Clear,
    Glowing,
    Opaque,
    Relief,
    Rng,
    Surface,
    Triple,
    any_colour,
    mixed,
    scaled,
)


@dataclass(frozen=True, slots=True)
class _Appearance:
    """The texture of a measured colour: darkest share, slope of the noise, depth, roughness."""

    darkest: float
    slope: float
    depth: float
    roughness: float
    stretch: float = 1.0
    spots: float = 0.0


_SKIN = _Appearance(0.8, 0.9, 0.006, 0.45)
_SOFT = _Appearance(0.85, 1.4, 0.01, 0.35)
_GRAIN = _Appearance(0.55, 0.3, 0.02, 0.9)
_LUMPS = _Appearance(0.4, 1.1, 0.07, 0.95)
_PEEL = _Appearance(0.85, 0.6, 0.012, 0.4, spots=0.15)

_OPAQUE: dict[str, tuple[str, _Appearance]] = {
    **{
        f"skin {number}": (f"Skin {number}", _SKIN)
        for number in ("I", "II", "III", "IV", "V", "VI")
    },
    "banana": ("Banana", _Appearance(0.7, 1.5, 0.004, 0.5, 4.0, 0.1)),
    "carrot": ("Carrot", _Appearance(0.75, 0.8, 0.012, 0.55, 10.0)),
    "chocolate": ("Chocolate", _SOFT),
    "lemon": ("Lemon", _PEEL),
    "orange": ("Orange", _PEEL),
    "ketchup": ("Ketchup", _Appearance(0.8, 1.6, 0.03, 0.12)),
    "cream": ("Cream", _SOFT),
    "crystallised honey": ("Honey (Crystallized)", _GRAIN),
    "brown egg": ("Egg Shell (Brown)", _Appearance(0.9, 0.7, 0.003, 0.6, spots=0.05)),
    "white egg": ("Egg Shell (White)", _Appearance(0.95, 0.7, 0.003, 0.6)),
    "bone": ("Bone", _Appearance(0.6, 1.0, 0.02, 0.7, 6.0)),
    "charcoal": ("Charcoal", _LUMPS),
    "snow": ("Snow", _Appearance(0.85, 1.0, 0.05, 0.8)),
    "trodden snow": ("Snow", _Appearance(0.6, 1.2, 0.12, 0.8)),
    "sand": ("Sand", _GRAIN),
    "rippled sand": ("Sand", _Appearance(0.6, 1.2, 0.08, 0.9, 5.0)),
    "salt": ("Salt", _Appearance(0.7, 0.3, 0.03, 0.3)),
    "milk": ("Milk", _Appearance(0.98, 2.0, 0.002, 0.08)),
    "toothpaste": ("Toothpaste", _Appearance(0.9, 1.6, 0.03, 0.15)),
    "pearl": ("Pearl", _Appearance(0.9, 1.8, 0.002, 0.25)),
    "foam": ("Polystyrene (Foam)", _Appearance(0.8, 0.5, 0.02, 0.8)),
}
_BODIES = {"water": "Water", "ice": "Ice", "honey": "Honey (Liquid)", "amber": "Amber"}
_OWN = ("soil", "wet soil", "mud", "bread", "cheese", "meat", "fur", "glowing blob", "glowing sign")
NAMES = (*_OPAQUE, *_BODIES, *_OWN)

_EARTH: Triple = (0.12, 0.07, 0.035)


def draw(number: int, rng: Rng, catalogue: Catalogue) -> Surface:
    """Draw the unknown surface of a number; numbers past the last start over."""
    name = NAMES[number % len(NAMES)]
    if name in _OPAQUE:
        substance, appearance = _OPAQUE[name]
        return _broken_up(name, _measured(catalogue, substance), appearance, rng)
    if name in _BODIES:
        return _body(name, rng, catalogue)
    if name.startswith("glowing"):
        return Glowing(made_of=name, colour=scaled(any_colour(rng), 1.2))
    return _own(name, rng)


def _measured(catalogue: Catalogue, substance: str) -> Triple:
    red, green, blue = catalogue.values[substance]["color"]["color"]
    return red, green, blue


def _broken_up(name: str, base: Triple, appearance: _Appearance, rng: Rng) -> Opaque:
    share = patterns.noise(rng, appearance.slope, appearance.stretch)
    if appearance.spots:
        near, _ = patterns.cells(rng, 60)
        share = np.where(near < appearance.spots, 0.0, share).astype(np.float32)
    return Opaque(
        made_of=name,
        colour=mixed(scaled(base, appearance.darkest), base, share),
        roughness=appearance.roughness,
        relief=Relief(height=share, depth=appearance.depth),
        repeat=rng.uniform(0.5, 0.9),
    )


def _body(name: str, rng: Rng, catalogue: Catalogue) -> Clear:
    substance = catalogue.values[_BODIES[name]]
    red, green, blue = (channel**0.5 for channel in substance["color"]["color"])
    waves = Relief(height=patterns.noise(rng, 2.6), depth=0.04)
    rough = 0.12 if name == "ice" else 0.0
    return Clear(
        made_of=name, ior=substance["ior"], tint=(red, green, blue), roughness=rough, relief=waves
    )


def _own(name: str, rng: Rng) -> Opaque:
    """Draw a surface without a measured value: soils and foods, colours by eye."""
    appearances: dict[str, tuple[Triple, _Appearance]] = {
        "soil": (_EARTH, _LUMPS),
        "wet soil": (scaled(_EARTH, 0.5), _Appearance(0.3, 1.0, 0.06, 0.35)),
        "mud": (scaled(_EARTH, 0.8), _Appearance(0.7, 1.8, 0.08, 0.2)),
        "bread": ((0.55, 0.33, 0.13), _Appearance(0.35, 1.0, 0.05, 0.9)),
        "cheese": ((0.8, 0.55, 0.12), _Appearance(0.8, 1.4, 0.02, 0.4, spots=0.22)),
        "meat": ((0.45, 0.09, 0.07), _Appearance(0.35, 1.3, 0.02, 0.25, 3.0)),
        "fur": ((0.3, 0.2, 0.11), _Appearance(0.2, 0.5, 0.06, 1.0, 14.0)),
    }
    base, appearance = appearances[name]
    return _broken_up(name, base, appearance, rng)
