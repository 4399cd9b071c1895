"""Reads a glTF file as a `Scene`: its tree of nodes, the surfaces of their meshes, materials.

What is broken raises SceneError. What is valid but cannot be read (compressed geometry, missing
buffers) is said in a note of the scene: names and shaders are still there.

All primitives of a mesh that have the same material are one surface, as in engines. Surfaces are
ordered by area, because a touch that names no surface feels the largest. The area is
that of the mesh, without the node's scale, and is only computed where a mesh has several surfaces;
where its data cannot be read, the count of triangles stands for it.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any, TypeVar
from urllib.parse import unquote

import msgspec
import numpy as np
from numpy.typing import NDArray

from hapticvlm.errors import printable
from hapticvlm.evidence import names
from hapticvlm.evidence.ladder import is_sure
from hapticvlm.evidence.names import MAX_PARENTS
from hapticvlm.materials import MATERIALS, Material, no_material
from hapticvlm.messages import WHOLE, Shader
from hapticvlm.scenes import gltf
from hapticvlm.scenes.files import SceneFiles
from hapticvlm.scenes.scene import Scene, SceneError, SceneNode, Surface, Texture
from hapticvlm.scenes.spellings import spellings
from hapticvlm.vision.files import FileError, decode_frame
from hapticvlm.vision.pictures import PictureError, cut_region

MAX_OBJECTS = 8192  # as many as the service knows of one scene
MAX_SURFACES = 64  # of one object, as in the protocol
MAX_IN_ALL = 32_768  # surfaces of all objects together
MAX_ID = 128  # characters, as in the protocol
MAP_PX = 64  # side to which a metallic-roughness map is shrunk before its mean is taken
MAX_NAME = 200  # characters of one name that are kept

T = TypeVar("T")
Look = tuple[str | None, Shader | None, Texture | None, str | None]

_TRIANGLES, _STRIP, _FAN = 4, 5, 6
_AT_ONCE = 1 << 18  # triangles whose area is computed together: 30 MB
_DTYPES = {5120: "<i1", 5121: "<u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
_WIDTHS = {"SCALAR": 1, "VEC3": 3}
_UNREADABLE = {"image/ktx2": "KTX2", "image/vnd-ms.dds": "DDS"}


def read_scene(
    path: Path, root: Path | None = None, table: Mapping[str, Material] = MATERIALS
) -> Scene:
    """Read a .gltf or .glb file. Raises SceneError, which names the file.

    Buffers and textures are only read below `root`; default: the folder of the file. `table` has
    the materials that `extras.haptic_material` may state.
    """
    try:
        return _Reader(SceneFiles(path, root or path.parent), table).scene()
    except SceneError as error:
        raise SceneError(f"{path}: {error}") from None


class _Reader:
    """The state of reading one file; every mesh, material and texture is read once."""

    def __init__(self, files: SceneFiles, table: Mapping[str, Material]) -> None:
        self._files = files
        self._table = table
        self._document = files.document()
        self._spelled = spellings(self._document)
        self._surfaces: dict[int, tuple[Surface, ...]] = {}
        self._materials: dict[int, Look] = {}
        self._means: dict[int, tuple[float, float] | None] = {}  # of metallic-roughness maps
        self._unstated: dict[str, None] = {}  # materials that the file states and nobody knows
        self._unordered: Counter[str] = Counter()  # meshes by the reason why areas are not known
        self._notes: list[str] = []

    def scene(self) -> Scene:
        """Walk the tree from its roots; each node counts once, however often it is reached.

        A lower level of detail is felt as its original, and what is below it as itself where
        something is below the original, too.
        """
        nodes = self._document.nodes
        visited = bytearray(len(nodes))
        lower = {level: at for at, levels in self._spelled.lower.items() for level in levels}
        apart = self._apart()
        objects: list[SceneNode] = []
        ids: Counter[str] = Counter()
        repeated = left_out = in_all = 0
        waiting: list[tuple[int, tuple[str, ...]]] = [(i, ()) for i in reversed(self._roots())]
        while waiting:
            index, parents = waiting.pop()
            node = _at(nodes, index, "node")
            if visited[index]:
                repeated += 1
                continue
            visited[index] = 1
            own = _clean(node.name)
            surfaces = () if index in lower else self._of_mesh(node.mesh)
            if len(objects) == MAX_OBJECTS or in_all + len(surfaces) > MAX_IN_ALL:
                left_out += bool(surfaces)
            elif surfaces:
                path = (*parents, own or self._mesh_name(node, index))
                spelled = self._spelled.paths(index)
                stated = self._stated(node.extras)
                objects.append(
                    SceneNode(_unique(path, ids), path, surfaces, spelled, index, stated)
                )
                in_all += len(surfaces)
            levels = apart.intersection(node.extensions.lod.ids)
            waiting += [(level, parents) for level in sorted(levels, reverse=True)]
            apart -= levels
            below = (*parents, own)[-MAX_PARENTS:] if own else parents
            if index not in lower or nodes[lower[index]].children:
                waiting += [(child, below) for child in reversed(node.children)]
        self._notes += self._notes_of_all(repeated, left_out)
        return Scene(tuple(objects), tuple(self._notes))

    def _notes_of_all(self, repeated: int, left_out: int) -> Iterator[str]:
        if repeated:
            yield f"{repeated} nodes have several parents or are below themselves; each counts once"
        if left_out:
            yield (
                f"{left_out} objects were left out: a scene has at most {MAX_OBJECTS} objects with "
                f"{MAX_IN_ALL} surfaces"
            )
        for reason, count in self._unordered.items():
            yield (
                f"the surfaces of {count} of the meshes are ordered by triangles, not by area: "
                f"{reason}; clients find them by their materials' names"
            )
        scenes = len(self._document.scenes)
        if scenes > 1:
            yield f"{scenes} scenes, of which the default one is read; save the others as files"
        if "KHR_materials_variants" in self._document.extensions_used:
            yield "variants of materials are not read: each surface has its default material"
        nameless = sum(material.name is None for material in self._document.materials)
        if nameless:
            yield (
                f"{nameless} materials have no name, by which clients find surfaces; name them, or "
                "keep names when the file is compressed (gltfpack -km -kn)"
            )
        for stated in self._unstated:
            yield f"extras.haptic_material: {no_material(stated, self._table)}; it is ignored"

    def _apart(self) -> set[int]:
        """Return the lower levels of detail that are in no scene but beside their original."""
        nodes, parents = self._document.nodes, self._spelled.parents
        named = {level for node in nodes for level in node.extensions.lod.ids}
        return {each for each in named if each < len(nodes) and parents[each] is None} - {
            *self._roots()
        }

    def _roots(self) -> Sequence[int]:
        document = self._document
        if document.scenes:
            return _at(document.scenes, document.scene or 0, "scene").nodes
        children = {child for node in document.nodes for child in node.children}
        return [index for index in range(len(document.nodes)) if index not in children]

    def _mesh_name(self, node: gltf.Node, index: int) -> str:
        """Return the name of a node that has none: that of its mesh, or its number."""
        name = "" if node.mesh is None else _clean(self._document.meshes[node.mesh].name)
        return name or f"#{index}"

    def _of_mesh(self, index: int | None) -> tuple[Surface, ...]:
        """Return the surfaces of a mesh, the largest first; points and lines are none."""
        if index is None:
            return ()
        known = self._surfaces.get(index)
        if known is not None:
            return known
        mesh = _at(self._document.meshes, index, "mesh")
        primitives = [at for at, each in enumerate(mesh.primitives) if each.mode >= _TRIANGLES]
        counts = {at: self._triangles(mesh.primitives[at]) for at in primitives}
        alike: dict[int | None, list[int]] = {}  # primitives by their material
        for at in primitives:
            alike.setdefault(mesh.primitives[at].material, []).append(at)
        sizes = counts if len(alike) < 2 else self._areas(mesh.primitives, primitives) or counts
        order = sorted(alike.items(), key=lambda item: -sum(sizes[at] for at in item[1]))
        if len(order) > MAX_SURFACES:
            name = printable(mesh.name or f"#{index}", 60)
            self._notes.append(
                f"mesh {name}: {len(order)} surfaces, of which the {MAX_SURFACES} largest count"
            )
        surfaces = tuple(
            Surface(name, shader, texture, sum(counts[at] for at in parts), tuple(parts), stated)
            for material, parts in order[:MAX_SURFACES]
            for name, shader, texture, stated in [self._of_material(material)]
        )
        self._surfaces[index] = surfaces
        return surfaces

    def _of_material(self, index: int | None) -> Look:
        """Return a material's name, shader parameters, base-colour map, and what it states."""
        if index is None:
            return None, None, None, None
        known = self._materials.get(index)
        if known is None:
            material = _at(self._document.materials, index, "material")
            reference = _base_color_map(material)
            texture = None if reference is None else self._texture(reference.index)
            name = _clean(material.name) or None
            shader = self._with_map(material, _shader(material), name)
            known = name, shader, texture, self._stated(material.extras)
            self._materials[index] = known
        return known

    def _stated(self, extras: msgspec.Raw) -> str | None:
        """Return the material that extras state; one that the table does not have is told."""
        stated = gltf.stated_material(extras)
        if stated is None or stated in self._table:
            return stated
        self._unstated[stated] = None
        return None

    def _with_map(self, material: gltf.Material, shader: Shader, name: str | None) -> Shader:
        """Return the shader with the means of its metallic-roughness map, unless the name is sure.

        Roughness is green and metallic blue; the map multiplies the factors.
        """
        pbr = material.pbr_metallic_roughness
        reference = pbr.metallic_roughness_texture
        if reference is None or not pbr.metallic_factor or material.extensions.glossiness:
            return shader
        named = names.from_name("", surface=name)
        if named and is_sure([named]):
            return shader
        if reference.index not in self._means:  # many materials share one atlas
            self._means[reference.index] = self._mean_of_map(reference.index)
        mean = self._means[reference.index]
        if mean is None:
            return shader
        roughness, metallic = mean
        return msgspec.structs.replace(
            shader,
            metallic=_share(metallic * pbr.metallic_factor),
            roughness=_share(roughness * pbr.roughness_factor),
        )

    def _mean_of_map(self, index: int) -> tuple[float, float] | None:
        """Return the mean roughness and metallic (0..1) of a texture; None: it cannot be read."""
        texture = self._texture(index)
        if texture is None:
            return None
        label = texture.name or "a metallic-roughness map"
        try:
            frame = decode_frame(texture.read(), Path(label))
            pixels = cut_region(frame, WHOLE, MAP_PX)
        except (SceneError, FileError, PictureError) as error:
            self._notes.append(f"{label}: {error}")
            return None
        _, roughness, metallic = pixels.reshape(-1, 3).mean(axis=0) / 255.0
        return float(roughness), float(metallic)

    def _texture(self, index: int) -> Texture | None:
        texture = _at(self._document.textures, index, "texture")
        others = texture.extensions
        alternatives = (others.webp, others.basisu, others.avif, others.dds)
        sources = (texture.source, *(each.source for each in alternatives if each))
        source = next((each for each in sources if each is not None), None)
        if source is None:
            return None
        image = _at(self._document.images, source, "image")
        return Texture(_picture_name(image) or _clean(texture.name) or None, self._picture(image))

    def _picture(self, image: gltf.Image) -> Callable[[], bytes]:
        form = _UNREADABLE.get(image.mime_type or "")
        if form is not None:
            return partial(_refuse, f"a {form} picture, which is not read; its name counts")
        if image.uri is not None:
            return partial(self._files.picture, image.uri)
        if image.buffer_view is None:
            return partial(_refuse, "the texture has no picture")
        view = _at(self._document.buffer_views, image.buffer_view, "buffer view")
        return partial(self._files.picture_in, view)

    def _triangles(self, primitive: gltf.Primitive) -> int:
        index = (
            primitive.indices if primitive.indices is not None else primitive.attributes.position
        )
        if index is None:
            return 0
        count = _at(self._document.accessors, index, "accessor").count
        return count // 3 if primitive.mode == _TRIANGLES else max(0, count - 2)

    def _areas(
        self, primitives: Sequence[gltf.Primitive], indices: Sequence[int]
    ) -> dict[int, float] | None:
        """Return the area of each primitive in square metres of the mesh; None if not known."""
        try:
            return {at: self._area(primitives[at]) for at in indices}
        except SceneError as error:
            self._unordered[str(error)] += 1
            return None

    def _area(self, primitive: gltf.Primitive) -> float:
        if primitive.extensions.draco is not None:
            raise SceneError("compressed with Draco, which is not read")
        if primitive.mode == _FAN:
            raise SceneError("triangle fans are not read")
        if primitive.attributes.position is None:
            raise SceneError("a primitive has no positions")
        points = self._array(primitive.attributes.position, "VEC3").astype(np.float32)
        if primitive.indices is None:
            corners: NDArray[Any] = np.arange(len(points), dtype=np.uint32)
        else:
            corners = self._array(primitive.indices, "SCALAR")[:, 0]
        if len(corners) and corners.max() >= len(points):
            raise SceneError("an index is larger than the count of its positions")
        area = area_m2(points, _corners(corners, primitive.mode))
        if not np.isfinite(area):
            raise SceneError("positions are not finite, or too far apart")
        return area

    def _array(self, index: int, kind: str) -> NDArray[Any]:
        """Return the data of an accessor, (count, width)."""
        accessor = _at(self._document.accessors, index, "accessor")
        dtype = np.dtype(_DTYPES.get(accessor.component_type, "V1"))
        if accessor.type != kind or dtype.kind == "V" or (kind == "SCALAR" and dtype.kind != "u"):
            raise SceneError(f"accessor {index} has the type {printable(accessor.type, 20)}")
        if accessor.buffer_view is None:
            raise SceneError("an accessor has no data")
        width = _WIDTHS[kind]
        view = _at(self._document.buffer_views, accessor.buffer_view, "buffer view")
        stride = view.byte_stride or width * dtype.itemsize
        if accessor.count == 0:
            return np.empty((0, width), dtype)
        size = (accessor.count - 1) * stride + width * dtype.itemsize
        data = self._files.geometry(view, accessor.byte_offset, size)
        return np.ndarray((accessor.count, width), dtype, data, 0, (stride, dtype.itemsize))


def area_m2(points: NDArray[np.float32], corners: NDArray[Any]) -> float:
    """Return the area of triangles with these points (n, 3) and corners (m, 3).

    It is not finite where the points are not, or lie too far apart.
    """
    total = 0.0
    with np.errstate(over="ignore", invalid="ignore"):
        for at in range(0, len(corners), _AT_ONCE):
            a, b, c = np.moveaxis(points[corners[at : at + _AT_ONCE]], 1, 0)
            double = np.linalg.norm(np.cross(b - a, c - a), axis=1)
            total += float(double.sum(dtype=np.float64)) / 2.0
    return total


def _corners(corners: NDArray[Any], mode: int) -> NDArray[Any]:
    """Return the corners of each triangle, (m, 3), without a copy."""
    if mode == _STRIP and len(corners) >= 3:
        return np.lib.stride_tricks.sliding_window_view(corners, 3)
    return corners[: len(corners) // 3 * 3].reshape(-1, 3)


def _base_color_map(material: gltf.Material) -> gltf.TextureRef | None:
    older = material.extensions.glossiness
    return material.pbr_metallic_roughness.base_color_texture or (
        None if older is None else older.diffuse_texture
    )


def _shader(material: gltf.Material) -> Shader:
    """Return the parameters of a material as a whole.

    A map multiplies its factor, so that the factor alone says nothing where there is a map, unless
    it is 0.
    """
    pbr, extensions = material.pbr_metallic_roughness, material.extensions
    through = extensions.transmission
    transmission = None if through is None else _share(through.transmission_factor)
    older = extensions.glossiness
    is_blended = material.alpha_mode == "BLEND"
    if older is not None:
        return Shader(
            roughness=_share(1.0 - older.glossiness_factor),
            transmission=transmission,
            base_color=_color(older.diffuse_factor),
            opacity=_share(older.diffuse_factor[3]) if is_blended else None,
        )
    is_mapped = pbr.metallic_roughness_texture is not None
    metallic, roughness = _share(pbr.metallic_factor), _share(pbr.roughness_factor)
    return Shader(
        metallic=None if is_mapped and metallic else metallic,
        roughness=None if is_mapped and roughness else roughness,
        transmission=transmission,
        base_color=_color(pbr.base_color_factor),
        opacity=_share(pbr.base_color_factor[3]) if is_blended else None,
    )


def _share(value: float) -> float:
    return min(1.0, max(0.0, value))


def _color(factor: tuple[float, float, float, float]) -> tuple[float, float, float]:
    red, green, blue, _ = factor
    return _share(red), _share(green), _share(blue)


def _picture_name(image: gltf.Image) -> str:
    if image.uri is not None and not image.uri.startswith("data:"):
        return _clean(unquote(image.uri).replace("\\", "/").rpartition("/")[2])
    return _clean(image.name)


def _refuse(reason: str) -> bytes:
    raise SceneError(reason)


def _clean(name: str | None) -> str:
    """Return a name as one line of printable characters."""
    return printable(name or "", MAX_NAME)


def _unique(path: tuple[str, ...], ids: Counter[str]) -> str:
    """Return an id that no other object has: the names, and a number where they are the same."""
    names = "/".join(path)[-MAX_ID:]
    ids[names] += 1
    while ids[names] > 1:
        ending = f"~{ids[names]}"
        other = names[: MAX_ID - len(ending)] + ending
        if other not in ids:
            ids[other] += 1
            return other
        ids[names] += 1
    return names


def _at(parts: Sequence[T], index: int, kind: str) -> T:
    """Return the part with this index. Raises SceneError if there is none."""
    if index >= len(parts):
        raise SceneError(
            f"not a valid glTF 2.0 file: {kind} {index} of {len(parts)} does not exist; "
            "export it again"
        )
    return parts[index]
