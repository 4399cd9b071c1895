"""What the scene gives of one object: its facts, a material saved before, and their evidence. Pure.

A key is what an object goes by: its id where it is text.
"""

from __future__ import annotations

from collections.abc import Mapping

import msgspec

from hapticvlm.evidence import ladder, names, shader
from hapticvlm.evidence.ladder import Evidence
from hapticvlm.evidence.names import Lexicon
from hapticvlm.materials import UNKNOWN
from hapticvlm.messages import SceneObject
from hapticvlm.session.targets import ObjectTarget, Target

NONE_SAVED: Mapping[str, str] = {}


def with_saved(given: SceneObject, saved: Mapping[str, str]) -> SceneObject:
    """Return what the scene gives of an object, with its saved material where it gives none."""
    material = saved.get(given.object_id)
    if material is None or given.material not in (None, UNKNOWN):
        return given
    return msgspec.structs.replace(given, material=material)


def saved_facts(target: Target, saved: Mapping[str, str]) -> SceneObject | None:
    """Return what was saved of an object that the scene has not declared, if anything was."""
    if not isinstance(target, ObjectTarget) or target.object_id not in saved:
        return None
    return SceneObject(object_id=target.object_id, material=saved[target.object_id])


def from_declaration(
    target: Target, facts: SceneObject | None, lexicon: Lexicon
) -> tuple[Evidence, ...]:
    """Climb the rungs that need no picture and stop at the first that is sure."""
    if facts and facts.material and facts.material != UNKNOWN:
        return (Evidence("scene", ((facts.material, 1.0),)),)
    found: list[Evidence] = []
    name = name_of(target, facts)
    named = names.from_name(name, lexicon) if name else None
    if named:
        found.append(named)
    if facts and facts.shader and not ladder.is_sure(found):
        stated = facts.shader
        shaded = shader.from_shader(
            stated.metallic, stated.roughness, stated.transmission, stated.base_color
        )
        if shaded:
            found.append(shaded)
    return tuple(found)


def name_of(target: Target, facts: SceneObject | None) -> str | None:
    """Return the name an object goes by: the one given, else its id."""
    return (facts.name if facts else None) or (
        target.object_id if isinstance(target, ObjectTarget) else None
    )
