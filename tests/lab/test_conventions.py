"""Conventions of pictures: each changes what it says, and fates of decisions are counted."""

import json
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from hapticvlm.commands.main import main
from hapticvlm_lab.bench.material.conventions import (
    CONVENTIONS,
    fate_of,
    foveated,
    letterboxed,
    moved,
)

FRAMES = Path(__file__).parents[2] / "service/hapticvlm/demo/capture/frames"


def noise() -> Image.Image:
    pixels = np.random.default_rng(1).integers(0, 256, (90, 160, 3), dtype=np.uint8)
    return Image.fromarray(pixels)


@pytest.mark.parametrize("name", CONVENTIONS)
def test_a_convention_changes_the_picture_and_not_the_one_it_is_given(name):
    image = noise()
    shown = CONVENTIONS[name](image)

    assert np.array_equal(np.asarray(image), np.asarray(noise()))
    assert shown.size != image.size or not np.array_equal(np.asarray(shown), np.asarray(image))


def test_each_does_what_it_says():
    image = noise()
    assert letterboxed(image, 0.5).size == (160, 180)
    centre = (slice(43, 47), slice(78, 82))
    fovea = np.asarray(foveated(image))
    assert np.array_equal(fovea[centre], np.asarray(image)[centre])
    assert fovea[:10].std() < 0.5 * np.asarray(image)[:10].std()
    point = Image.new("RGB", (64, 8))
    point.putpixel((32, 4), (255, 255, 255))
    assert np.count_nonzero(np.asarray(moved(point, 9))[4, :, 0]) == 9


def test_a_decision_is_kept_lost_or_another():
    assert fate_of("wood", "wood") == "kept"
    assert fate_of("wood", "unknown") == "unknown"
    assert fate_of("wood", "glass") == "another"


@pytest.mark.nightly
def test_the_command_writes_a_table_and_a_chart(tmp_path, capsys):
    asked = ["stability", "conventions", str(FRAMES), "--limit", "12", "--out", str(tmp_path)]
    assert main([*asked, "--json"]) == 0
    report = json.loads(capsys.readouterr().out)

    assert set(report["conventions"]) == set(CONVENTIONS)
    assert all(sum(row.values()) == report["decided"] for row in report["conventions"].values())
    assert report["conventions"]["alpha of 0"]["kept"] == report["decided"]
    assert (tmp_path / "stability-conventions.png").read_bytes().startswith(b"\x89PNG")


def test_a_folder_without_pictures_is_named(tmp_path, capsys):
    assert main(["stability", "conventions", str(tmp_path / "none"), "--out", str(tmp_path)]) == 2
    assert "no such folder" in capsys.readouterr().err
