"""Reads glTF 2.0 models (.gltf with files beside it, .glb): triangles and texture maps.

Supports only what the held-back models use: no skins, animation, compression or sparse accessors.
"""

from __future__ import annotations

import json
import struct
from collections.abc import Mapping
from dataclasses import dataclass, replace
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from hapticvlm_lab.training.held_back.meshes import Array, Mesh, creased, join, rotation

_TYPES = {5121: "u1", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
_WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}
_JSON_AT = 20  # bytes of the GLB header and the first chunk's header
_CHUNK = 8


@dataclass(frozen=True, slots=True)
class Part:
    """A mesh with the maps (H, W, 3) uint8 of its material and the factors without a map."""

    mesh: Mesh
    colour: NDArray[np.uint8] | None
    metal_rough: NDArray[np.uint8] | None
    metallic: float
    roughness: float


@dataclass(frozen=True, slots=True)
class _File:
    tree: Mapping[str, Any]
    binary: bytes
    folder: Path


def read_model(path: Path, *, z_up: bool) -> list[Part]:
    """Read a model's parts, y up; parts of one material are one. Raises OSError, ValueError."""
    file = _open(path)
    turn = rotation(np.eye(3)[0], -np.pi / 2) if z_up else np.eye(3)
    meshes: dict[int, list[Mesh]] = {}
    for node in file.tree["nodes"]:
        if "mesh" in node:
            for primitive in file.tree["meshes"][node["mesh"]]["primitives"]:
                mesh = _placed(_mesh(file, primitive), node, turn)
                meshes.setdefault(primitive["material"], []).append(mesh)
    return [_part(file, file.tree["materials"][key], join(meshes[key])) for key in sorted(meshes)]


def _open(path: Path) -> _File:
    raw = path.read_bytes()
    if path.suffix == ".glb":
        (length,) = struct.unpack_from("<I", raw, 12)
        tree = json.loads(raw[_JSON_AT : _JSON_AT + length])
        return _File(tree, raw[_JSON_AT + length + _CHUNK :], path.parent)
    tree = json.loads(raw)
    return _File(tree, (path.parent / tree["buffers"][0]["uri"]).read_bytes(), path.parent)


def _mesh(file: _File, primitive: Mapping[str, Any]) -> Mesh:
    attributes = primitive["attributes"]
    points = _accessor(file, attributes["POSITION"]).astype(np.float64)
    faces = _accessor(file, primitive["indices"]).astype(np.int64).reshape(-1, 3)
    uv = _accessor(file, attributes["TEXCOORD_0"]).astype(np.float64)
    if "NORMAL" not in attributes:
        return creased(Mesh(points, np.zeros_like(points), uv, faces, closed=False))
    normals = _accessor(file, attributes["NORMAL"]).astype(np.float64)
    return Mesh(points, normals, uv, faces, closed=False)


def _accessor(file: _File, index: int) -> NDArray[Any]:
    accessor = file.tree["accessors"][index]
    view = file.tree["bufferViews"][accessor["bufferView"]]
    kind = np.dtype(_TYPES[accessor["componentType"]])
    width = _WIDTHS[accessor["type"]]
    start = view.get("byteOffset", 0) + accessor.get("byteOffset", 0)
    stride = view.get("byteStride", kind.itemsize * width)
    return np.ndarray(
        (accessor["count"], width), kind, file.binary, start, (stride, kind.itemsize)
    ).copy()


def _placed(mesh: Mesh, node: Mapping[str, Any], turn: Array) -> Mesh:
    x, y, z, w = node.get("rotation", (0.0, 0.0, 0.0, 1.0))
    axis = np.array([x, y, z])
    length = float(np.linalg.norm(axis))
    own = rotation(axis / length, 2 * np.arctan2(length, w)) if length > 0 else np.eye(3)
    points = mesh.points * node.get("scale", 1.0) @ own.T + node.get("translation", 0.0)
    return replace(mesh, points=points @ turn.T, normals=mesh.normals @ own.T @ turn.T)


def _part(file: _File, material: Mapping[str, Any], mesh: Mesh) -> Part:
    surface = material.get("pbrMetallicRoughness", {})
    return Part(
        mesh,
        _picture(file, surface.get("baseColorTexture")),
        _picture(file, surface.get("metallicRoughnessTexture")),
        float(surface.get("metallicFactor", 1.0)),
        float(surface.get("roughnessFactor", 1.0)),
    )


def _picture(file: _File, texture: Mapping[str, Any] | None) -> NDArray[np.uint8] | None:
    if texture is None:
        return None
    image = file.tree["images"][file.tree["textures"][texture["index"]]["source"]]
    if "uri" in image:
        data = (file.folder / image["uri"]).read_bytes()
    else:
        view = file.tree["bufferViews"][image["bufferView"]]
        start = view.get("byteOffset", 0)
        data = file.binary[start : start + view["byteLength"]]
    return np.asarray(Image.open(BytesIO(data)).convert("RGB"))
