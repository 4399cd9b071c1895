"""The demo's capture is whole and small, and its pictures and truths can be read."""

import pytest
from PIL import Image

from hapticvlm.captures import Line, read
from hapticvlm.demo import CAPTURE

TOUCHED = {"wood", "glass", "fabric", "metal", "stone", "ceramic", "rubber"}
SEEN_TOO = {"leather", "paper"}
LARGEST_BYTES = 1e6


@pytest.fixture(scope="module")
def lines() -> list[Line]:
    return list(read(CAPTURE).lines())


def of(lines: list[Line], type: str) -> list[Line]:
    return [line for line in lines if line.type == type]


def test_a_capture_opens_with_its_scene_and_lasts_20_seconds(lines: list[Line]) -> None:
    assert [line.type for line in lines].index("scene") == 0
    assert len(of(lines, "scene")) == 1
    assert 20 <= lines[-1].t_s <= 21


def test_every_picture_and_mask_exists_and_decodes(lines: list[Line]) -> None:
    for frame in of(lines, "frame"):
        assert frame.file is not None
        with Image.open(frame.file) as picture:
            assert (picture.format, picture.size) == ("JPEG", (320, 320))
            picture.load()
        if frame.mask_file is not None:
            with Image.open(frame.mask_file) as mask:
                assert (mask.format, mask.mode, mask.size) == ("PNG", "L", (320, 320))
                assert mask.getbbox() is not None


def test_no_file_is_left_over_and_all_are_small_together(lines: list[Line]) -> None:
    named = {path for frame in of(lines, "frame") for path in (frame.file, frame.mask_file) if path}
    on_disk = {*CAPTURE.glob("frames/*"), *CAPTURE.glob("masks/*")}
    assert {path.resolve() for path in on_disk} == {path.resolve() for path in named}
    files = [path for path in CAPTURE.rglob("*") if path.is_file()]
    assert sum(path.stat().st_size for path in files) < LARGEST_BYTES


def test_truth_is_a_known_class_and_seven_are_touched(lines: list[Line]) -> None:
    touched = {touch.truth for touch in of(lines, "touch") if touch.fields["phase"] == "contact"}
    assert touched == TOUCHED
    assert {frame.truth for frame in of(lines, "frame")} <= TOUCHED | SEEN_TOO | {None}
