"""The web package finds a page's things in a bake, however the loader spells their names."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import identity
import pytest
from node_programs import printed

from hapticvlm.commands.main import main

HERE = Path(__file__).parent
NAMES = (
    *("floor.007", "floor007", "floor_007", "Cup", "Cup", "Cup_1", "Cup 1", "a/b", "a:b", "[x] y"),
    *(
        "Tür",
        "constructor",
        "Twins",
        None,
        None,
        "Scene",
        "Cup",
        "Cup_instance_2",
        None,
        "Clone of a",
    ),
)


def asked(*arguments: str | Path) -> Any:
    return printed(HERE / "identity.mjs", *arguments)


@pytest.fixture(scope="module")
def meshes(tmp_path_factory: pytest.TempPathFactory) -> list[dict[str, Any]]:
    """The things that three.js finds in a scene whose names are as hard as exporters make them."""
    parts = [{"attributes": {"POSITION": at}, "material": int(at == 2)} for at in range(4)]
    one, two = {"primitives": parts[:1], "name": "Cup"}, {"primitives": parts[1:], "name": "Twins"}
    nodes: list[dict[str, Any]] = [
        {"mesh": int(at % 3 == 2)} | ({} if name is None else {"name": name})
        for at, name in enumerate(NAMES)
    ]
    nodes[2]["children"] = [3]
    nodes[12]["children"] = [4, 13]
    roots = [at for at in range(len(NAMES)) if at not in {3, 4, 13}]
    document = {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"name": "Scene", "nodes": roots}],
        "nodes": nodes,
        "meshes": [one, two],
        "materials": [{"name": "Oak"}, {"name": "M.Steel"}],
        "accessors": [{"componentType": 5126, "count": 3, "type": "VEC3"}] * 4,
    }
    return found_in(document, tmp_path_factory.mktemp("scene"))


def found_in(document: dict[str, Any], folder: Path) -> list[dict[str, Any]]:
    """Return what three.js makes of a scene, and what its bake has of that."""
    path = folder / "scene.gltf"
    path.write_text(json.dumps(document), encoding="utf-8")
    assert main(["bake", str(path), "-o", str(folder / "baked")]) == 0
    told: list[dict[str, Any]] = asked("scene", path, folder / "baked" / "materials.json")
    return told


def test_every_mesh_of_a_scene_is_found_as_the_node_and_material_that_it_is(
    meshes: list[dict[str, Any]],
) -> None:
    assert len(meshes) == sum(3 if at % 3 == 2 else 1 for at in range(len(NAMES)))
    assert [mesh for mesh in meshes if mesh["found"][0] != mesh["is"][0]] == []
    assert [mesh for mesh in meshes if mesh["is"][1] not in mesh["found"][1]] == []


@pytest.mark.parametrize("how", ["copy", "made"])
def test_a_copy_or_a_nameless_mesh_of_the_page_is_felt_as_the_part_that_it_was_made_of(
    meshes: list[dict[str, Any]], how: str
) -> None:
    assert [mesh for mesh in meshes if mesh["is"][1] not in mesh[how][1]] == []


def test_a_lower_level_of_detail_is_felt_as_its_original_whatever_its_own_material(
    tmp_path: Path,
) -> None:
    levels = {"extensions": {"MSFT_lod": {"ids": [1]}}}
    document = {
        "asset": {"version": "2.0"},
        "scenes": [{"nodes": [0, 1]}],
        "nodes": [{"name": "Chair", "mesh": 0, **levels}, {"name": "Chair.far", "mesh": 1}],
        "meshes": [
            {"primitives": [{"attributes": {"POSITION": 0}, "material": at}]} for at in (0, 1)
        ],
        "materials": [{"name": "Oak", **levels}, {"name": "Blur"}],
        "accessors": [{"componentType": 5126, "count": 3, "type": "VEC3"}],
    }
    meshes = found_in(document, tmp_path)
    assert [(mesh["is"], mesh["found"]) for mesh in meshes] == [
        ([0, 0], [0, [0]]),
        ([1, 0], [0, [0]]),
    ]


def test_what_babylon_copies_is_felt_as_the_part_that_it_was_made_of() -> None:
    copies = asked("babylon", identity.FILE)
    assert list(copies.values()) == 4 * [{"object_id": "Twins", "surface": 1}], copies


def test_the_shared_cases_hold() -> None:
    assert identity.differences(asked("cases", identity.FILE)) == []


def test_each_wrong_value_of_a_bake_is_refused_in_words_or_does_no_harm() -> None:
    assert asked("damaged", identity.FILE) == []


def test_a_miss_is_said_once_with_the_nearest_id_and_ends_with_the_next_touch() -> None:
    told = asked("touch", identity.FILE, "Room/flor007", "Room/floor.007", "Room/flor007")
    assert "`Room/flor007` is not in the bake; nearest is `Room/floor.007`" in told["warnings"][0]
    assert told["silences"]["Room/floor.007"] == ""
    assert told["silences"]["Room/flor007"] in told["warnings"][0]
    assert len(told["warnings"]) == 1
