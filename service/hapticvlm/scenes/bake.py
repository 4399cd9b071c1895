"""Bakes a scene: what each surface is, as `materials.json`, for players that have no service.

The verdicts are those of the session. What a person corrected in the file stays: a surface whose
`by` is `hand` keeps its material in the next bake. Pure.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import msgspec

from hapticvlm.errors import UsageError
from hapticvlm.evidence.ladder import Evidence
from hapticvlm.materials import Material, no_material
from hapticvlm.messages import Scene
from hapticvlm.rendering.heat.limits import AT_REST, limits_of
from hapticvlm.rendering.vibration import feel_tables
from hapticvlm.rendering.vibration.feel_tables import Feel
from hapticvlm.rendering.vibration.hum import Hum
from hapticvlm.scenes.scan import Look
from hapticvlm.scenes.scene import SceneNode
from hapticvlm.session.scene_model import SceneModel
from hapticvlm.session.settings import SessionSettings
from hapticvlm.session.targets import ObjectTarget
from hapticvlm.session.textures import MOST_SURFACES, Textures

VERSION = 1
BY_HAND = "hand"
NEEDS_SERVICE = (
    "heat: a plate needs its service; surface_c is what the service would render",
    "pictures: a surface whose picture changes keeps the material of the bake",
    "studies: `hapticvlm study` runs with the service only",
)
_NAMED = 8  # objects of one sentence; the others are counted


class BakedHum(msgspec.Struct, frozen=True):
    """The hum of a thing that runs: Hz, level 0..1, and the amplitude of each harmonic."""

    frequency_hz: float
    level: float
    drives: tuple[float, ...]


class BakedSurface(msgspec.Struct, frozen=True, omit_defaults=True):
    """One surface as it is felt; `material` is null where nothing is.

    `belief` (0..1) is in this material. `by` is the source of the verdict, or `hand`. `impact_gain`
    is below 1 where the material is doubtful. `thickness_m` is that of a swung object, if stated.
    """

    material: str | None
    belief: float
    by: str
    surface_c: float
    surface_by: str
    impact_gain: float = 1.0
    thickness_m: float | None = None
    hum: BakedHum | None = None


class BakedObject(msgspec.Struct, frozen=True, omit_defaults=True):
    """One object: its surfaces, the largest first, and its name if the scene gave one."""

    surfaces: tuple[BakedSurface, ...]
    name: str | None = None


class Materials(msgspec.Struct, frozen=True):
    """The file `materials.json`. `not_baked` has a sentence for each thing that is not in it."""

    version: int
    objects: dict[str, BakedObject]
    not_baked: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Bake:
    """Both files of a bake, and the ids of corrected objects that the scene no longer has."""

    materials: Materials
    feel: Feel
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


def bake(model: SceneModel, table: Mapping[str, Material], before: Materials | None = None) -> Bake:
    """Bake the scene of this model; corrections of `before` are kept.

    Raises UsageError for a correction whose material is not in the table.
    """
    known = {target.object_id for target in model.objects.known if isinstance(target, ObjectTarget)}
    corrections = {} if before is None else _corrections(before, table)
    objects = {
        object_id: _baked_object(model, object_id, corrections) for object_id in sorted(known)
    }
    felt = {one.material for each in objects.values() for one in each.surfaces}
    used = {name: table[name] for name in felt if name is not None}
    sentences = (*NEEDS_SERVICE, *feel_tables.left_out(used), *_unknown(objects))
    lost = tuple(
        object_id
        for object_id, index in corrections
        if object_id not in objects or index >= len(objects[object_id].surfaces)
    )
    return Bake(Materials(VERSION, objects, sentences), feel_tables.feel(used), lost)


def encode(materials: Materials) -> bytes:
    """Return the contents of `materials.json`."""
    return msgspec.json.format(msgspec.json.encode(materials), indent=1) + b"\n"


def decode(content: bytes) -> Materials:
    """Read `materials.json`. Raises UsageError."""
    try:
        materials = msgspec.json.decode(content, type=Materials)
    except msgspec.DecodeError as error:  # a ValidationError, too
        raise UsageError(
            f"materials.json: {error}; correct it, or remove it to bake without its corrections"
        ) from None
    if materials.version != VERSION:
        raise UsageError(
            f"materials.json: version {materials.version} is not {VERSION}; remove it, or bake "
            "into another folder"
        )
    return materials


def _corrections(
    before: Materials, table: Mapping[str, Material]
) -> dict[tuple[str, int], str | None]:
    """Return the material of each surface that a person corrected, by object and index."""
    corrections = {
        (object_id, index): surface.material
        for object_id, each in before.objects.items()
        for index, surface in enumerate(each.surfaces)
        if surface.by == BY_HAND
    }
    for (object_id, _), material in corrections.items():
        if material is not None and material not in table:
            raise UsageError(f"materials.json: objects.{object_id}: {no_material(material, table)}")
    return corrections


def _surface(model: SceneModel, target: ObjectTarget) -> BakedSurface:
    decision = model.decision(target, 1.0, limits_of(AT_REST))
    material, impact_gain = model.rendition(target).impact
    verdict = model.objects.state(target).verdict
    beliefs = {} if verdict is None else verdict.beliefs
    is_named = material == decision.material
    belief = decision.confidence if is_named else beliefs.get(material or "", 0.0)
    hum = model.hum(target)
    return BakedSurface(
        material,
        round(belief, 3),
        decision.source,
        round(decision.surface_c, 2),
        decision.surface_source,
        impact_gain,
        model.swung_m(target),
        None if hum is None else _hum(hum),
    )


def _hum(hum: Hum) -> BakedHum:
    return BakedHum(hum.frequency_hz, round(hum.level, 4), feel_tables.hum_drives(hum))


def _baked_object(
    model: SceneModel, object_id: str, corrections: Mapping[tuple[str, int], str | None]
) -> BakedObject:
    facts = model.objects.facts(ObjectTarget(object_id))
    count = max(1, len(facts.surfaces or ()) if facts else 1)
    surfaces = [_surface(model, ObjectTarget(object_id, index)) for index in range(count)]
    for index, surface in enumerate(surfaces):
        if (object_id, index) in corrections:
            surfaces[index] = _corrected(surface, corrections[object_id, index])
    return BakedObject(tuple(surfaces), facts.name if facts else None)


def _corrected(surface: BakedSurface, material: str | None) -> BakedSurface:
    return msgspec.structs.replace(
        surface, material=material, belief=1.0, by=BY_HAND, impact_gain=1.0
    )


def _unknown(objects: Mapping[str, BakedObject]) -> list[str]:
    """Return the sentence that names the objects on which nothing is felt."""
    ids = [
        object_id
        for object_id, each in objects.items()
        if all(surface.material is None and surface.by != BY_HAND for surface in each.surfaces)
    ]
    if not ids:
        return []
    named = ", ".join(ids[:_NAMED]) + (f" and {len(ids) - _NAMED} more" * (len(ids) > _NAMED))
    return [f'materials: unknown of {named}; write one and "by": "{BY_HAND}", then bake again']
