"""Steps 3 to 6 of docs/tutorials/godot.md in a real engine: a new project with three boxes.

The names come from the page. The addon and the sample's script of a hand are copied, the autoload
is what enabling the plugin adds, and the mouse touches as the page says.
"""

import re
import shutil
from pathlib import Path

import pytest
from godot_pack import project_files
from godot_scene import PROJECT, SIZE, playing

pytestmark = [
    pytest.mark.nightly,
    pytest.mark.browser,
    pytest.mark.needs_toolchain("chromium", "godot"),
]

PAGE = Path(__file__).parents[2] / "docs" / "tutorials" / "godot.md"
ADDON = PROJECT / "addons" / "hapticvlm"
AUTOLOAD = "res://addons/hapticvlm/haptic_service.gd"
SETTINGS = f"""config_version=5
[application]
run/main_scene="res://boxes.tscn"
[autoload]
HapticVLM="*{AUTOLOAD}"
[rendering]
renderer/rendering_method="gl_compatibility"
renderer/rendering_method.mobile="gl_compatibility"
"""
HEAD = """[gd_scene format=3]
[ext_resource type="Script" path="res://addons/hapticvlm/haptic_object.gd" id="object"]
[ext_resource type="Script" path="res://addons/hapticvlm/haptic_pulses.gd" id="pulses"]
[ext_resource type="Script" path="res://hand.gd" id="hand"]
[sub_resource type="BoxShape3D" id="shape"]
size = Vector3(0.4, 0.4, 0.4)
[sub_resource type="BoxMesh" id="mesh"]
size = Vector3(0.4, 0.4, 0.4)
[sub_resource type="SphereShape3D" id="tip"]
radius = 0.02
[node name="Boxes" type="Node3D"]
[node name="Camera" type="Camera3D" parent="."]
transform = Transform3D(1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 3)
"""
BOX = """[node name="{name}" type="StaticBody3D" parent="."]
transform = Transform3D(1, 0, 0, 0, 1, 0, 0, 0, 1, {x}, 0, 0)
[node name="Shape" type="CollisionShape3D" parent="{name}"]
shape = SubResource("shape")
[node name="Mesh" type="MeshInstance3D" parent="{name}"]
mesh = SubResource("mesh")
[node name="HapticObject" type="Node" parent="{name}"]
script = ExtResource("object")
"""
HAND = """[node name="Hand" type="Area3D" parent="."]
transform = Transform3D(1, 0, 0, 0, 1, 0, 0, 0, 1, -2, 0, 0.5)
script = ExtResource("hand")
[node name="Tip" type="CollisionShape3D" parent="Hand"]
shape = SubResource("tip")
[node name="Pulses" type="Node" parent="Hand"]
script = ExtResource("pulses")
"""
TOLD = """extends "res://mouse_hand.gd"
func _ready() -> void:
	super()
	HapticService.current.opened.connect(func(_w: Dictionary) -> void: _say("opened", {}))
	HapticService.current.decided.connect(func(d: Dictionary) -> void: _say("decided", d))
func _process(_delta: float) -> void:
	if object != null and HapticService.current.silence().is_empty():
		_say("felt", {"name": object.get_parent().name})
func _say(what: String, detail: Dictionary) -> void:
	print("PROBE ", JSON.stringify({"what": what, "detail": detail}))
"""
APART_PX = 52  # boxes 0.8 m apart, seen by the camera of HEAD


def boxes() -> list[str]:
    """Return the names that the page gives to the boxes."""
    (line,) = [line for line in PAGE.read_text().splitlines() if "Name them" in line]
    return re.findall(r"`(\w+)`", line.split("Name them")[1])


def test_the_boxes_of_the_tutorial_are_felt_as_their_names_say(tmp_path):
    names = boxes()
    scene = HEAD + "".join(BOX.format(name=n, x=0.8 * (at - 1)) for at, n in enumerate(names))
    assert AUTOLOAD.removeprefix("res://") in (ADDON / "plugin.gd").read_text()
    for name, text in (
        ("project.godot", SETTINGS),
        ("boxes.tscn", scene + HAND),
        ("hand.gd", TOLD),
    ):
        (tmp_path / name).write_text(text)
    shutil.copytree(ADDON, tmp_path / "addons" / "hapticvlm")
    shutil.copy(PROJECT / "sample" / "mouse_hand.gd", tmp_path)
    with playing(project_files(tmp_path)) as game:
        game.wait_for("opened")
        ids = {name: f"Boxes/{name}" for name in names}  # behind its parents
        found = {}
        for at, name in enumerate(names):
            game.page.mouse.move(SIZE[0] / 2 + APART_PX * (at - 1), SIZE[1] / 2)
            game.page.mouse.down()
            game.wait_for("felt", name=name)
            found[name] = game.wait_for("decided", object_id=ids[name])["material"]
            game.page.mouse.up()
    assert found == dict(zip(names, ("wood", "metal", "fabric"), strict=True))
    assert [text for text in game.complaints if "HapticVLM" in text or "SCRIPT" in text] == []
