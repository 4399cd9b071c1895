"""A scene of 50 MB is scanned in seconds: of processor time, whatever else the machine does."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from gltf_room import glb

from hapticvlm.scenes.reading import read_scene
from hapticvlm.scenes.scan import scan, surfaces_of

WORDS = ("Oak", "Steel", "Glass", "Wool", "Leather", "mat", "Lamp", "Wall", "Chair", "Door")
MESHES, SURFACES, NODES, SIDE = 400, 5, 3000, 26
MOST_S = 10.0


def write_large(path: Path) -> Path:
    """Write 400 meshes of five surfaces, each a rough sheet, worn by 3,000 nodes."""
    rng = np.random.default_rng(1)
    data = bytearray()
    lists: dict[str, list[Any]] = {"bufferViews": [], "accessors": [], "meshes": []}
    grid = np.arange(SIDE * SIDE).reshape(SIDE, SIDE)
    corners = (grid[:-1, :-1], grid[1:, :-1], grid[:-1, 1:])
    triangles = np.stack(corners, axis=-1).astype("<u2").reshape(-1, 1)

    def accessor(values: np.ndarray, kind: str, component: int) -> int:
        view = {"buffer": 0, "byteOffset": len(data), "byteLength": values.nbytes}
        data.extend(values.tobytes() + bytes(-values.nbytes % 4))
        lists["bufferViews"].append(view)
        lists["accessors"].append(
            {
                "bufferView": len(lists["bufferViews"]) - 1,
                "componentType": component,
                "count": len(values),
                "type": kind,
            }
        )
        return len(lists["accessors"]) - 1

    for _ in range(MESHES):
        primitives = []
        for material in rng.permutation(60)[:SURFACES]:
            points, normals = rng.normal(0.0, 1.0, (2, SIDE * SIDE, 3)).astype("<f4")
            attributes = {
                "POSITION": accessor(points, "VEC3", 5126),
                "NORMAL": accessor(normals, "VEC3", 5126),
                "TANGENT": accessor(normals, "VEC3", 5126),
            }
            indices = accessor(triangles, "SCALAR", 5123)
            primitives.append(
                {"attributes": attributes, "indices": indices, "material": int(material)}
            )
        lists["meshes"].append({"primitives": primitives})
    document = {
        "asset": {"version": "2.0"},
        "nodes": [
            {"name": f"{WORDS[at % len(WORDS)]}_{at}", "mesh": at % MESHES} for at in range(NODES)
        ],
        "materials": [{"name": f"{WORDS[at % len(WORDS)]}_{at}"} for at in range(60)],
        "buffers": [{"byteLength": len(data)}],
        **lists,
    }
    path.write_bytes(glb(document, bytes(data)))
    return path


@pytest.mark.nightly
def test_a_scene_of_50_mb_takes_less_than_ten_seconds(tmp_path: Path) -> None:
    path = write_large(tmp_path / "large.glb")
    assert path.stat().st_size > 50e6
    begun = time.process_time()
    scene = read_scene(path)
    rows = list(scan(surfaces_of(scene)))
    assert time.process_time() - begun < MOST_S
    assert len(rows) == NODES * SURFACES
    assert scene.notes == ()
