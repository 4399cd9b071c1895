"""Reads an object's sub-material and thickness from its name. Pure.

The thermal constants of a material are those of its usual kind: plastic is solid, stone is granite,
foliage is thick. Styrofoam, brick or a leaf differ from that by more than skin can feel, so their
words have their own constants and thickness (sub_materials.toml; docs/physics.md 1.5). They count
only for the material that the ladder decides on, and a thickness stated by the scene overrides
them.
"""

from __future__ import annotations

import tomllib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from types import MappingProxyType
from typing import Any

from hapticvlm.evidence import names
from hapticvlm.evidence.lexicon import Lexicon
from hapticvlm.materials import Material, Thermal

TABLE = Path(__file__).with_name("sub_materials.toml")

Run = tuple[str, ...]


@dataclass(frozen=True, slots=True)
class SubMaterial:
    """A kind of some materials (`of`) with its own thermal constants."""

    name: str
    of: tuple[str, ...]
    thermal: Thermal
    source: str


@dataclass(frozen=True, slots=True)
class Thickness:
    """The thickness, m, of a thing that is always thin, if made of one of the materials `of`."""

    name: str
    of: tuple[str, ...]
    metres: float
    source: str


@dataclass(frozen=True, slots=True)
class MaterialDetail:
    """Sub-materials and thicknesses from a name, by the material that the object may have."""

    sub_materials: Mapping[str, SubMaterial]
    thickness_m: Mapping[str, float]

    def sub_material(self, material: str) -> str | None:
        """Return the name of the sub-material for this material; None for its usual kind."""
        kind = self.sub_materials.get(material)
        return None if kind is None else kind.name

    def refine(self, table: Mapping[str, Material]) -> Mapping[str, Material]:
        """Return the material table with this object's sub-materials in it."""
        if not self.sub_materials:
            return table
        finer = {
            name: replace(table[name], thermal=kind.thermal)
            for name, kind in self.sub_materials.items()
            if name in table
        }
        return {**table, **finer}


PLAIN = MaterialDetail(MappingProxyType({}), MappingProxyType({}))


def from_name(name: str, lexicon: Lexicon, surface: str | None = None) -> MaterialDetail:
    """Return the details of a name and of its surface's name; PLAIN if they give none.

    Of several sub-materials of a material the first named counts: "brick concrete" is brick. What
    the surface's name says counts before what the object's says.
    """
    own = _of_words(names.head_words(name, lexicon))
    if not surface:
        return own
    over = _of_words(names.head_words(surface, lexicon))
    return MaterialDetail(
        {**own.sub_materials, **over.sub_materials}, {**own.thickness_m, **over.thickness_m}
    )


def _of_words(words: tuple[str, ...]) -> MaterialDetail:
    kinds: dict[str, SubMaterial] = {}
    for run in _runs(words):
        kind = SUB_MATERIALS.get(run)
        kinds = {**dict.fromkeys(kind.of, kind), **kinds} if kind else kinds
    ends = (words[start:] for start in reversed(range(len(words))))
    metres = {
        name: row.metres for run in ends for row in THICKNESSES.get(run, ()) for name in row.of
    }
    return MaterialDetail(kinds, metres) if kinds or metres else PLAIN


def _runs(words: Sequence[str]) -> Iterator[Run]:
    """Split words into known runs, the longest first, from left to right."""
    at = 0
    while at < len(words):
        runs = [tuple(words[at : at + length]) for length in range(LONGEST, 0, -1)]
        run = next((run for run in runs if run in SUB_MATERIALS), runs[-1])
        yield run
        at += len(run)


def _read_sub_materials(table: Mapping[str, Any]) -> Mapping[Run, SubMaterial]:
    kinds: dict[Run, SubMaterial] = {}
    for name, row in table.items():
        kind = SubMaterial(name, tuple(row["of"].split()), Thermal(*row["bulk"]), row["source"])
        kinds |= dict.fromkeys(_words(row), kind)
    return MappingProxyType(kinds)


def _read_thicknesses(table: Mapping[str, Any]) -> Mapping[Run, tuple[Thickness, ...]]:
    kinds: dict[Run, tuple[Thickness, ...]] = {}
    for name, row in table.items():
        kind = Thickness(name, tuple(row["of"].split()), row["metres"], row["source"])
        for run in _words(row):
            kinds[run] = (*kinds.get(run, ()), kind)
    return MappingProxyType(kinds)


def _words(row: Mapping[str, str]) -> list[Run]:
    return [tuple(run.split()) for run in row["words"].split(",")]


_FILE = tomllib.loads(TABLE.read_text(encoding="utf-8"))
SUB_MATERIALS = _read_sub_materials(_FILE["sub_materials"])
THICKNESSES = _read_thicknesses(_FILE["thickness_m"])
LONGEST = max(map(len, SUB_MATERIALS))
