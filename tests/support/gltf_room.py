"""Draws a glTF room of one object with twenty surfaces, as scenes of the web have them.

`write_room` writes it; `SURFACES` says what each surface is made of, so that a client that loads
the room can be graded. The names are of the kinds that real scenes have: names of matter, names of
things, and names that say nothing beside a shader that does. The file is the same on every machine.
"""

from __future__ import annotations

import io
import json
import struct
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

OBJECT = "Room"
MAP_PX = 64
Triple = tuple[float, float, float]


@dataclass(frozen=True)
class DrawnSurface:
    """A box in the room: its material's name, what it is made of, where it is and its size, m.

    Surfaces with a `texture` have a base-colour map of this name.
    """

    name: str
    material: str
    center: Triple
    size: Triple
    color: Triple = (0.6, 0.6, 0.6)
    metallic: float = 0.0
    roughness: float = 0.6
    transmission: float | None = None
    texture: str | None = None


def _grid(number: int) -> Triple:
    """The place of the thing with this number on the floor, 0.8 m apart and 0.9 m high."""
    return (-1.6 + 0.8 * (number % 5), 0.9, -1.2 + 0.8 * (number // 5))


def _thing(number: int, name: str, material: str, **shader: Any) -> DrawnSurface:
    side = 0.5 - 0.01 * number  # no two surfaces of one size, so that their order is certain
    return DrawnSurface(name, material, _grid(number), (side, side, side), **shader)


SURFACES = (
    DrawnSurface("Oak_Parquet", "wood", (0, -0.05, 0), (6, 0.1, 6), (0.55, 0.36, 0.2)),
    DrawnSurface("Brick_Wall", "stone", (0, 1.5, -3.05), (6, 3, 0.1), (0.6, 0.3, 0.25)),
    DrawnSurface("Wool_Carpet", "fabric", (0, 0.01, 0), (4, 0.02, 3), (0.5, 0.1, 0.1)),
    DrawnSurface("Curtain_Velvet", "fabric", (-2.95, 1.5, 0), (0.04, 2.4, 2), (0.3, 0.1, 0.3)),
    _thing(0, "Walnut_Varnished", "wood", color=(0.35, 0.2, 0.12), texture="T_Walnut_D.png"),
    _thing(1, "Steel_Brushed", "metal", metallic=1.0, roughness=0.35),
    _thing(2, "Glass_Clear", "glass", roughness=0.02, transmission=1.0),
    _thing(3, "Leather_Brown", "leather", color=(0.3, 0.18, 0.1)),
    _thing(4, "Rubber_Black", "rubber", color=(0.05, 0.05, 0.05), roughness=0.9),
    _thing(5, "Marble_White", "stone", color=(0.9, 0.9, 0.88), texture="T_Marble_D.png"),
    _thing(6, "Porcelain_Glazed", "ceramic", color=(0.95, 0.95, 0.93), roughness=0.1),
    _thing(7, "Cardboard", "paper", color=(0.65, 0.5, 0.33), roughness=0.9),
    _thing(8, "Plastic_Red", "plastic", color=(0.8, 0.1, 0.1), roughness=0.3),
    _thing(9, "Ivy_Leaves", "foliage", color=(0.15, 0.4, 0.12)),
    _thing(10, "mat7", "metal", color=(0.95, 0.64, 0.54), metallic=1.0, roughness=0.25),
    _thing(11, "mat14", "glass", roughness=0.0, transmission=1.0),
    _thing(12, "lambert3", "wood", texture="T_Planks_D.png"),
    _thing(13, "Copper_Pan", "metal", color=(0.95, 0.64, 0.54), metallic=1.0, roughness=0.3),
    _thing(14, "Denim", "fabric", color=(0.2, 0.25, 0.45), roughness=0.95),
    _thing(15, "Concrete_Rough", "stone", color=(0.5, 0.5, 0.5), roughness=0.95),
)


def write_room(path: Path) -> Path:
    """Write the room as .glb, or as .gltf with its buffer and maps beside it, by the ending."""
    binary = path.suffix == ".glb"
    data = bytearray()
    document = _document(data, path, binary=binary)
    path.parent.mkdir(parents=True, exist_ok=True)
    if binary:
        document["buffers"] = [{"byteLength": len(data)}]
        path.write_bytes(glb(document, bytes(data)))
    else:
        document["buffers"] = [{"byteLength": len(data), "uri": f"{path.stem}.bin"}]
        path.with_suffix(".bin").write_bytes(data)
        path.write_text(json.dumps(document), encoding="utf-8")
    return path


def glb(document: dict[str, Any], data: bytes = b"") -> bytes:
    """Return a .glb of this document and these bytes."""
    text = json.dumps(document, separators=(",", ":")).encode()
    chunks = b""
    for kind, content, fill in ((b"JSON", text, b" "), (b"BIN\0", data, b"\0")):
        if content:
            content += fill * (-len(content) % 4)
            chunks += struct.pack("<I4s", len(content), kind) + content
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks


def _document(data: bytearray, path: Path, *, binary: bool) -> dict[str, Any]:
    document: dict[str, Any] = {
        "asset": {"version": "2.0"},
        "extensionsUsed": ["KHR_materials_transmission"],
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"name": OBJECT, "mesh": 0}],
        "meshes": [{"name": "mesh2057757694", "primitives": []}],
        **{kind: [] for kind in ("materials", "textures", "images", "accessors", "bufferViews")},
    }
    # In the file the surfaces are not in the order of their areas, as in no real file.
    for index in np.random.default_rng(20).permutation(len(SURFACES)):
        surface = SURFACES[int(index)]
        document["meshes"][0]["primitives"].append(
            {
                "attributes": _box(document, data, surface),
                "indices": len(document["accessors"]) - 1,
                "material": len(document["materials"]),
            }
        )
        material = _material(surface)
        if surface.texture is not None:
            pbr = material["pbrMetallicRoughness"]
            pbr["baseColorTexture"] = {"index": len(document["textures"])}
            document["textures"].append({"source": len(document["images"])})
            picture = _map(surface)
            if binary:
                image: dict[str, Any] = {"mimeType": "image/png", "name": surface.texture}
                image |= {"bufferView": _view(document, data, picture)}
            else:
                path.parent.mkdir(parents=True, exist_ok=True)
                (path.parent / surface.texture).write_bytes(picture)
                image = {"uri": surface.texture}
            document["images"].append(image)
        document["materials"].append(material)
    return document


def _material(surface: DrawnSurface) -> dict[str, Any]:
    pbr = {
        "baseColorFactor": [*surface.color, 1.0] if surface.texture is None else [1.0] * 4,
        "metallicFactor": surface.metallic,
        "roughnessFactor": surface.roughness,
    }
    material: dict[str, Any] = {"name": surface.name, "pbrMetallicRoughness": pbr}
    if surface.transmission is not None:
        transmission = {"transmissionFactor": surface.transmission}
        material["extensions"] = {"KHR_materials_transmission": transmission}
    return material


def _box(document: dict[str, Any], data: bytearray, surface: DrawnSurface) -> dict[str, int]:
    """Add a box of six faces; its accessor of indices is the last that is added."""
    faces = []
    for axis in range(3):
        for side in (-1.0, 1.0):
            normal, across, up = np.zeros((3, 3))
            normal[axis], up[(axis + 2) % 3] = side, 1.0
            across[(axis + 1) % 3] = side  # turns the same way seen from outside
            places = ((-1, -1), (1, -1), (1, 1), (-1, 1))
            faces += [(normal + u * across + v * up, normal, (u, v)) for u, v in places]
    at = np.array([face[0] for face in faces]) * np.array(surface.size) / 2.0 + surface.center
    around = np.array([face[2] for face in faces]) / 2.0 + 0.5
    corners = np.array([f * 4 + c for f in range(6) for c in (0, 1, 2, 0, 2, 3)], np.uint16)
    attributes = {
        "POSITION": _accessor(document, data, at.astype("<f4"), "VEC3"),
        "NORMAL": _accessor(document, data, np.array([f[1] for f in faces], "<f4"), "VEC3"),
        "TEXCOORD_0": _accessor(document, data, around.astype("<f4"), "VEC2"),
    }
    _accessor(document, data, corners, "SCALAR")
    return attributes


def _accessor(document: dict[str, Any], data: bytearray, values: np.ndarray, kind: str) -> int:
    accessor: dict[str, Any] = {
        "bufferView": _view(document, data, values.tobytes()),
        "componentType": 5126 if values.dtype.kind == "f" else 5123,
        "count": len(values),
        "type": kind,
    }
    if kind == "VEC3":
        accessor |= {"min": values.min(0).tolist(), "max": values.max(0).tolist()}
    document["accessors"].append(accessor)
    return len(document["accessors"]) - 1


def _view(document: dict[str, Any], data: bytearray, content: bytes) -> int:
    data += b"\0" * (-len(data) % 4)
    document["bufferViews"].append(
        {"buffer": 0, "byteOffset": len(data), "byteLength": len(content)}
    )
    data += content
    return len(document["bufferViews"]) - 1


def _map(surface: DrawnSurface) -> bytes:
    """Draw a base-colour map: stripes of the surface's colour, which no test may call wood."""
    stripes = 0.85 + 0.15 * np.sin(np.arange(MAP_PX) / 3.0)
    pixels = 255.0 * stripes[:, None, None] * np.array(surface.color) * np.ones((1, MAP_PX, 1))
    out = io.BytesIO()
    Image.fromarray(pixels.astype(np.uint8)).save(out, "PNG")
    return out.getvalue()
