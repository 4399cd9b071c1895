"""Declares the parts of a glTF 2.0 document that name objects, materials and their data.

glTF is JSON with indices into its own lists (github.com/KhronosGroup/glTF, specification 2.0).
msgspec decodes it and checks its types; everything that is not declared here is skipped unread. An
index may still point nowhere, which `reading.py` checks where it follows one.
"""

from __future__ import annotations

from typing import Annotated

import msgspec
from msgspec import Meta, Struct

from hapticvlm import documents
from hapticvlm.scenes.scene import SceneError

# Each comma or brace of the text becomes at most one value in memory. Real scenes of 50 MB have a
# tenth of this; without a limit, a text of 100 MB becomes gigabytes.
MAX_VALUES = 5_000_000

Index = Annotated[int, Meta(ge=0)]
Count = Annotated[int, Meta(ge=0)]


class _Part(Struct, frozen=True, gc=False):
    """Base of all parts; unknown fields are ignored, as the specification demands."""


class TextureRef(_Part, frozen=True):
    """A material's reference to a texture."""

    index: Index


class Pbr(_Part, frozen=True, rename="camel"):
    """Metallic-roughness parameters; an absent factor is 1 by the specification."""

    base_color_factor: tuple[float, float, float, float] = (1.0, 1.0, 1.0, 1.0)
    metallic_factor: float = 1.0
    roughness_factor: float = 1.0
    base_color_texture: TextureRef | None = None
    metallic_roughness_texture: TextureRef | None = None


class Transmission(_Part, frozen=True, rename="camel"):
    """KHR_materials_transmission."""

    transmission_factor: float = 0.0


class SpecularGlossiness(_Part, frozen=True, rename="camel"):
    """KHR_materials_pbrSpecularGlossiness: the older parameters, without a metallic one."""

    diffuse_factor: tuple[float, float, float, float] = (1.0, 1.0, 1.0, 1.0)
    glossiness_factor: float = 1.0
    diffuse_texture: TextureRef | None = None


class MaterialExtensions(_Part, frozen=True):
    """Extensions of a material."""

    transmission: Transmission | None = msgspec.field(
        name="KHR_materials_transmission", default=None
    )
    glossiness: SpecularGlossiness | None = msgspec.field(
        name="KHR_materials_pbrSpecularGlossiness", default=None
    )


class Material(_Part, frozen=True, rename="camel"):
    """A material."""

    name: str | None = None
    pbr_metallic_roughness: Pbr = Pbr()
    alpha_mode: str = "OPAQUE"
    extensions: MaterialExtensions = MaterialExtensions()
    extras: msgspec.Raw = msgspec.Raw()


class Source(_Part, frozen=True):
    """An extension that gives a texture a picture of another format."""

    source: Index | None = None


class TextureExtensions(_Part, frozen=True):
    """Extensions of a texture."""

    basisu: Source | None = msgspec.field(name="KHR_texture_basisu", default=None)
    webp: Source | None = msgspec.field(name="EXT_texture_webp", default=None)
    avif: Source | None = msgspec.field(name="EXT_texture_avif", default=None)
    dds: Source | None = msgspec.field(name="MSFT_texture_dds", default=None)


class Texture(_Part, frozen=True):
    """A texture: a picture and how it is sampled."""

    name: str | None = None
    source: Index | None = None
    extensions: TextureExtensions = TextureExtensions()


class Image(_Part, frozen=True, rename="camel"):
    """A picture, in a file, in the text itself or in a buffer."""

    name: str | None = None
    uri: str | None = None
    mime_type: str | None = None
    buffer_view: Index | None = None


class Compressed(_Part, frozen=True):
    """The mark of compressed data, whose fields are not read."""


class PrimitiveExtensions(_Part, frozen=True):
    """Extensions of a primitive."""

    draco: Compressed | None = msgspec.field(name="KHR_draco_mesh_compression", default=None)


class Attributes(_Part, frozen=True):
    """The vertex data of a primitive."""

    position: Index | None = msgspec.field(name="POSITION", default=None)


class Primitive(_Part, frozen=True):
    """A part of a mesh with one material. Mode 4 is triangles, 5 a strip of them, 6 a fan."""

    attributes: Attributes = Attributes()
    indices: Index | None = None
    material: Index | None = None
    mode: Annotated[int, Meta(ge=0, le=6)] = 4
    extensions: PrimitiveExtensions = PrimitiveExtensions()


class Mesh(_Part, frozen=True):
    """A mesh: one or more primitives."""

    primitives: list[Primitive]
    name: str | None = None


class Levels(_Part, frozen=True):
    """MSFT_lod: the nodes that stand for this one where less detail is drawn."""

    ids: list[Index] = []


class NodeExtensions(_Part, frozen=True):
    """Extensions of a node."""

    lod: Levels = msgspec.field(name="MSFT_lod", default=Levels())


class Node(_Part, frozen=True):
    """A node of the tree."""

    name: str | None = None
    mesh: Index | None = None
    children: list[Index] = []
    extensions: NodeExtensions = NodeExtensions()
    extras: msgspec.Raw = msgspec.Raw()


class Roots(_Part, frozen=True):
    """A scene of the document: the indices of its root nodes."""

    nodes: list[Index] = []
    name: str | None = None


class Accessor(_Part, frozen=True, rename="camel"):
    """A typed list in a buffer view."""

    component_type: int
    count: Count
    type: str
    buffer_view: Index | None = None
    byte_offset: Count = 0


class ViewExtensions(_Part, frozen=True):
    """Extensions of a buffer view."""

    meshopt: Compressed | None = msgspec.field(name="EXT_meshopt_compression", default=None)
    khr_meshopt: Compressed | None = msgspec.field(name="KHR_meshopt_compression", default=None)

    @property
    def is_compressed(self) -> bool:
        """Whether the view's bytes must be decoded first."""
        return self.meshopt is not None or self.khr_meshopt is not None


class BufferView(_Part, frozen=True, rename="camel"):
    """A range of a buffer."""

    buffer: Index
    byte_length: Count
    byte_offset: Count = 0
    byte_stride: Annotated[int, Meta(ge=1)] | None = None
    extensions: ViewExtensions = ViewExtensions()


class Buffer(_Part, frozen=True):
    """A file, or the second part of a .glb."""

    uri: str | None = None


class Document(_Part, frozen=True, rename="camel"):
    """The parts of a document that a scene is read from."""

    scene: Index | None = None
    scenes: list[Roots] = []
    nodes: list[Node] = []
    meshes: list[Mesh] = []
    materials: list[Material] = []
    textures: list[Texture] = []
    images: list[Image] = []
    accessors: list[Accessor] = []
    buffer_views: list[BufferView] = []
    buffers: list[Buffer] = []
    extensions_used: list[str] = []


class _Stated(_Part, frozen=True):
    haptic_material: str | None = None


class _Asset(_Part, frozen=True):
    version: str | None = None


class _Versioned(_Part, frozen=True):
    asset: _Asset


def stated_material(extras: msgspec.Raw) -> str | None:
    """Return the material that extras state as `haptic_material`; extras may be any JSON."""
    try:
        stated = msgspec.json.decode(extras, type=_Stated).haptic_material
    except msgspec.DecodeError:  # none, or of another shape
        return None
    return stated or None


def parse(content: bytes) -> Document:
    """Parse the JSON of a glTF file. Raises SceneError."""
    content = content.removeprefix(b"\xef\xbb\xbf")
    if content.count(b",") + content.count(b"{") > MAX_VALUES:
        raise SceneError(f"more than {MAX_VALUES} values, the limit; split the scene")
    try:
        version = msgspec.json.decode(content, type=_Versioned).asset.version or ""
        if not version.startswith("2."):
            raise SceneError(
                f"glTF version `{version[:20]}`, and only 2 is read; export it again as glTF 2.0"
            )
        # Not strict: exporters write whole numbers as 1.0, which is valid JSON for an index.
        return msgspec.json.decode(content, type=Document, strict=False)
    except msgspec.ValidationError as error:
        raise SceneError(f"not a valid glTF 2.0 file: {error}; export it again") from None
    except (msgspec.DecodeError, ValueError, RecursionError) as error:
        reason = documents.reason(error)
        raise SceneError(f"not a glTF file: {reason}; give a .gltf or .glb file") from None
