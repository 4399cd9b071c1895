"""Materials that a person set by hand, of objects whose material the scene does not state. Pure.

There are two kinds. *Saved* ones come from an earlier run, by object id, from a file. *Stated* ones
come from an observer on the service's own machine (the dashboard), of objects that the owner's
scene already has; everything else about these objects stays as the scene gave it. Stated ones end
with the scene: a scene that replaces all its objects clears them.

An override is an object that states nothing but materials: of the whole object, or of some of its
surfaces.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from itertools import zip_longest

import msgspec

from hapticvlm.materials import UNKNOWN
from hapticvlm.messages import MessageError, ObjectSurface, Scene, SceneObject
from hapticvlm.session.targets import ObjectTarget, Target

Facts = Callable[[str], SceneObject | None]
NOTHING = ObjectSurface()


@dataclass(frozen=True, slots=True)
class MaterialOverrides:
    """Overrides by object id: saved in an earlier run, and stated in this scene."""

    saved: Mapping[str, SceneObject] = field(default_factory=dict)
    stated: Mapping[str, SceneObject] = field(default_factory=dict)

    @property
    def by_object(self) -> dict[str, SceneObject]:
        """All overrides, as they are saved for the next run: the newest one of each surface."""
        return {**self.saved, **_merged(self.saved, self.stated)}

    def with_stated(self, objects: Iterable[SceneObject]) -> MaterialOverrides:
        """Return the overrides with those that an observer states of these objects."""
        newest = {each.object_id: each for each in objects}
        return MaterialOverrides(self.saved, {**self.stated, **_merged(self.stated, newest)})

    def without_stated(self) -> MaterialOverrides:
        """Return the overrides of a scene that has just replaced all its objects."""
        return MaterialOverrides(self.saved)

    def applied_to(self, facts: SceneObject) -> SceneObject:
        """Return a declared object, with its saved materials where the scene states none."""
        saved = self.saved.get(facts.object_id)
        if saved is None or facts.material not in (None, UNKNOWN):
            return facts
        pairs = zip(facts.surfaces or (), _surfaces(saved), strict=False)
        chosen = [own if own.material else _with(own, other.material) for own, other in pairs]
        return msgspec.structs.replace(
            facts,
            material=saved.material or facts.material,
            surfaces=facts.surfaces and [*chosen, *facts.surfaces[len(chosen) :]],
        )

    def facts(self, target: Target) -> SceneObject | None:
        """Return an object that the scene has not declared, if its material was saved."""
        saved = self.saved.get(target.object_id) if isinstance(target, ObjectTarget) else None
        if saved is None or saved.material is None:
            return None
        return SceneObject(object_id=saved.object_id, material=saved.material)


def materials_only(facts: SceneObject) -> SceneObject:
    """Return what an object states of materials, and nothing else."""
    surfaces = [ObjectSurface(material=surface.material) for surface in facts.surfaces or ()]
    return SceneObject(
        object_id=facts.object_id, material=facts.material, surfaces=surfaces or None
    )


def materials_of(override: SceneObject) -> dict[str, str]:
    """Return the materials that an override states, by the path of their field in it."""
    surfaces = {
        f".surfaces[{index}].material": surface.material
        for index, surface in enumerate(override.surfaces or ())
    }
    stated = {".material": override.material, **surfaces}
    return {path: material for path, material in stated.items() if material}


def with_materials(scene: Scene, facts: Facts) -> Scene:
    """Return an observer's scene as the owner would send it: known objects, other materials.

    `facts` gives all that is known of an object; None: it is not in the scene. Raises MessageError.
    """
    _check(scene)
    objects = []
    for index, stated in enumerate(scene.objects):
        known = facts(stated.object_id)
        if known is None:
            text = f"the owner's scene has no object `{stated.object_id}`: state one that it has"
            raise _refused(scene, text, f"$.objects[{index}].object_id")
        count = len(known.surfaces or ())
        if len(_surfaces(stated)) > count:
            text = f"the object has {count} surfaces: state materials of these"
            raise _refused(scene, text, f"$.objects[{index}].surfaces")
        objects.append(_laid_over(known, stated))
    return msgspec.structs.replace(scene, objects=objects)


def _laid_over(facts: SceneObject, override: SceneObject) -> SceneObject:
    """Return the object with the materials of an override.

    A material of the whole object replaces those of its surfaces.
    """
    surfaces = _surfaces(facts)
    if override.material is not None:
        surfaces = [_with(surface, None) for surface in surfaces]
    pairs = zip_longest(surfaces, _surfaces(override), fillvalue=NOTHING)
    chosen = [_with(own, other.material) if other.material else own for own, other in pairs]
    return msgspec.structs.replace(
        facts, material=override.material or facts.material, surfaces=chosen or facts.surfaces
    )


def _merged(
    earlier: Mapping[str, SceneObject], newest: Mapping[str, SceneObject]
) -> dict[str, SceneObject]:
    """Return the newest overrides, with what earlier ones of the same objects say beside them."""
    return {
        object_id: _laid_over(earlier.get(object_id, SceneObject(object_id=object_id)), override)
        for object_id, override in newest.items()
    }


def _surfaces(facts: SceneObject) -> list[ObjectSurface]:
    return facts.surfaces or []


def _with(surface: ObjectSurface, material: str | None) -> ObjectSurface:
    return msgspec.structs.replace(surface, material=material)


def _check(scene: Scene) -> None:
    """Refuse a scene that says more than materials."""
    only = "an observer states materials only"
    if scene.replace:
        raise _refused(scene, f"{only}: send `replace` false", "$.replace")
    if scene.forget is not None:
        raise _refused(scene, f"{only}: leave out forget", "$.forget")
    if scene.ambient_c is not None or scene.materials is not None:
        raise _refused(scene, f"{only}: leave out ambient_c and materials", "$")
    for index, stated in enumerate(scene.objects):
        if stated != materials_only(stated) or not materials_of(stated):
            text = f"{only}: send `object_id` and `material`, of the object or of its surfaces"
            raise _refused(scene, text, f"$.objects[{index}]")


def _refused(scene: Scene, text: str, path: str) -> MessageError:
    return MessageError("message", f"{path}: {text}", path=path, id=scene.id)
