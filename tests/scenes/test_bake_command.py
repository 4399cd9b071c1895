"""`hapticvlm bake`: scene messages and recordings to files, and what it refuses."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from drawn_textures import planks, png
from gltf_room import SURFACES, glb, write_room
from in_process import hapticvlm
from recorded_session import record

from hapticvlm.commands.main import main
from hapticvlm.materials import MATERIALS
from hapticvlm.scenes import texture_reader
from hapticvlm.scenes.reading import read_scene
from hapticvlm.scenes.texture_reader import TextureReader

SCENE = {
    "type": "scene",
    "id": 1,
    "replace": True,
    "objects": [{"object_id": "t", "name": "OakTable"}, {"object_id": "g", "material": "glass"}],
}
MORE = {
    "type": "scene",
    "id": 2,
    "replace": False,
    "objects": [{"object_id": "k", "name": "SteelKettle"}],
    "forget": ["g"],
}


@pytest.fixture(autouse=True)
def cache(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Path:
    """A folder of the test's own for what texture maps showed."""
    folder = tmp_path / "cache"
    monkeypatch.setattr(texture_reader, "cache_folder", lambda: folder)
    return folder


def write_mute_scene(path: Path, data: bytes) -> Path:
    """Write a scene whose names say nothing, so that its map, these bytes, is read."""
    pbr = {"metallicFactor": 0.0, "roughnessFactor": 0.6, "baseColorTexture": {"index": 0}}
    document = {
        "asset": {"version": "2.0"},
        "nodes": [{"name": "Mesh.001", "mesh": 0}],
        "meshes": [{"primitives": [{"material": 0}]}],
        "materials": [{"name": "mat7", "pbrMetallicRoughness": pbr}],
        "textures": [{"source": 0}],
        "images": [{"bufferView": 0, "mimeType": "image/png"}],
        "bufferViews": [{"buffer": 0, "byteLength": len(data)}],
        "buffers": [{"byteLength": len(data)}],
    }
    path.write_bytes(glb(document, data))
    return path


def materials(folder: Path) -> dict[str, str | None]:
    objects = json.loads((folder / "materials.json").read_text())["objects"]
    return {key: each["surfaces"][0]["material"] for key, each in objects.items()}


def test_a_folder_of_scenes_is_baked_scene_by_scene_and_names_one_that_cannot_be_read(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    scenes, out = tmp_path / "scenes", tmp_path / "out"
    (scenes / "upstairs").mkdir(parents=True)
    for name, node in (("hall.glb", "OakTable"), ("upstairs/hall.glb", "SteelKettle")):
        document = {"asset": {"version": "2.0"}, "nodes": [{"name": node, "mesh": 0}]}
        document |= {"meshes": [{"primitives": [{}]}]}
        (scenes / name).write_bytes(glb(document, b""))
    assert main(["bake", str(scenes), "-o", str(out)]) == 0
    assert list(materials(out / "hall.glb").values()) == ["wood"]
    assert list(materials(out / "upstairs" / "hall.glb").values()) == ["metal"]
    assert (out / "upstairs" / "hall.glb" / "feel.true.json").exists()
    (scenes / "broken.gltf").write_text("nothing")
    capsys.readouterr()
    assert main(["bake", str(scenes), "-o", str(out)]) == 1
    assert "broken.gltf" in capsys.readouterr().err
    assert not (out / "broken.gltf").exists()


@pytest.mark.parametrize("form", ["one", "list", "lines"])
def test_scene_messages_are_read_in_each_form(tmp_path: Path, form: str) -> None:
    source = tmp_path / "scene.json"
    messages = [SCENE] if form == "one" else [SCENE, MORE]
    several = "\n".join(map(json.dumps, messages)) if form == "lines" else json.dumps(messages)
    source.write_text(json.dumps(SCENE) if form == "one" else several)
    assert main(["bake", str(source), "-o", str(tmp_path / "out")]) == 0
    one = {"t": "wood", "g": "glass"}
    assert materials(tmp_path / "out") == (one if form == "one" else {"t": "wood", "k": "metal"})


def test_a_second_bake_keeps_a_correction_and_says_so(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    source = tmp_path / "scene.json"
    source.write_text(json.dumps(SCENE))
    arguments = ["bake", str(source), "-o", str(tmp_path)]
    assert main(arguments) == 0
    file = tmp_path / "materials.json"
    document = json.loads(file.read_text())
    document["objects"]["t"]["surfaces"][0] |= {"material": "stone", "by": "hand"}
    file.write_text(json.dumps(document))
    assert main(arguments) == 0
    assert materials(tmp_path) == {"t": "stone", "g": "glass"}
    assert "1 corrected by hand" in capsys.readouterr().out


def test_names_of_a_scene_move_no_terminal(tmp_path: Path) -> None:
    hostile = {"object_id": "\x1b]0;own\x07\u202e", "surfaces": [{"name": "\x1b[2J"}]}
    source = tmp_path / "scene.json"
    source.write_text(json.dumps({**SCENE, "objects": [hostile]}))
    said = hapticvlm("bake", str(source), "-o", str(tmp_path / "out")).out
    assert "not felt" in said
    assert all(line.isprintable() for line in said.splitlines())


def test_the_built_in_materials_are_what_the_web_client_ships(tmp_path: Path) -> None:
    assert main(["bake", "--materials", "-o", str(tmp_path)]) == 0
    shipped = Path(__file__).parents[2] / "examples" / "webxr" / "client" / "feel.true.json"
    assert (tmp_path / "feel.true.json").read_bytes() == shipped.read_bytes()
    assert list(json.loads(shipped.read_text())["materials"]) == sorted(MATERIALS)


@pytest.mark.parametrize(
    ("content", "named"),
    [
        ("{", "scene.json"),
        ("[]", "no `scene` message"),
        ('{"type": "scene", "id": 1, "replace": true, "objects": [{"name": "x"}]}', "object_id"),
        (json.dumps({**SCENE, "objects": [{"object_id": "a", "material": "wod"}]}), "material"),
    ],
)
def test_a_source_that_is_not_a_scene_is_refused_and_named(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], content: str, named: str
) -> None:
    source = tmp_path / "scene.json"
    source.write_text(content)
    assert main(["bake", str(source), "-o", str(tmp_path / "out")]) == 2
    assert named in capsys.readouterr().err
    assert not (tmp_path / "out" / "feel.true.json").exists()


def test_either_a_source_or_the_materials_are_needed(tmp_path: Path) -> None:
    assert main(["bake", "-o", str(tmp_path)]) == 2
    assert main(["bake", "x.json", "--materials", "-o", str(tmp_path)]) == 2


def test_a_recording_is_baked_as_its_session_ended(tmp_path: Path) -> None:
    record(tmp_path / "sessions")
    assert main(["bake", str(tmp_path / "sessions"), "-o", str(tmp_path / "out")]) == 0
    assert materials(tmp_path / "out") == {"mug": "ceramic"}


def test_a_gltf_room_is_baked_as_the_scan_decides_and_again_to_the_same_bytes(
    tmp_path: Path,
) -> None:
    room = write_room(tmp_path / "room.glb")
    for folder in ("first", "second"):
        baked = hapticvlm("bake", room, "-o", tmp_path / folder)
        assert (baked.code, baked.err) == (0, "")
    surfaces = json.loads((tmp_path / "first" / "materials.json").read_text())["objects"]["Room"]
    rows = json.loads(hapticvlm("scan", room, "--json").out)["surfaces"]
    decided = [(row["felt"], row["source"]) for row in rows]
    assert [(each["material"], each["by"]) for each in surfaces["surfaces"]] == decided
    assert len(rows) == len(SURFACES)
    for name in ("materials.json", "feel.true.json", "feel.sound.json"):
        first, second = ((tmp_path / each / name).read_bytes() for each in ("first", "second"))
        assert first == second


def test_the_texture_of_a_surface_that_says_nothing_enters_the_bake(
    tmp_path: Path,
) -> None:
    path = write_mute_scene(tmp_path / "mute.glb", png(planks()))
    (node,) = read_scene(path).objects
    assert node.surfaces[0].texture is not None
    evidence = TextureReader()(node.surfaces[0].texture)
    assert evidence is not None
    assert main(["bake", str(path), "-o", str(tmp_path / "out")]) == 0
    document = json.loads((tmp_path / "out" / "materials.json").read_text())
    (surface,) = document["objects"]["Mesh.001"]["surfaces"]
    assert (surface["by"], surface["material"]) == ("texture", evidence.material)


def test_what_cannot_be_read_of_a_gltf_scene_is_told_and_the_rest_is_baked(tmp_path: Path) -> None:
    room = write_room(tmp_path / "room.gltf")
    room.with_suffix(".bin").unlink()
    mute = write_mute_scene(tmp_path / "mute.glb", b"no picture")
    for source, named, ids in ((room, "room.bin", {"Room"}), (mute, "texture", {"Mesh.001"})):
        baked = hapticvlm("bake", source, "-o", tmp_path / "out")
        assert baked.code == 0
        assert named in baked.err
        assert set(materials(tmp_path / "out")) == ids


@pytest.mark.parametrize("content", [b"glTF", b"{}", None])
def test_a_broken_gltf_scene_is_refused_and_named(tmp_path: Path, content: bytes | None) -> None:
    if content is not None:
        (tmp_path / "room.GLB").write_bytes(content)
    refused = hapticvlm("bake", "room.GLB", "-o", "out", cwd=tmp_path)
    assert refused.code == 2
    assert "room.GLB" in refused.err
    assert not (tmp_path / "out" / "feel.true.json").exists()
