"""The menu entry, the inspectors and the scan of a scene, in the stand-in of the editor."""

import re

import pytest
from mono import PACKAGE

from hapticvlm.materials import MATERIALS

pytest_plugins = ("mono_build",)
NOBODY = "ws://127.0.0.1:9/"


@pytest.fixture
def side():
    return 448  # of a scan


@pytest.mark.parametrize(
    ("rig", "left", "right"),
    [
        ("XROrigin", "Left Controller", "Right Controller"),
        ("OVRCameraRig", "LeftHandAnchor", "RightHandAnchor"),
        ("", "Main Camera", "Main Camera"),
    ],
)
def test_one_menu_entry_sets_up_a_scene_and_can_be_undone(play, rig, left, right):
    output = play("EditMode.SetUp", rig)
    whole = f"clients 1 objects 2 hands Left@{left}+c Right@{right}+c"  # +: complete, c: controller
    assert f"first: {whole}" in output
    assert f"again: {whole}" in output
    assert "tagged 1100" in output  # table and body, not the handle or the trigger zone
    assert re.search(r"undone: clients 0 objects 0 hands\s", output)
    assert "selection tagged 10" in output
    assert "Start `hapticvlm serve` and press Play" in output


def test_set_up_puts_hands_where_controllers_poke_and_on_all_tracked_fingertips(play):
    output = play("EditMode.SetUpTrackedHands", NOBODY)
    tips = ("IndexTip", "LittleTip", "MiddleTip", "Palm", "RingTip", "ThumbTip")
    line = next(line for line in output.splitlines() if line.startswith("hands: "))
    for side in ("Left", "Right"):
        assert f"{side}@Poke Point+c" in line  # c: only there, since one controller plays once
        for tip in tips:
            assert f"{side}@{side[0]}_{tip}+" in line
    assert line.count("@") == 2 * (1 + len(tips))
    assert line.count("+c") == 2
    assert "in a prefab: clients 0 objects 0" in output
    assert "a prefab is open: close it" in output
    assert "tagged by a selection without colliders 0" in output
    assert "nothing of the selection has a collider" in output


def test_inspectors_warn_and_offer_materials_beside_free_text(play):
    output = play("EditMode.Inspectors", NOBODY)
    assert "Warning: Not felt: it has no collider, so no hand can touch it" in output
    assert "Warning: Not felt: it has no collider: add a Sphere Collider" in output
    assert "chosen metal" in output
    assert "Material: [another ...]" in output  # a material missing in the list
    assert "several True looked at metal 15 chosen wood 30" in output


def test_the_window_of_10_000_objects_draws_the_rows_in_sight(play):
    found = re.search(r"rows (\d+) last True Scene: 10001", play("EditMode.LargeScene", NOBODY))
    assert found
    assert 10 < int(found.group(1)) < 30


def test_the_editor_offers_the_materials_of_the_service():
    source = (PACKAGE / "Editor" / "MaterialNames.cs").read_text()
    (listed,) = re.findall(r"Shipped = \{ (.*?) \}", source)
    assert re.findall(r'"(\w+)"', listed) == list(MATERIALS)


def test_a_scan_tags_every_object_once_and_a_person_may_correct_it(play):
    output = play("EditMode.Scan")
    assert "Scan: 2 of 2 objects tagged; save the scene to keep them" in output
    assert re.search(r"OakPlanks: wood, by Name, \d+ %", output)
    assert re.search(r"SteelKettle: metal, by Name, \d+ %", output)
    assert "ids_differ True stated wood metal glass saved True exceptions 0 errors 0" in output
    assert "after review fabric" in output
    assert "left textures 0" in output
