"""The demo's capture is whole, small and true to its own format."""

import itertools

import pytest
from PIL import Image

from hapticvlm.captures import Line, read
from hapticvlm.demo import CAPTURE

TOUCHED = {"wood", "glass", "fabric", "metal", "stone", "ceramic", "rubber"}
SEEN_TOO = {"leather", "paper"}
LARGEST_BYTES = 1e6
LONGEST_GAP_S = 0.1
SHORTEST_APPROACH_S = 0.25
FOLLOWS = {
    None: {"approach"},
    "approach": {"approach", "contact", "release"},
    "contact": {"contact", "slide", "release"},
    "slide": {"contact", "slide", "release"},
    "release": {"approach"},
}


@pytest.fixture(scope="module")
def lines() -> list[Line]:
    return list(read(CAPTURE).lines())


def of(lines: list[Line], type: str) -> list[Line]:
    return [line for line in lines if line.type == type]


def per_hand(lines: list[Line]) -> list[list[Line]]:
    """The touches of each hand, in time order."""
    touches = of(lines, "touch")
    return [[t for t in touches if t.fields["hand"] == hand] for hand in ("left", "right")]


def strokes(lines: list[Line]) -> list[list[Line]]:
    """Each hand's touches, cut after every release."""
    found = []
    for touches in per_hand(lines):
        ends = [i + 1 for i, touch in enumerate(touches) if touch.fields["phase"] == "release"]
        found += [touches[a:b] for a, b in itertools.pairwise([0, *ends])]
    return found


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


def test_a_frame_names_object_region_mask_and_truth_together_or_none(lines: list[Line]) -> None:
    for frame in of(lines, "frame"):
        shown = [key in frame.fields for key in ("object_id", "region")]
        shown += [frame.mask_file is not None, frame.truth is not None]
        assert len(set(shown)) == 1, frame.t_s


def test_every_object_named_is_in_the_scene(lines: list[Line]) -> None:
    known = {entry["object_id"] for entry in lines[0].fields["objects"]}
    named = {line.fields["object_id"] for line in lines if "object_id" in line.fields}
    assert named <= known


def test_truth_is_a_known_class_and_seven_are_touched(lines: list[Line]) -> None:
    touched = {touch.truth for touch in of(lines, "touch") if touch.fields["phase"] == "contact"}
    assert touched == TOUCHED
    assert {frame.truth for frame in of(lines, "frame")} <= TOUCHED | SEEN_TOO | {None}


def test_phases_of_a_hand_follow_each_other(lines: list[Line]) -> None:
    for touches in per_hand(lines):
        phases = [None, *(touch.fields["phase"] for touch in touches)]
        for before, after in itertools.pairwise(phases):
            assert after in FOLLOWS[before]
        assert phases[-1] == "release"


def test_a_stroke_is_of_one_object_and_is_seen_coming(lines: list[Line]) -> None:
    for stroke in strokes(lines):
        assert len({touch.fields["object_id"] for touch in stroke}) == 1
        contacts = [touch.t_s for touch in stroke if touch.fields["phase"] == "contact"]
        assert contacts, f"nothing touched by {stroke[-1].t_s} s"
        assert contacts[0] - stroke[0].t_s >= SHORTEST_APPROACH_S


def test_a_hand_in_contact_is_renewed_in_time(lines: list[Line]) -> None:
    for stroke in strokes(lines):
        for before, after in itertools.pairwise(stroke):
            assert after.t_s - before.t_s <= LONGEST_GAP_S + 1e-6


def test_speed_and_force_are_humanly_possible(lines: list[Line]) -> None:
    for touch in of(lines, "touch"):
        assert 0 <= touch.fields["speed_mps"] < 3
        assert 0 <= touch.fields["force_n"] < 10


def test_an_object_fills_a_quarter_of_the_frame_when_touched(lines: list[Line]) -> None:
    frames = of(lines, "frame")
    for stroke in strokes(lines):
        contact = next(touch for touch in stroke if touch.fields["phase"] == "contact")
        frame = next(frame for frame in frames if frame.t_s >= contact.t_s)
        assert frame.fields["object_id"] == contact.fields["object_id"]
        assert frame.fields["region"]["w"] >= 0.25, contact.t_s
