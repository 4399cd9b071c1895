"""Finds a thing of a client in a bake: the rule that every client's helper follows. Pure.

A thing is found by its id, else by the path of its names, else by its material's name, and is then
felt as that surface; a found thing without such a surface is felt as its largest. Order says least,
so an index decides only between surfaces of which nothing else is known: loaders, compression and
each export change it. `tests/identity_cases.json` has the cases that all clients pass.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import msgspec

By = Literal["id", "path", "material"]
AS_THE_SCENE = "scene"


class Surface(msgspec.Struct, frozen=True, omit_defaults=True, kw_only=True):
    """The marks of a surface of an object: its material's name, and its primitives in glTF."""

    name: str | None = None
    primitives: tuple[int, ...] = ()


class Thing(msgspec.Struct, frozen=True, omit_defaults=True, kw_only=True):
    """The marks of an object: the paths of its names as engines spell them, and its surfaces.

    An engine that is not in `paths` spells names as the scene (`scene`) does.
    """

    paths: dict[str, tuple[str, ...]] = {}
    surfaces: tuple[Surface, ...]


@dataclass(frozen=True, slots=True)
class Query:
    """A touched thing as a client knows it; `paths` are spellings of `engine`, the best first."""

    object_id: str | None = None
    paths: tuple[str, ...] = ()
    material: str | None = None
    primitive: int | None = None
    surface: int = 0
    engine: str = AS_THE_SCENE


@dataclass(frozen=True, slots=True)
class _Spelling:
    """A spelling of an object's path: its names, and whether each engine spells it so."""

    names: list[str]
    object_id: str
    engine: str
    others: frozenset[str]  # engines that spell it otherwise

    def is_of(self, engine: str) -> bool:
        return engine == self.engine or (self.engine == AS_THE_SCENE and engine not in self.others)


@dataclass(frozen=True, slots=True)
class Found:
    """An object and the index of a surface in it, and by what it was found."""

    object_id: str
    surface: int
    by: By


class Lookup:
    """The objects of one bake, by id."""

    def __init__(self, objects: Mapping[str, Thing]) -> None:
        self.objects = objects
        self._named: dict[str, list[_Spelling]] = {}  # by its own name
        self._of_material: dict[str, Found] = {}
        for object_id, thing in objects.items():
            for engine, paths in thing.paths.items():
                for path in paths:
                    names = path.split("/")
                    spelling = _Spelling(names, object_id, engine, frozenset(thing.paths))
                    self._named.setdefault(names[-1], []).append(spelling)
            for index, surface in enumerate(thing.surfaces):
                for name in names_of(surface.name):
                    self._of_material.setdefault(name, Found(object_id, index, "material"))

    def find(self, query: Query) -> Found | None:
        """Return what this is in the bake; None: nothing of it is known."""
        object_id = self._by_id(query.object_id)
        by: By = "path" if object_id is None else "id"
        if object_id is None:
            object_id = self._by_path(query)
        if object_id is not None:
            return Found(object_id, _surface(self.objects[object_id].surfaces, query), by)
        named = (self._of_material.get(name) for name in names_of(query.material))
        return next((each for each in named if each is not None), None)

    def nearest(self, name: str) -> str | None:
        """Return the id that shares most pairs of letters with a name (Dice's coefficient)."""
        pairs = _pairs(name)
        return max(self.objects, key=lambda each: _alike(pairs, _pairs(each)), default=None)

    def _by_id(self, object_id: str | None) -> str | None:
        """Return the object with this id, or the one that an id `original~copy` is a copy of."""
        if object_id is None or object_id in self.objects:
            return object_id
        original = object_id.rpartition("~")[0]
        return original if original in self.objects else None

    def _by_path(self, query: Query) -> str | None:
        """Return the object whose names agree farthest, from its own name up to its parents'."""
        for path in query.paths:
            names = path.split("/")
            candidates = self._named.get(names[-1], [])
            if not candidates:
                continue
            ranks = [(_shared(names, each.names), each.is_of(query.engine)) for each in candidates]
            best = [
                each.object_id
                for each, rank in zip(candidates, ranks, strict=True)
                if rank == max(ranks)
            ]
            return next((each for each in best if self._has(each, query.material)), best[0])
        return None

    def _has(self, object_id: str, material: str | None) -> bool:
        wanted = names_of(material)
        return any(
            name in wanted
            for each in self.objects[object_id].surfaces
            for name in names_of(each.name)
        )


def _surface(surfaces: Sequence[Surface], query: Query) -> int:
    """Return the surface with this material's name, else this primitive, else this index."""
    candidates: Iterable[int] = range(len(surfaces))
    for wanted in names_of(query.material):
        named = [at for at in candidates if wanted in names_of(surfaces[at].name)]
        if named:
            candidates = named
            break
    candidates = list(candidates)
    for at in candidates:
        if query.primitive is not None and query.primitive in surfaces[at].primitives:
            return at
    return query.surface if query.surface in candidates else candidates[0]


def names_of(name: str | None) -> tuple[str, ...]:
    """Return a material's name as a whole, and without that of its texture's file before it."""
    if not name:
        return ()
    last = name.rpartition("/")[2]
    return (name,) if last in {"", name} else (name, last)


def _shared(names: Sequence[str], others: Sequence[str]) -> int:
    """Return how many names agree, from the last on."""
    count = 0
    for one, other in zip(reversed(names), reversed(others), strict=False):
        if one != other:
            break
        count += 1
    return count


def _pairs(text: str) -> set[str]:
    low = text.lower()
    return {low[at : at + 2] for at in range(len(low) - 1)}


def _alike(pairs: set[str], others: set[str]) -> float:
    return 2.0 * len(pairs & others) / max(1, len(pairs) + len(others))
