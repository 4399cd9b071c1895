"""Materials that a person set by hand, of objects whose material the scene does not state. Pure.

There are two kinds. *Saved* ones come from an earlier run, by object id, from a file. *Stated* ones
come from an observer on the service's own machine (the dashboard), of objects that the owner's
scene already has; everything else about these objects stays as the scene gave it. Stated ones end
with the scene: a scene that replaces all its objects clears them.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field

import msgspec

from hapticvlm.materials import UNKNOWN
from hapticvlm.messages import MessageError, Scene, SceneObject
from hapticvlm.session.targets import ObjectTarget, Target

Facts = Callable[[str], SceneObject | None]


@dataclass(frozen=True, slots=True)
class MaterialOverrides:
    """Materials by object id: saved in an earlier run, and stated in this scene."""

    saved: Mapping[str, str] = field(default_factory=dict)
    stated: Mapping[str, str] = field(default_factory=dict)

    @property
    def by_object(self) -> dict[str, str]:
        """All overrides, as they are saved for the next run: the newest one of each object."""
        return {**self.saved, **self.stated}

    def with_stated(self, objects: Iterable[SceneObject]) -> MaterialOverrides:
        """Return the overrides with those that an observer states of these objects."""
        newest = {each.object_id: each.material for each in objects if each.material}
        return MaterialOverrides(self.saved, {**self.stated, **newest})

    def without_stated(self) -> MaterialOverrides:
        """Return the overrides of a scene that has just replaced all its objects."""
        return MaterialOverrides(self.saved)

    def applied_to(self, facts: SceneObject) -> SceneObject:
        """Return a declared object, with its saved material where the scene states none."""
        material = self.saved.get(facts.object_id)
        if material is None or facts.material not in (None, UNKNOWN):
            return facts
        return msgspec.structs.replace(facts, material=material)

    def facts(self, target: Target) -> SceneObject | None:
        """Return an object that the scene has not declared, if its material was saved."""
        if not isinstance(target, ObjectTarget) or target.object_id not in self.saved:
            return None
        return SceneObject(object_id=target.object_id, material=self.saved[target.object_id])


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
        objects.append(msgspec.structs.replace(known, material=stated.material))
    return msgspec.structs.replace(scene, objects=objects)


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
        bare = SceneObject(object_id=stated.object_id, material=stated.material)
        if stated != bare or stated.material is None:
            text = f"{only}: send `object_id` and `material` and nothing else"
            raise _refused(scene, text, f"$.objects[{index}]")


def _refused(scene: Scene, text: str, path: str) -> MessageError:
    return MessageError("message", f"{path}: {text}", path=path, id=scene.id)
