"""The capture generator, run until its first contact slides, in a real headless Chromium."""

import importlib.util
import json
import sys
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from PIL import Image
from toolchains import give_up, require

pytestmark = [pytest.mark.nightly, pytest.mark.browser]

SCRIPT = Path(__file__).parents[2] / "examples" / "captures" / "make" / "make_capture.py"
SHIPPED = SCRIPT.parents[1] / "living_room" / "capture.jsonl"
SECONDS = 0.65
FRAMES = 13

# The folder, what the script reports, and the lines it wrote.
Recording = tuple[Path, Any, list[dict[str, Any]]]


def generator() -> ModuleType:
    require("playwright")
    spec = importlib.util.spec_from_file_location("make_capture", SCRIPT)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    if reason := module.missing():
        give_up(reason)
    return module


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> Recording:
    folder = tmp_path_factory.mktemp("capture")
    report = generator().record(folder, SECONDS)
    lines = [json.loads(line) for line in (folder / "capture.jsonl").read_text().splitlines()]
    return folder, report, lines


def test_frames_are_at_20_hz_of_simulated_time(recorded: Recording) -> None:
    _folder, report, lines = recorded
    times = [line["t_s"] for line in lines if line["type"] == "frame"]
    assert times == pytest.approx([0.05 * i for i in range(1, FRAMES + 1)], abs=1e-3)
    assert report.frames == len(times)


def test_lines_are_in_time_order_after_the_scene(recorded: Recording) -> None:
    _folder, _report, lines = recorded
    times = [line["t_s"] for line in lines]
    assert lines[0]["type"] == "scene"
    assert times == sorted(times)


def test_pictures_are_exposed_and_masks_lie_in_their_regions(recorded: Recording) -> None:
    folder, _report, lines = recorded
    for line in (line for line in lines if line["type"] == "frame"):
        picture = np.asarray(Image.open(folder / line["file"]).convert("L"))
        assert picture.shape == (448, 448)
        assert 60 < picture.mean() < 220
        assert picture.std() > 20
        if "mask_file" in line:
            mask = np.asarray(Image.open(folder / line["mask_file"]))
            assert mask.dtype == np.uint8
            rows, columns = np.nonzero(mask)
            region = line["region"]
            assert columns.min() / 448 == pytest.approx(region["x"], abs=1e-3)
            assert rows.min() / 448 == pytest.approx(region["y"], abs=1e-3)
            assert (columns.max() + 1) / 448 == pytest.approx(region["x"] + region["w"], abs=1e-3)
            assert (rows.max() + 1) / 448 == pytest.approx(region["y"] + region["h"], abs=1e-3)


def test_the_first_touch_strikes_the_oak_table(recorded: Recording) -> None:
    _folder, report, lines = recorded
    objects = {entry["object_id"]: entry["name"] for entry in lines[0]["objects"]}
    touches = [line for line in lines if line["type"] == "touch"]
    contact = next(line for line in touches if line["phase"] == "contact")
    assert report.touches == 1
    assert objects[contact["object_id"]] == "Oak_Table_02"
    assert (contact["truth"], contact["hand"], contact["interaction"]) == (
        "wood",
        "right",
        "strike",
    )
    assert 0.3 < contact["speed_mps"] < 0.7
    assert 0.5 < contact["force_n"] < 8


def test_the_shipped_capture_begins_with_the_same_touches_and_goes_on_to_the_release(
    recorded: Recording,
) -> None:
    _folder, _report, lines = recorded
    shipped = [json.loads(line) for line in SHIPPED.read_text(encoding="utf-8").splitlines()]
    now, before = (
        [(line["t_s"], line["phase"], line["object_id"]) for line in found if "phase" in line]
        for found in (lines, shipped)
    )
    assert {phase for _t, phase, _name in now} == {"approach", "contact", "slide"}
    assert before[: len(now)] == now
    assert list(dict.fromkeys(phase for _t, phase, _name in before))[-1] == "release"


def test_the_frame_at_contact_shows_the_touched_object(recorded: Recording) -> None:
    _folder, _report, lines = recorded
    contact = next(line for line in lines if line.get("phase") == "contact")
    after = [line for line in lines if line["type"] == "frame" and line["t_s"] >= contact["t_s"]]
    assert after[0]["object_id"] == contact["object_id"]
    assert after[0]["truth"] == "wood"
    assert after[0]["region"]["w"] > 0.25
