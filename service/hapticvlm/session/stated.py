"""What a person at the dashboard may state of the owner's scene: its objects' materials. Pure.

An observer describes no scene of its own. On this machine it may state materials of objects that
the owner's scene already has; everything else about them stays as the scene gave it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

import msgspec

from hapticvlm.materials import UNKNOWN
from hapticvlm.messages import MessageError, Scene, SceneObject

Facts = Callable[[str], SceneObject | None]
NONE_SAVED: Mapping[str, str] = {}


def with_materials(scene: Scene, facts: Facts) -> Scene:
    """Return the scene as its owner would send it: known objects with these materials.

    `facts` gives what is known of an object, None of one that is not. Raises MessageError.
    """
    _check(scene)
    objects = []
    for index, given in enumerate(scene.objects):
        known = facts(given.object_id)
        if known is None:
            text = f"the owner's scene has no object `{given.object_id}`: state one that it has"
            raise _refused(scene, text, f"$.objects[{index}].object_id")
        objects.append(msgspec.structs.replace(known, material=given.material))
    return msgspec.structs.replace(scene, objects=objects)


def with_saved(given: SceneObject, saved: Mapping[str, str]) -> SceneObject:
    """Return what the scene gives of an object, with its saved material where it gives none."""
    material = saved.get(given.object_id)
    if material is None or given.material not in (None, UNKNOWN):
        return given
    return msgspec.structs.replace(given, material=material)


def saved_facts(key: object, saved: Mapping[str, str]) -> SceneObject | None:
    """Return what was saved of an object that the scene has not declared, if anything was."""
    if not isinstance(key, str) or key not in saved:
        return None
    return SceneObject(object_id=key, material=saved[key])


def _check(scene: Scene) -> None:
    only = "an observer states materials only"
    if scene.replace:
        raise _refused(scene, f"{only}: send `replace` false", "$.replace")
    if scene.ambient_c is not None or scene.materials is not None:
        raise _refused(scene, f"{only}: leave out ambient_c and materials", "$")
    for index, given in enumerate(scene.objects):
        bare = SceneObject(object_id=given.object_id, material=given.material)
        if given != bare or given.material is None:
            text = f"{only}: send `object_id` and `material` and nothing else"
            raise _refused(scene, text, f"$.objects[{index}]")


def _refused(scene: Scene, text: str, path: str) -> MessageError:
    return MessageError("message", f"{path}: {text}", path=path, id=scene.id)
