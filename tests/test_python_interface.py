"""The Python interface: its names, what it costs to import, and what it promises."""

from __future__ import annotations

import ast
import base64
import inspect
import io
import json
import pickle
import re
import subprocess
import sys
import wave
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
from each_case import each_row
from gltf_room import SURFACES, glb, write_room
from PIL import Image

import hapticvlm
from hapticvlm import HapticVLMError
from hapticvlm.commands.main import main
from hapticvlm.demo import CAPTURE
from hapticvlm.vision.files import read_frame

NAMES = {
    "MATERIALS",
    "BlockingClient",
    "Client",
    "FeltTouch",
    "HapticVLMError",
    "PictureRecogniser",
    "RecognisedPicture",
    "Refused",
    "ScannedScene",
    "Service",
    "TouchEnded",
    "connect",
    "connect_blocking",
    "feel",
    "materials",
    "recognise",
    "scan",
    "serve",
}
HEADSET = CAPTURE / "frames"


def test_the_names_are_these_and_each_is_there_with_a_docstring_that_shows_its_errors():
    assert set(hapticvlm.__all__) == NAMES
    assert set(dir(hapticvlm)) >= NAMES
    for name in NAMES - {"MATERIALS"}:
        assert inspect.getdoc(getattr(hapticvlm, name)), name
    for name in (name for name in NAMES if inspect.isfunction(getattr(hapticvlm, name))):
        text = inspect.getdoc(getattr(hapticvlm, name)) or ""
        assert "Raises" in text, name
        assert f"hapticvlm.{name}(" in text, f"{name} shows no example"
    with pytest.raises(AttributeError, match="no attribute 'recognize'"):
        getattr(hapticvlm, "recognize")  # noqa: B009


def test_every_name_is_of_the_service_although_import_linter_reads_no_string():
    assert {module.partition(".")[0] for module in vars(hapticvlm)["_MODULES"].values()} == {
        "hapticvlm"
    }


def test_type_checkers_know_the_same_names():
    stub = ast.parse(Path(hapticvlm.__file__).with_suffix(".pyi").read_text(encoding="utf-8"))
    imported = {
        alias.asname
        for node in stub.body
        if isinstance(node, ast.ImportFrom)
        for alias in node.names
    }
    (listed,) = (node.value for node in stub.body if isinstance(node, ast.Assign))
    assert imported == set(ast.literal_eval(listed)) == NAMES


def test_the_import_loads_no_other_part_and_no_library():
    code = "import sys; before = set(sys.modules); import hapticvlm; "
    code += "print(sorted(set(sys.modules) - before))"
    out = subprocess.run(
        [sys.executable, "-S", "-c", code],
        capture_output=True,
        check=True,
        text=True,
        env={"PYTHONPATH": str(Path(hapticvlm.__file__).parents[1])},
    )
    loaded = ast.literal_eval(out.stdout)
    assert [name for name in loaded if name.startswith("hapticvlm")] == ["hapticvlm"]
    assert not {name.split(".")[0] for name in loaded} - {"hapticvlm", *sys.stdlib_module_names}


def test_a_picture_is_recognised_alike_as_file_array_and_image_and_as_the_command_does(capsys):
    path = sorted(HEADSET.glob("*.jpg"))[0]
    result = hapticvlm.recognise(path)
    with Image.open(path) as image:
        again = hapticvlm.recognise(image)
        assert hapticvlm.recognise(np.asarray(image)) == again
    assert (
        again.felt_as == result.felt_as
    )  # decoded by another library: its beliefs differ a little
    assert main(["recognise", str(path), "--json"]) == 0
    row = json.loads(capsys.readouterr().out)
    assert (row["material"], row["outlined"]) == (result.material, result.is_outlined)
    assert row["beliefs"] == {name: round(belief, 4) for name, belief in result.beliefs.items()}
    assert list(result.beliefs.values()) == sorted(result.beliefs.values(), reverse=True)
    assert result.material in result._repr_html_()


def test_a_mask_may_be_an_array_of_bool_and_only_what_is_among_is_believed():
    path = sorted(HEADSET.glob("*.jpg"))[0]
    with Image.open(path) as image:
        mask = np.zeros((image.height, image.width), bool)
    mask[40:-40, 40:-40] = True
    masked = hapticvlm.recognise(path, mask, among=["wood", "glass"])
    assert set(masked.beliefs) == {"wood", "glass"}
    assert masked == hapticvlm.recognise(path, Image.fromarray(mask), ["wood", "glass"])
    assert masked.beliefs != hapticvlm.recognise(path, among=["wood", "glass"]).beliefs


@each_row(
    ("arguments", "cure"),
    [
        ((np.zeros((9, 9, 3)),), "give uint8"),
        ((np.zeros((9, 9, 2), np.uint8),), "give uint8"),
        ((np.zeros((0, 9), np.uint8),), "give uint8"),
        ((3.5,), "give a path"),
        (("no-such.jpg",), "no-such.jpg"),
        ((np.zeros((9, 9), np.uint8), np.zeros((9, 9), bool)), "mark the object"),
        ((np.zeros((9, 9), np.uint8), np.ones((8, 9), bool)), "save both at one size"),
        ((np.zeros((9, 9), np.uint8), None, ["wodo"]), "choose from wood"),
        ((np.zeros((9, 9), np.uint8), None, "wood"), "choose from wood"),
        ((np.zeros((9, 9), np.uint8), None, []), "choose from wood"),
    ],
)
def test_a_picture_that_cannot_be_used_is_refused_with_what_to_do(arguments, cure):
    with pytest.raises(HapticVLMError, match=cure):
        hapticvlm.recognise(*arguments)


def test_every_mode_of_pillow_is_the_same_picture_or_refused_with_what_to_do():
    with Image.open(sorted(HEADSET.glob("*.jpg"))[0]) as image:
        colour, grey = image.convert("RGB"), image.convert("L")
    wide = (np.asarray(grey).astype("<u2") * 257).tobytes()
    images = [Image.frombytes("I;16", grey.size, wide), grey, grey.convert("LA").convert("PA")]
    images += [colour.convert(mode) for mode in ("RGBA", "RGBX", "CMYK", "YCbCr", "HSV")]
    images += [colour.convert("P", palette=Image.Palette.ADAPTIVE), grey.convert("LA")]
    for each in images:
        shown = Image.frombytes("RGB", grey.size, read_frame(each).image)
        is_coloured = len(each.getbands()) > 2 or each.mode == "P"
        off = np.asarray(shown, float) - np.asarray(colour if is_coloured else grey.convert("RGB"))
        assert np.abs(off).mean() < 8.0, each.mode
    for mode in ("I", "F", "La"):
        bare = (grey.convert("LA") if mode == "La" else grey).convert(mode)
        with pytest.raises(HapticVLMError, match=f"mode {mode}; convert it to mode L, RGB"):
            hapticvlm.recognise(bare)


def test_results_and_errors_go_through_queues_and_a_service_says_what_to_send_instead():
    path = sorted(HEADSET.glob("*.jpg"))[0]
    picture = hapticvlm.recognise(path)
    assert pickle.loads(pickle.dumps(picture)) == picture
    touch = hapticvlm.feel("metal", "tap", object_c=5.0)
    again = pickle.loads(pickle.dumps(touch))
    assert again.heat == touch.heat
    assert (again.vibration == touch.vibration).all()
    with hapticvlm.serve() as service, hapticvlm.connect_blocking(service.url) as client:
        with pytest.raises(hapticvlm.Refused) as refused:
            client.set(vibration_gain=2.0)
        with pytest.raises(TypeError, match="`url`"):
            pickle.dumps(service)
        client.scene([{"object_id": "o", "material": "wood"}])
        with client.touching("o"):
            decision = client.next_event("decision")
    assert pickle.loads(pickle.dumps(decision)) == decision
    error = pickle.loads(pickle.dumps(refused.value))
    assert (type(error), str(error)) == (hapticvlm.Refused, str(refused.value))
    assert error.code == refused.value.code


def test_a_scene_is_scanned_as_the_command_does(capsys, tmp_path):
    room = write_room(tmp_path / "room.glb")
    result = hapticvlm.scan(str(room))
    assert main(["scan", str(room), "--json"]) == 0
    printed = json.loads(capsys.readouterr().out)
    rows = [(row.surface, row.decision.material, row.sureness) for row in result.rows]
    wanted = [(row["surface"], row["material"], row["sureness"]) for row in printed["surfaces"]]
    assert rows == wanted
    assert len(rows) == len(SURFACES)
    assert result == hapticvlm.scan(room)
    assert result.notes == ()
    with pytest.raises(AttributeError):
        result.rows = ()  # type: ignore[misc]


def test_a_notebook_shows_the_surfaces_of_a_scene_the_least_sure_first(tmp_path):
    (tmp_path / "room.glb").write_bytes(
        glb(
            {
                "asset": {"version": "2.0"},
                "nodes": [{"name": f"OakTable{n}", "mesh": 0} for n in range(250)]
                + [{"name": "<b>Mesh</b>", "mesh": 0}],
                "meshes": [{"primitives": [{}]}],
            }
        )
    )
    drawn = hapticvlm.scan(tmp_path / "room.glb")._repr_html_()
    first = drawn.split("<tr>")[2]
    assert "&lt;b&gt;Mesh" in first
    assert "unknown" in first
    assert drawn.count("<tr>") == 1 + 200
    assert "51 surer surfaces" in drawn
    ElementTree.fromstring(f"<div>{drawn.replace('<br>', '<br/>')}</div>")


@pytest.mark.parametrize(
    ("path", "cure"), [("no-such.glb", "no-such.glb"), (".", "a folder"), (3.5, "give the path")]
)
def test_a_scene_that_cannot_be_read_is_refused_with_what_to_do(path, cure):
    with pytest.raises(HapticVLMError, match=cure):
        hapticvlm.scan(path)


def test_a_touch_is_what_the_command_computes(capsys):
    touch = hapticvlm.feel("wood", "slide", object_c=5.0, speed_mps=0.2, seconds=1.0)
    options = ["slide", "--object-c", "5", "--speed", "0.2", "--seconds", "1"]
    assert main(["feel", "wood", *options, "--json"]) == 0
    row = json.loads(capsys.readouterr().out)
    assert touch.skin_c.tolist() == row["thermal"]["skin_c"]
    assert touch.plate_c.tolist() == row["thermal"]["setpoint_c"]
    assert touch.time_s.tolist() == row["thermal"]["time_s"]
    assert touch.sound.describe() == row["vibration"]
    assert touch.vibration.shape == (touch.rate_hz,)


def test_a_material_of_your_own_is_felt():
    pine = hapticvlm.materials.derive("pine", "wood", facts={"thermal": {"conductivity": 0.1}})
    assert (
        hapticvlm.feel(pine, seconds=1.0).skin_c[-1]
        > hapticvlm.feel("wood", seconds=1.0).skin_c[-1]
    )


@pytest.mark.parametrize(
    ("arguments", "options", "cure"),
    [
        (("wodo",), {}, "nearest is `wood`"),
        (("wood", "tapp"), {}, "nearest is `tap`"),
        (("wood",), {"object_c": 1000.0}, r"object_c: 1000.0 is not within -100..400"),
        (("wood",), {"force_n": float("nan")}, r"force_n: nan is not within 0..100"),
        (("wood",), {"seconds": 0.0}, r"seconds: 0.0 is not within"),
    ],
)
def test_a_touch_out_of_range_is_refused_with_the_range(arguments, options, cure):
    with pytest.raises(HapticVLMError, match=cure):
        hapticvlm.feel(*arguments, **options)


def test_a_touch_is_saved_in_every_format_and_drawn_whole(tmp_path):
    touch = hapticvlm.feel("metal", "tap", object_c=5.0, seconds=0.5)
    for kind in ("wav", "haptic", "ahap"):
        written = touch.save(tmp_path / f"x.{kind}")
        assert all(path.stat().st_size > 100 for path in written)
        assert len(written) == 2
    with wave.open(str(tmp_path / "x.wav")) as file:
        assert file.getnframes() == touch.vibration.size
    soft = (tmp_path / "x.ahap").read_text()
    touch.save(tmp_path / "x.ahap", scale="controller")
    assert (tmp_path / "x.ahap").read_text() != soft
    drawing = touch.plot()
    drawing.save(tmp_path / "x.svg")
    root = ElementTree.parse(tmp_path / "x.svg").getroot()
    names = "".join(root.itertext())
    assert "metal at 5 degC" in names
    assert "limited by slew" in names


def test_a_notebook_draws_a_touch_and_plays_it_for_ears(tmp_path):
    touch = hapticvlm.feel("wood", "tap", seconds=0.5)
    drawing, player = touch._repr_html_().split("<br>")
    assert drawing == touch.plot().svg
    (sound,) = re.findall(r'src="data:audio/wav;base64,([^"]+)"', player)
    heard = base64.b64decode(sound)
    with wave.open(io.BytesIO(heard)) as file:
        assert file.getnframes() / file.getframerate() == pytest.approx(0.5)
    true, sound = tmp_path / "true.wav", tmp_path / "sound.wav"
    touch.save(true)
    touch.save(sound, voice="sound")
    assert _centre_hz(sound) > 3 * _centre_hz(true)
    with pytest.raises(HapticVLMError, match="voice"):
        touch.save(tmp_path / "x.haptic", voice="sound")


def _centre_hz(path):
    with wave.open(str(path)) as file:
        samples = np.frombuffer(file.readframes(file.getnframes()), "<i2")
        power = np.abs(np.fft.rfft(samples)) ** 2
        return np.average(np.fft.rfftfreq(samples.size, 1 / file.getframerate()), weights=power)


def test_a_result_is_printed_in_three_lines():
    picture = hapticvlm.recognise(np.full((64, 64, 3), 120, np.uint8))
    touch = hapticvlm.feel("wood", seconds=0.1)
    for said in (repr(touch), str(touch), str(picture)):
        assert len(said.splitlines()) == 3
    assert picture.material in str(picture)


@pytest.mark.parametrize(("name", "scale"), [("x.mp3", "palm"), ("x", "palm"), ("x.wav", "loud")])
def test_a_format_or_scale_that_does_not_exist_is_refused_with_those_that_do(tmp_path, name, scale):
    with pytest.raises(HapticVLMError, match="is not one of"):
        hapticvlm.feel("wood", "tap", seconds=0.1).save(tmp_path / name, scale=scale)
    assert list(tmp_path.iterdir()) == []
