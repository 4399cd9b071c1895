"""GameObject > HapticVLM > Bake Scene in the stand-in of the editor, with the real command."""

import json
import re
import sys
from pathlib import Path

import pytest
from pace import PACE

pytest_plugins = ("mono_build",)
COMMAND = Path(sys.executable).with_name("hapticvlm")


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("assets")


@pytest.fixture(scope="module")
def output(build, folder):
    return build.run(
        "components.exe", "BakeRooms.Run", str(folder), str(COMMAND), timeout=300.0 * PACE
    )


def test_the_open_scene_is_baked_into_files_that_its_client_plays(output, folder):
    assert "baked: 3 surfaces, 1 unsure" in output
    rows = re.findall(r"^baked: (\w+: by .+)$", output, re.MULTILINE)
    assert "unsure" in rows[0]
    assert any(re.match(r"OakTable: by name, \d+ %: \[wood\]", row) for row in rows)
    assert any(re.match(r"SteelKettle: by name, \d+ %: \[metal\]", row) for row in rows)
    assert "ids_differ True played True dirty True" in output  # a copy got an id of its own
    files = {path.name for path in (folder / "Room" / "HapticVLM").iterdir()}
    assert files >= {"scene.json", "materials.json", "feel.true.json", "feel.sound.json"}
    (scene,) = json.loads((folder / "Room" / "HapticVLM" / "scene.json").read_text())
    assert scene["type"] == "scene"
    assert [each["surfaces"][0]["name"] for each in scene["objects"]] == ["mat1", "mat2", "mat14"]


def test_a_correction_by_hand_is_saved_can_be_undone_and_survives_the_next_bake(output):
    by_hand = r"row mesh2057757694: by hand, 100 %: \[rubber\] file True True imported True"
    undecided = r"row mesh2057757694: by unknown, 0 %, unsure: .* file False False imported True"
    for line in (f"corrected {by_hand}", f"undone {undecided}"):
        assert re.search(line, output), output
    assert "again: 3 surfaces, 0 unsure" in output
    for line in (f"kept {by_hand}", f"withdrawn {undecided}"):
        assert re.search(line, output), output
    assert "recorded 3 exceptions 0 errors 0" in output


def test_an_editor_that_does_not_find_the_command_says_it_and_how_to_run_it(output):
    assert "an unsaved scene: Info: the scene has no file: save it" in output
    assert "no command: Warning: `/nowhere/hapticvlm` does not start here" in output
    assert re.search(r'^run hapticvlm bake ".*scene.json" -o ".*HapticVLM"$', output, re.MULTILINE)
