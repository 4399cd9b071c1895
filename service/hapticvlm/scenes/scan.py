"""Scans a scene: the decision that the service would make on each surface before any frame. Pure.

Each surface is declared as a client declares it and climbs the same ladder as in a session. Where
names and shader leave it open, its texture is asked, if the caller gives a way to look at it.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Callable, Hashable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Literal, get_args

import msgspec

from hapticvlm import materials
from hapticvlm.evidence import ladder, sub_materials
from hapticvlm.evidence.ambient import ambient
from hapticvlm.evidence.ladder import Evidence
from hapticvlm.evidence.lexicon import Lexicon, read_lexicon
from hapticvlm.materials import Material
from hapticvlm.messages import Decision
from hapticvlm.rendering.heat.limits import AT_REST, limits_of
from hapticvlm.scenes.declaration import object_of
from hapticvlm.scenes.scene import Scene, SceneNode, Texture
from hapticvlm.session import decisions, scene_objects
from hapticvlm.session.targets import ObjectTarget

_DIGITS = re.compile(r"\d+")

Sureness = Literal["sure", "probable", "unknown"]
Look = Callable[[Texture], Evidence | None]  # returns None for a texture that cannot be read


@dataclass(frozen=True, slots=True)
class Row:
    """One surface of one object, by its index there, and the decision on it.

    `said` is the surface's name as it was declared; `is_named` tells whether any name said
    something of matter. `texture` is the name of its base-colour map.
    """

    object_id: str
    surface: int
    said: str | None
    texture: str | None
    is_named: bool
    decision: Decision

    @property
    def sureness(self) -> Sureness:
        """`sure` needs no picture, `probable` is named, `unknown` is not."""
        if self.decision.material == materials.UNKNOWN:
            return "unknown"
        return "sure" if self.decision.confidence >= ladder.SURE else "probable"


@dataclass(frozen=True, slots=True)
class Summary:
    """Counts of surfaces by sureness, and what would make the others sure.

    `help` has a sentence for each cause, with the count of unsure surfaces that it concerns.
    """

    surfaces: int
    objects: int
    counts: Mapping[Sureness, int]
    help: tuple[str, ...]


def surfaces_of(scene: Scene) -> list[tuple[SceneNode, int]]:
    """Return every surface as its object and its index there."""
    return [(node, at) for node in scene.objects for at in range(len(node.surfaces))]


def scan(
    surfaces: Iterable[tuple[SceneNode, int]],
    table: Mapping[str, Material] = materials.MATERIALS,
    look: Look | None = None,
) -> Iterator[Row]:
    """Yield a row for each surface. `look` is asked about a texture once, and only if needed.

    Copies are decided on once: evidence splits a name at its numbers and knows no digit, so that
    Chair_1 and Chair_2 with the same surface are one case.
    """
    lexicon = read_lexicon(table)
    decided: dict[Hashable, Row] = {}
    seen: dict[int, Evidence | None] = {}  # by identity: a scene shares its textures

    def looked(texture: Texture) -> Evidence | None:
        if look is not None and id(texture) not in seen:
            seen[id(texture)] = look(texture)
        return seen.get(id(texture))

    for node, at in surfaces:
        surface = node.surfaces[at]
        key = (_DIGITS.sub("0", node.name), surface.name, surface.shader, id(surface.texture))
        row = decided.get(key)
        if row is None:
            row = decided[key] = _row(node, at, table, lexicon, looked)
        decision = msgspec.structs.replace(row.decision, object_id=node.object_id)
        yield replace(row, object_id=node.object_id, surface=at, decision=decision)


def _row(
    node: SceneNode, at: int, table: Mapping[str, Material], lexicon: Lexicon, look: Look
) -> Row:
    surface = node.surfaces[at]
    target = ObjectTarget(node.object_id)
    declared = scene_objects.as_surface(target, object_of(node, lexicon, at))
    assert declared is not None
    evidence = scene_objects.from_declaration(target, declared, lexicon)
    is_named = any(each.rung == "name" for each in evidence)
    texture = surface.texture
    if texture is not None and not ladder.is_sure(evidence):
        shown = look(texture)
        evidence = evidence if shown is None else (*evidence, shown)
    said = scene_objects.surface_name_of(declared)
    detail = sub_materials.from_name(declared.name or "", lexicon, said)
    verdict = ladder.decide(evidence, table)
    refined = detail.refine(table)
    inputs = decisions.DecisionInputs(
        verdict=verdict,
        rendition=decisions.choose_rendition(verdict, refined),
        detail=detail,
        facts=declared,
        ambient=ambient(None),
        thermal_gain=1.0,
        limits=limits_of(AT_REST),
    )
    decision = decisions.decide(node.object_id, inputs, refined)
    return Row(
        object_id=node.object_id,
        surface=at,
        said=said,
        texture=None if texture is None else texture.name,
        is_named=is_named,
        decision=decision,
    )


def summarise(rows: Sequence[Row]) -> Summary:
    """Count the surfaces, and say what would make the unsure ones sure."""
    unsure = [row for row in rows if row.sureness != "sure"]
    causes = Counter(_cause(row) for row in unsure)
    mute = dict.fromkeys(row.said or "" for row in unsure if _cause(row) == "mute")
    examples = ", ".join(list(mute)[:3])
    cures = {
        "mute": f"have names that say nothing of matter ({examples}); rename their materials",
        "bare": "have no material's name; give them a material with a name",
        "ambiguous": "have names that leave it open; state `material`, or send frames",
    }
    return Summary(
        surfaces=len(rows),
        objects=len({row.object_id for row in rows}),
        counts={each: sum(row.sureness == each for row in rows) for each in get_args(Sureness)},
        help=tuple(
            f"{causes[each]} of them {cure}" for each, cure in cures.items() if causes[each]
        ),
    )


def _cause(row: Row) -> str:
    """Return why a surface is unsure: a name of several materials, of none, or no name."""
    if row.is_named:
        return "ambiguous"
    return "mute" if row.said else "bare"
