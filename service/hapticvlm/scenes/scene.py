"""Defines a scene as a file describes it: objects, their surfaces and their textures. Frozen.

A glTF primitive, a Unity sub-mesh and a Godot surface are all a `Surface` here. Names are those of
the file, unchanged, because they are evidence. Missing is None.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

from hapticvlm.errors import HapticVLMError
from hapticvlm.messages import Shader


class SceneError(HapticVLMError):
    """A scene's file, or one of its parts, cannot be read; the message says why and what to do."""


@dataclass(frozen=True, slots=True)
class Texture:
    """A base-colour map. `name` is its file's name, or the name that the scene gives it.

    `read` returns the encoded picture (JPEG, PNG or WebP) each time from the file, and keeps
    nothing. It raises SceneError if the picture is missing, too large or of another format.
    """

    name: str | None
    read: Callable[[], bytes] = field(compare=False, repr=False)


@dataclass(frozen=True, slots=True)
class Surface:
    """A part of an object with one material. `name` is the material's; None: it has none.

    `triangles` is their count. Several objects of the same mesh share their surfaces. `primitives`
    are those of the mesh that have this material, and `material` the one that the file states.
    """

    name: str | None
    shader: Shader | None
    texture: Texture | None
    triangles: int
    primitives: tuple[int, ...] = ()
    material: str | None = None

    @property
    def label(self) -> str | None:
        """The name that says what it is made of: the material's, else the texture's."""
        return self.name or (self.texture.name if self.texture else None)


@dataclass(frozen=True, slots=True)
class SceneNode:
    """An object that can be touched.

    `object_id` is unique in its scene and has at most 128 characters, as the protocol demands.
    `path` has the names of its nearest parents, outermost first, and its own last. `surfaces` are
    ordered by area, the largest first; there is at least one. `spelled` are the paths of its names
    as engines spell them, `index` its node in the file, and `material` what the file states.
    """

    object_id: str
    path: tuple[str, ...]
    surfaces: tuple[Surface, ...]
    spelled: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    index: int | None = None
    material: str | None = None

    @property
    def name(self) -> str:
        """Its name behind those of its parents, as the protocol has it: Rifle/Magazine."""
        return "/".join(self.path)


@dataclass(frozen=True, slots=True)
class Scene:
    """The objects of one file, in the file's order.

    `notes` say in a sentence each which parts of the file could not be read, and what that means.
    """

    objects: tuple[SceneNode, ...]
    notes: tuple[str, ...] = ()
