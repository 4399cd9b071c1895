"""`hapticvlm bake`: scene messages and recordings to files, and what it refuses."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from recorded_session import record

from hapticvlm.commands.main import main
from hapticvlm.materials import MATERIALS

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


def materials(folder: Path) -> dict[str, str | None]:
    objects = json.loads((folder / "materials.json").read_text())["objects"]
    return {key: each["surfaces"][0]["material"] for key, each in objects.items()}


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


def test_the_built_in_materials_are_what_the_web_client_ships(tmp_path: Path) -> None:
    assert main(["bake", "--materials", "-o", str(tmp_path)]) == 0
    shipped = Path(__file__).parents[2] / "examples" / "webxr" / "client" / "feel.json"
    assert (tmp_path / "feel.json").read_bytes() == shipped.read_bytes()
    assert list(json.loads(shipped.read_text())["materials"]) == sorted(MATERIALS)


def test_clips_are_a_strike_and_a_slide_of_each_material_in_three_formats(tmp_path: Path) -> None:
    source = tmp_path / "scene.json"
    source.write_text(json.dumps(SCENE))
    assert main(["bake", str(source), "-o", str(tmp_path), "--clips"]) == 0
    clips = {path.name for path in (tmp_path / "clips").iterdir() if ".heat." not in path.name}
    assert len(clips) == 2 * 2 * 3
    assert {"wood-strike.wav", "glass-slide.ahap"} <= clips


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
    assert not (tmp_path / "out" / "feel.json").exists()


def test_either_a_source_or_the_materials_are_needed(tmp_path: Path) -> None:
    assert main(["bake", "-o", str(tmp_path)]) == 2
    assert main(["bake", "x.json", "--materials", "-o", str(tmp_path)]) == 2


def test_a_recording_is_baked_as_its_session_ended(tmp_path: Path) -> None:
    session = record(tmp_path / "session")
    assert main(["bake", str(session), "-o", str(tmp_path / "out")]) == 0
    assert materials(tmp_path / "out") == {"mug": "ceramic"}
