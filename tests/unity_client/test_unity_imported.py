"""Copies of a glTF file that glTFast and UnityGLTF make at run time are found in its bake."""

from __future__ import annotations

import json
from pathlib import Path

import mono

from hapticvlm.materials import MATERIALS
from hapticvlm.scenes.reading import read_scene

pytest_plugins = ("mono_build",)
PARTS = [{"attributes": {}, "material": 0}, {"attributes": {}, "material": 1}]
CAR = [{"children": [1, 2], "name": "Car"}, *({"name": "Wheel", "mesh": 1} for _ in "12")]
FAR = {"MSFT_lod": {"ids": [5]}}
FILE = {
    "asset": {"version": "2.0"},
    "materials": [{"name": "Clay"}, {"name": "Steel"}],
    "meshes": [{"primitives": PARTS[:1]}, {"name": "Cube", "primitives": PARTS}],
    "nodes": [*CAR, {"mesh": 0}, {"name": "Table", "mesh": 1, "extensions": FAR}, {"name": "Far"}],
    "scenes": [{"nodes": [0, 3, 4]}],
}
# Names from a Haptic Object on, materials, the touched one: what is felt.
SPELLED = {
    "Scene|Node-3\tplain\t": "3 Clay",  # glTFast
    "Scene|GLTFNode3\tplain\t": "3 Clay",  # UnityGLTF
    "Scene|Node-9\tplain\t": "nothing",
    "Scene|Table|Cube_1\tSteel\t": "4 Steel",  # glTFast: another part of the mesh
    "Scene|Table|Cube_1\tplain|Clay\t1": "4 Clay",
    "Scene|Table|Cube_i7\tSteel\t": "4 Steel",  # one of many instances
    "Scene|Table|Instances|Instance 7\tClay|Steel\t1": "4 Steel",  # UnityGLTF
    "Scene|Table|Cup\tplain\t": "nothing",  # put on it by a game
    "Table|Collider\tplain|Clay\t1": "4 Clay",  # below a Haptic Object
    "Scene|Car|Wheel\tplain|Steel\t1": "1 Steel",
    "Scene|Car|Wheel_0\tplain|Steel\t1": "2 Steel",  # glTFast: one of two of one name
    "Scene|Car|Wheel;Wheel\tplain|Steel\t1": "2 Steel",  # where it does not number them
    "Scene|Table|Far\tplain|Steel\t1": "4 Steel",  # UnityGLTF: a lower level of detail
    "Scene|Car(Clone)|Wheel (1)\tplain|Steel\t1": "1 Steel",  # a copy that Unity made
}


def test_names_of_unitys_importers_are_found(build: mono.Build, tmp_path: Path) -> None:
    (tmp_path / "room.gltf").write_text(json.dumps(FILE))
    objects = {}
    for node in read_scene(tmp_path / "room.gltf", table=MATERIALS).objects:
        felt = [{"name": one.name, "material": f"{node.index} {one.name}"} for one in node.surfaces]
        objects[node.object_id] = {"paths": node.spelled, "surfaces": felt}
    lines = [json.dumps({"version": 2, "objects": objects}), *SPELLED]
    printed = build.run("components.exe", "Imported.Find", text="\n".join(lines))
    answers = [line[5:] for line in printed.splitlines() if line.startswith("felt ")]
    assert dict(zip(SPELLED, answers, strict=True)) == SPELLED
