"""The targets of recognition, which are also the keys of everything known of a scene.

A client names most objects, and which of an object's surfaces it means. An object that it does not
name is either under a hand (`HandRegion`: another object at every contact) or in the middle of a
frame without an object id (`WholeView`, which may show several objects). The frame as a whole is
recognised for its `Surroundings`, which are not an object. A texture map is read for all surfaces
that have it.

Targets are msgspec structs because they are the keys of the hottest dictionaries: a renewal of a
lease looks one up some four times, and these hash and compare without running Python.
"""

from __future__ import annotations

from dataclasses import dataclass

import msgspec

from hapticvlm.messages import Frame, HandName


class ObjectTarget(msgspec.Struct, frozen=True, gc=False):
    """A surface of an object: the id that its client gave it, and an index into its `surfaces`.

    0 is the largest, which stands for the whole object wherever no surface is named.
    """

    object_id: str
    surface: int = 0


class HandRegion(msgspec.Struct, frozen=True, gc=False):
    """The region that this hand touches in the newest frame."""

    hand: HandName


class WholeView(msgspec.Struct, frozen=True, gc=False):
    """The content of a frame without an object id: each recognition of it stands alone."""


class Surroundings(msgspec.Struct, frozen=True, gc=False):
    """The scene as a whole, for its temperature; never an object."""


class TextureTarget(msgspec.Struct, frozen=True, gc=False):
    """A texture map, by the hash that the scene states; any number of surfaces have it."""

    texture: str


ThingTarget = ObjectTarget | HandRegion | WholeView  # what a decision can be on
Target = ThingTarget | Surroundings | TextureTarget
WHOLE_VIEW = WholeView()
SURROUNDINGS = Surroundings()


@dataclass(frozen=True, slots=True)
class RequestId:
    """The id of a client's message that waits for an answer, at least 1."""

    value: int


@dataclass(frozen=True, slots=True)
class RecognitionRequest:
    """Recognise `target` in `picture`, and answer the message `reply_to`; None: no message waits.

    `picture` is the frame as it came, with the region and mask to recognise; its own id is not
    used. `generation` is that of the target, so that an answer for a scene or a contact since
    replaced is dropped. `number` is given by a recorded session, `scene` numbers the scene,
    `reference_material` is the material of an object that is sure: then the picture is only kept as
    a reference for the other objects of its scene.
    """

    target: Target
    picture: Frame
    reply_to: RequestId | None
    generation: int = 0
    number: int = 0
    scene: int = 0
    reference_material: str | None = None


def of_object(object_id: str | None, surface: int = 0) -> ObjectTarget | WholeView:
    """Return the target of a frame that names this surface of an object, or no object."""
    return WHOLE_VIEW if object_id is None else ObjectTarget(object_id, surface)


def whole(target: ThingTarget) -> ThingTarget:
    """Return the target that stands for the whole object that this one is a surface of."""
    if isinstance(target, ObjectTarget) and target.surface:
        return ObjectTarget(target.object_id)
    return target


def name_of(target: Target) -> str:
    """Return a short text for this target, for logs and to notice an unchanged picture."""
    match target:
        case ObjectTarget(object_id, 0):
            return f"object {object_id}"
        case ObjectTarget(object_id, surface):
            return f"object {object_id}, surface {surface}"
        case HandRegion(hand):
            return f"{hand} hand"
        case WholeView():
            return "whole view"
        case Surroundings():
            return "surroundings"
        case TextureTarget(texture):
            return f"texture {texture}"
