"""Declares a scene as a client would: the `scene` messages of the protocol, in pieces. Pure."""

from __future__ import annotations

from collections.abc import Iterator

import msgspec

from hapticvlm import messages
from hapticvlm.evidence import names
from hapticvlm.evidence.lexicon import Lexicon
from hapticvlm.messages import ObjectSurface, SceneObject
from hapticvlm.scenes.scene import Scene, SceneNode, Surface

# Objects of one message, and their bytes as JSON: half of what the service accepts as text, so that
# a client that writes JSON less tightly may send the same objects.
MAX_OBJECTS = 4096
MAX_BYTES = 512 * 1024
MAX_LABEL = 256  # characters of a name on the wire


def messages_of(scene: Scene, lexicon: Lexicon) -> Iterator[messages.Scene]:
    """Yield the messages that declare the scene; the first replaces what was declared before."""
    piece: list[SceneObject] = []
    size = 0
    number = 1
    for node in scene.objects:
        declared = object_of(node, lexicon)
        more = len(msgspec.json.encode(declared))
        if piece and (len(piece) == MAX_OBJECTS or size + more > MAX_BYTES):
            yield messages.Scene(id=number, objects=piece, replace=number == 1)
            piece, size, number = [], 0, number + 1
        piece.append(declared)
        size += more
    yield messages.Scene(id=number, objects=piece, replace=number == 1)


def object_of(node: SceneNode, lexicon: Lexicon, surface: int | None = None) -> SceneObject:
    """Return the declaration of an object, or of one of its surfaces as if it had no other."""
    surfaces = node.surfaces if surface is None else (node.surfaces[surface],)
    return SceneObject(
        object_id=node.object_id,
        name=node.name[-MAX_LABEL:],
        material=node.material,
        surfaces=[
            ObjectSurface(
                name=surface_name(each, lexicon), shader=each.shader, material=each.material
            )
            for each in surfaces
        ],
    )


def surface_name(surface: Surface, lexicon: Lexicon) -> str | None:
    """Return the name that tells most: the material's, or the texture's where that says nothing."""
    texture = surface.texture.name if surface.texture else None
    if texture and (not surface.name or names.read(surface.name, lexicon) is None):
        says_something = names.read(texture, lexicon) is not None
        return (texture if says_something or not surface.name else surface.name)[-MAX_LABEL:]
    return surface.name and surface.name[-MAX_LABEL:]
