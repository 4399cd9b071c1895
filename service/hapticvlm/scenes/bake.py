"""Bakes a scene: what each surface is, as `materials.json`, for players that have no service.

The verdicts are those of the session. What a person corrected in the file stays: a surface whose
`by` is `hand` keeps its material in the next bake, found again as a client finds it, and so does
every surface whose material's name fits a pattern of `corrections`. Pure.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from fnmatch import fnmatchcase
from typing import Annotated

import msgspec

from hapticvlm.errors import UsageError
from hapticvlm.evidence.ladder import Evidence
from hapticvlm.materials import Material, no_material
from hapticvlm.messages import Scene
from hapticvlm.rendering.heat.limits import AT_REST, limits_of
from hapticvlm.rendering.vibration.hum import Hum, Tone
from hapticvlm.scenes import lookup
from hapticvlm.scenes.lookup import Found, Lookup, Query
from hapticvlm.scenes.scan import Look
from hapticvlm.scenes.scene import SceneNode
from hapticvlm.session.scene_model import SceneModel
from hapticvlm.session.settings import SessionSettings
from hapticvlm.session.targets import ObjectTarget
from hapticvlm.session.textures import MOST_SURFACES, Textures

VERSION = 2
BY_HAND = "hand"
BY_PATTERN = "pattern"
NEEDS_SERVICE = (
    "heat: a plate needs its service; surface_c is what the service would render",
    "pictures: a surface whose picture changes keeps the material of the bake",
    "studies: `hapticvlm study` runs with the service only",
)
_NAMED = 20  # names of one sentence; the others are counted


class BakedHum(msgspec.Struct, frozen=True):
    """The hum of a thing that runs: Hz, level 0..1, and the amplitude of each harmonic."""

    frequency_hz: float
    level: float
    drives: tuple[float, ...]


class BakedSurface(lookup.Surface, frozen=True, omit_defaults=True, kw_only=True):
    """One surface as it is felt; `material` is null where nothing is.

    `name` is that of its material in the scene. `belief` (0..1) is in this material. `by` is the
    source of the verdict, `hand` or `pattern`. `impact_gain` is below 1 where the material is
    doubtful. `thickness_m` is that of a swung object, if stated.
    """

    material: str | None
    belief: float
    by: str
    surface_c: float
    surface_by: str
    impact_gain: float = 1.0
    thickness_m: float | None = None
    hum: BakedHum | None = None


class BakedObject(lookup.Thing, frozen=True, omit_defaults=True, kw_only=True):
    """One object: its surfaces, the largest first; `node` is its index in a glTF file."""

    node: int | None = None
    surfaces: Annotated[tuple[BakedSurface, ...], msgspec.Meta(min_length=1)]


class Materials(msgspec.Struct, frozen=True):
    """The file `materials.json`. `not_baked` has a sentence for each thing that is not in it.

    `corrections` are by patterns of materials' names, such as `shade*`; a person writes them.
    """

    version: Annotated[int, msgspec.Meta(ge=VERSION, le=VERSION)]
    objects: dict[str, BakedObject]
    not_baked: tuple[str, ...]
    corrections: dict[str, str] = {}


@dataclass(frozen=True, slots=True)
class Bake:
    """The surfaces, what they are felt as, and corrections of surfaces that the scene lost."""

    materials: Materials
    felt: Mapping[str, Material]
    lost: tuple[str, ...]


def model_of(scenes: Iterable[Scene], table: Mapping[str, Material]) -> SceneModel:
    """Return the model of a scene that these messages declare. Raises MessageError."""
    model = SceneModel(SessionSettings(owner=False, table=table))
    for scene in scenes:
        model.declare(scene)
    return model


def read_textures(model: SceneModel, surfaces: Iterable[tuple[SceneNode, int]], look: Look) -> None:
    """Add what the textures show of the surfaces that their names and shaders leave open.

    Each surface is an object of the model and the index there. `look` is asked about a texture
    once, as in a scan. A session reads few maps, so that a client cannot keep it busy; a bake has
    no client and reads all.
    """
    textures = model.objects.textures = Textures(most=MOST_SURFACES)
    shown: dict[int, Evidence | None] = {}  # by identity: a scene shares its textures
    for node, index in surfaces:
        target = ObjectTarget(node.object_id, index)
        texture = node.surfaces[index].texture
        if texture is None or not model.objects.needs_recognition(target):
            continue
        key = id(texture)
        if key not in shown:
            shown[key] = look(texture)
        evidence = shown[key]
        if evidence is not None:
            textures.note(target, str(key))
            model.objects.add_texture(str(key), evidence)


def bake(
    model: SceneModel,
    table: Mapping[str, Material],
    before: Materials | None = None,
    *,
    nodes: Iterable[SceneNode] = (),
    unknown: str | None = None,
) -> Bake:
    """Bake the scene of this model; corrections of `before` are kept.

    `nodes` are the objects as their glTF file has them, for clients that know them by its names.
    `unknown` is the material of surfaces of which nothing is known; None: they are not felt.

    Raises UsageError for a correction whose material is not in the table.
    """
    known = {target.object_id for target in model.objects.known if isinstance(target, ObjectTarget)}
    of_file = {node.object_id: node for node in nodes}
    objects = {
        object_id: _baked_object(model, object_id, of_file.get(object_id))
        for object_id in sorted(known)
    }
    patterns = {} if before is None else before.corrections
    lost = [] if before is None else [*_correct(objects, before, table)]
    not_felt = _unknown(objects)
    if unknown is not None:
        objects = {object_id: _defaulted(each, unknown) for object_id, each in objects.items()}
    felt = {one.material for each in objects.values() for one in each.surfaces}
    used = {name: table[name] for name in sorted(name for name in felt if name is not None)}
    sentences = (*NEEDS_SERVICE, *(not_felt if unknown is None else ()))
    materials = Materials(VERSION, objects, sentences, patterns)
    return Bake(materials, used, tuple(lost))


def encode(materials: Materials) -> bytes:
    """Return the contents of `materials.json`."""
    return msgspec.json.format(msgspec.json.encode(materials), indent=1) + b"\n"


def decode(content: bytes) -> Materials:
    """Read `materials.json`. Raises UsageError."""
    try:
        return msgspec.json.decode(content, type=Materials)
    except msgspec.DecodeError as error:  # a ValidationError, too
        raise UsageError(
            f"materials.json: {error}; correct it, or remove it to bake without its corrections"
        ) from None


def _correct(
    objects: dict[str, BakedObject], before: Materials, table: Mapping[str, Material]
) -> Iterator[str]:
    """Correct these objects as a person corrected the file; yield what is not found again."""
    yield from _correct_by_pattern(objects, before, table)
    yield from _correct_by_hand(objects, before, table)


def _correct_by_pattern(
    objects: dict[str, BakedObject], before: Materials, table: Mapping[str, Material]
) -> Iterator[str]:
    for pattern, material in before.corrections.items():
        _require(f"corrections.{pattern}", material, table)
        fits = [
            (object_id, index)
            for object_id, each in objects.items()
            for index, surface in enumerate(each.surfaces)
            if any(fnmatchcase(name, pattern) for name in lookup.names_of(surface.name))
        ]
        for object_id, index in fits:
            objects[object_id] = _corrected(objects[object_id], index, material, BY_PATTERN)
        if not fits:
            yield f"corrections.{pattern}"


def _correct_by_hand(
    objects: dict[str, BakedObject], before: Materials, table: Mapping[str, Material]
) -> Iterator[str]:
    things = Lookup(objects)
    for object_id, each in before.objects.items():
        for index, surface in enumerate(each.surfaces):
            if surface.by != BY_HAND:
                continue
            if surface.material is not None:
                _require(f"objects.{object_id}", surface.material, table)
            found = _again(things, object_id, each, index)
            if found is None:
                yield object_id if surface.name is None else f"{object_id} ({surface.name})"
                continue
            objects[found.object_id] = _corrected(
                objects[found.object_id], found.surface, surface.material, BY_HAND
            )


def _require(field: str, material: str, table: Mapping[str, Material]) -> None:
    if material not in table:
        raise UsageError(f"materials.json: {field}: {no_material(material, table)}")


def _again(things: Lookup, object_id: str, each: BakedObject, index: int) -> Found | None:
    """Return the surface of the new bake that this one is; None: it is gone."""
    surface = each.surfaces[index]
    primitive = surface.primitives[0] if surface.primitives else None
    found = things.find(
        Query(object_id, each.paths.get(lookup.AS_THE_SCENE, ()), surface.name, primitive, index)
    )
    if found is None or found.by == "material":
        return None
    surfaces = things.objects[found.object_id].surfaces
    is_counted = surface.name is None and primitive is None  # known by its index only
    if surfaces[found.surface].name != surface.name or (is_counted and found.surface != index):
        return None
    return found


def _surface(
    model: SceneModel, target: ObjectTarget, name: str | None, primitives: tuple[int, ...]
) -> BakedSurface:
    decision = model.decision(target, 1.0, limits_of(AT_REST))
    material, impact_gain = model.rendition(target).impact
    verdict = model.objects.state(target).verdict
    beliefs = {} if verdict is None else verdict.beliefs
    is_named = material == decision.material
    belief = decision.confidence if is_named else beliefs.get(material or "", 0.0)
    hum = model.hum(target)
    return BakedSurface(
        name=name,
        primitives=primitives,
        material=material,
        belief=round(belief, 3),
        by=decision.source,
        surface_c=round(decision.surface_c, 2),
        surface_by=decision.surface_source,
        impact_gain=impact_gain,
        thickness_m=model.swung_m(target),
        hum=None if hum is None else _hum(hum),
    )


def _hum(hum: Hum) -> BakedHum:
    drives = tuple(float(f"{drive:.6g}") for drive in Tone(hum).drives())
    return BakedHum(hum.frequency_hz, round(hum.level, 4), drives)


def _baked_object(model: SceneModel, object_id: str, node: SceneNode | None) -> BakedObject:
    facts = model.objects.facts(ObjectTarget(object_id))
    declared = (facts.surfaces if facts else None) or ()
    parts: list[tuple[str | None, tuple[int, ...]]] = [(each.name, ()) for each in declared]
    if node is not None:
        parts = [(each.name, each.primitives) for each in node.surfaces]
    surfaces = tuple(
        _surface(model, ObjectTarget(object_id, index), name, primitives)
        for index, (name, primitives) in enumerate(parts or [(None, ())])
    )
    if node is not None:
        return BakedObject(paths=dict(node.spelled), node=node.index, surfaces=surfaces)
    name = facts.name if facts else None
    return BakedObject(paths={lookup.AS_THE_SCENE: (name,)} if name else {}, surfaces=surfaces)


def _corrected(each: BakedObject, index: int, material: str | None, by: str) -> BakedObject:
    surfaces = list(each.surfaces)
    surfaces[index] = msgspec.structs.replace(
        surfaces[index], material=material, belief=1.0, by=by, impact_gain=1.0
    )
    return msgspec.structs.replace(each, surfaces=tuple(surfaces))


def _is_unknown(surface: BakedSurface) -> bool:
    return surface.material is None and surface.by != BY_HAND


def _defaulted(each: BakedObject, material: str) -> BakedObject:
    surfaces = tuple(
        msgspec.structs.replace(surface, material=material) if _is_unknown(surface) else surface
        for surface in each.surfaces
    )
    return msgspec.structs.replace(each, surfaces=surfaces)


def _unknown(objects: Mapping[str, BakedObject]) -> list[str]:
    """Return the sentence that names the surfaces on which nothing is felt, by their materials."""
    names = Counter(
        surface.name or object_id
        for object_id, each in objects.items()
        for surface in each.surfaces
        if _is_unknown(surface)
    )
    if not names:
        return []
    named = ", ".join(name for name, _ in names.most_common(_NAMED))
    more = f" and {len(names) - _NAMED} more" * (len(names) > _NAMED)
    return [
        f"materials: unknown of {names.total()} surfaces, which are not felt: {named}{more}; "
        f'write a `material` and "by": "{BY_HAND}", or a pattern of names under `corrections`, '
        "then bake again, or choose one for all with --unknown"
    ]
