"""Crops of game kits: which kits may teach, and how their objects are drawn."""

import base64
import json
import os
import shutil
import sys
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("playwright.sync_api", reason="no playwright: pip install -e '.[dev]'")

from room_data import write_data

from hapticvlm.materials import UNKNOWN
from hapticvlm_lab.training import kits, sources
from hapticvlm_lab.training.rooms import page

pytestmark = [pytest.mark.nightly, pytest.mark.browser, pytest.mark.slow]

TEACHES, HELD_BACK = "kaykit_city", "kenney_survival"
LABELS = (
    ("crate", "wood", ""),
    ("pipe", "metal", ""),
    ("barrel", "mixed", ""),
    ("bone", "other", ""),
    ("rug", "fabric", "UNCLEAR painted"),
)


def box(colour: tuple[float, float, float]) -> str:
    """A cube of 20 units a side as glTF with its buffer inside."""
    corners = [[x, y, z] for x in (0, 20) for y in (0, 20) for z in (0, 20)]
    faces = [0, 1, 3, 0, 3, 2, 4, 6, 7, 4, 7, 5, 0, 4, 5, 0, 5, 1]
    faces += [2, 3, 7, 2, 7, 6, 0, 2, 6, 0, 6, 4, 1, 5, 7, 1, 7, 3]
    data = np.array(corners, "<f4").tobytes() + np.array(faces, "<u2").tobytes()
    look = {"baseColorFactor": [*colour, 1.0], "metallicFactor": 0.0}
    uri = "data:application/octet-stream;base64," + base64.b64encode(data).decode()
    views = [{"buffer": 0, "byteOffset": 0, "byteLength": 96}]
    views.append({"buffer": 0, "byteOffset": 96, "byteLength": 72})
    places = {"bufferView": 0, "componentType": 5126, "count": 8, "type": "VEC3"}
    places |= {"min": [0, 0, 0], "max": [20, 20, 20]}
    return json.dumps(
        {
            "asset": {"version": "2.0"},
            "scene": 0,
            "scenes": [{"nodes": [0]}],
            "nodes": [{"mesh": 0}],
            "meshes": [
                {"primitives": [{"attributes": {"POSITION": 0}, "indices": 1, "material": 0}]}
            ],
            "materials": [{"pbrMetallicRoughness": look}],
            "accessors": [
                places,
                {"bufferView": 1, "componentType": 5123, "count": 36, "type": "SCALAR"},
            ],
            "bufferViews": views,
            "buffers": [{"uri": uri, "byteLength": len(data)}],
        }
    )


@pytest.fixture(scope="module")
def data(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A data folder in small with a kit that may teach and one that is held back."""
    folder = write_data(tmp_path_factory.mktemp("data"))
    lines = ["path,class,part,licence,source,style,note"]
    for kit in (TEACHES, HELD_BACK):
        (folder / "kits" / kit).mkdir(parents=True)
        for place, (name, material, note) in enumerate(LABELS):
            colour = (0.9, 0.2 * place, 0.1)
            (folder / "kits" / kit / f"{name}.gltf").write_text(box(colour))
            lines.append(f"{kit}/{name}.gltf,{material},,CC0-1.0,,,{note}")
    (folder / "kits" / "labels.csv").write_text("\n".join(lines) + "\n")
    return folder


def test_kits_are_held_back_whole_and_the_rest_may_teach(data: Path) -> None:
    assert kits.kits(data, held_back=False) == [TEACHES]
    assert kits.kits(data, held_back=True) == [HELD_BACK]


def test_what_is_mixed_or_doubtful_has_no_label(data: Path) -> None:
    labels = {Path(prop.path).stem: prop.label for prop in sources.props(data)}
    assert labels["crate"] == "wood"
    assert [labels[name] for name in ("barrel", "bone", "rug")] == [UNKNOWN] * 3


def test_a_round_shows_each_labelled_object_once_and_nothing_beside_itself() -> None:
    labels = ["wood", UNKNOWN, "metal", *["stone"] * 9, UNKNOWN]
    rooms = list(kits.plan(labels, np.random.default_rng(1)))
    shown = [place for room, _ in rooms for place in room]
    assert sorted(shown) == [at for at, label in enumerate(labels) if label != UNKNOWN]
    assert all(len(room) <= kits.SHOWN and not set(room) & set(beside) for room, beside in rooms)


def test_a_kit_is_drawn_with_the_masks_of_its_objects(tmp_path: Path, data: Path) -> None:
    has_tools = shutil.which("chromium") and page.THREE.is_dir()
    if not has_tools and not os.environ.get("CI"):
        pytest.skip(f"no chromium, or no three.js: npm ci --prefix {page.HERE}")
    kits.draw(data, tmp_path, [TEACHES])
    with np.load(tmp_path / f"{TEACHES}.npz", allow_pickle=False) as file:
        big, labels, paths = file["big"], file["label"].tolist(), file["path"].tolist()
    assert {(Path(path).stem, label) for path, label in zip(paths, labels, strict=True)} == {
        ("crate", "wood"),
        ("pipe", "metal"),
    }
    assert big.shape[1:] == (224, 224, 4)
    redder = [np.mean(crop[..., 0] > crop[..., 2], where=crop[..., 3] > 0) for crop in big]
    assert np.median(redder) > 0.9  # the boxes are orange, their surroundings seldom are


def test_the_page_is_given_the_files_of_the_chosen_kit_alone(data: Path) -> None:
    has_tools = shutil.which("chromium") and page.THREE.is_dir()
    if not has_tools and not os.environ.get("CI"):
        pytest.skip(f"no chromium, or no three.js: npm ci --prefix {page.HERE}")
    ask = (
        "async names => (await Promise.all(names.map(n => fetch('/data/' + n)))).map(a => a.status)"
    )
    asked = [f"kits/{kit}/crate.gltf" for kit in (TEACHES, HELD_BACK)]
    with page.opened(data, [data / "kits" / TEACHES]) as rooms:
        assert rooms.page.evaluate(ask, asked) == [200, 404]


def test_a_folder_without_kits_is_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    pytest.importorskip("torch", reason="extra `train` is not installed")
    from hapticvlm_lab.training.__main__ import main

    arguments = ["training", "--data", str(tmp_path), "--work", str(tmp_path / "out")]
    monkeypatch.setattr(sys, "argv", [*arguments, "--only", "held-back"])
    assert main() == 2
    assert "labels.csv is missing" in capsys.readouterr().err
