"""What each role may say of a scene: who describes it, who sets what, what it may state. Pure.

An observer describes no scene of its own. On this machine it may state materials of objects that
the owner's scene already has; everything else about them stays as the scene gave it.
"""

from __future__ import annotations

from collections.abc import Callable

import msgspec

from hapticvlm.messages import Frame, MessageError, Scene, SceneObject, Set

Facts = Callable[[str], SceneObject | None]


def check_describes(message: Frame | Scene, *, observer: bool) -> None:
    """Refuse a frame or a scene of an observer. Raises MessageError."""
    if not observer:
        return
    what = "send no frames" if isinstance(message, Frame) else "describe no scene"
    text = f"observers {what}; connect with role scene"
    raise MessageError("protocol", text, path="$.type", id=message.id)


def check_set(wanted: Set, *, owner: bool, observer: bool) -> None:
    """Refuse settings that are not this connection's. Raises MessageError."""
    if wanted.watch is not None and not observer:
        text = "$.watch: only observers watch; connect with role observer"
        raise MessageError("protocol", text, path="$.watch", id=wanted.id)
    if wanted.ambient_c is not None and observer:
        text = "$.ambient_c: observers have no scene; connect with role scene"
        raise MessageError("protocol", text, path="$.ambient_c", id=wanted.id)
    if not owner and wanted.feel is not None:
        text = "$.feel: another scene owns the outputs; only their owner gets vibration events"
        raise MessageError("not_owner", text, path="$.feel", id=wanted.id)
    if not owner and (wanted.vibration_gain, wanted.thermal_gain) != (None, None):
        text = "another scene owns the outputs; only their owner sets gains"
        raise MessageError("not_owner", text, path="$", id=wanted.id)


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


def _check(scene: Scene) -> None:
    only = "an observer states materials only"
    if scene.replace:
        raise _refused(scene, f"{only}: send `replace` false", "$.replace")
    if scene.forget is not None:
        raise _refused(scene, f"{only}: leave out forget", "$.forget")
    if scene.ambient_c is not None or scene.materials is not None:
        raise _refused(scene, f"{only}: leave out ambient_c and materials", "$")
    for index, given in enumerate(scene.objects):
        bare = SceneObject(object_id=given.object_id, material=given.material)
        if given != bare or given.material is None:
            text = f"{only}: send `object_id` and `material` and nothing else"
            raise _refused(scene, text, f"$.objects[{index}]")


def _refused(scene: Scene, text: str, path: str) -> MessageError:
    return MessageError("message", f"{path}: {text}", path=path, id=scene.id)
