"""The capture format: folders and videos, read in time order, refused with file and line."""

import json
import os
import re
from pathlib import Path

import cv2
import numpy as np
import pytest
import tiny_video

from hapticvlm.captures import CENTRE, CaptureError, Recorder, Touched, read


def write(folder, *lines):
    (folder / "capture.jsonl").write_text("\n".join(json.dumps(line) for line in lines))
    return folder


def test_a_line_becomes_the_protocols_fields_with_its_pictures(tmp_path):
    (tmp_path / "a.jpg").write_bytes(b"jpeg")
    (tmp_path / "m.png").write_bytes(b"png")
    line = {"t_s": 0.5, "type": "frame", "width": 4, "region": {"x": 0}, "truth": "wood"}
    write(tmp_path, {**line, "file": "a.jpg", "mask_file": "m.png"})
    (found,) = read(tmp_path).lines()
    assert (found.t_s, found.type, found.truth) == (0.5, "frame", "wood")
    assert found.message() == {"width": 4, "image": b"jpeg", "mask": b"png"}
    os.truncate(tmp_path / "m.png", 16 * 2**20 + 1)
    with pytest.raises(
        CaptureError, match=r"m\.png: larger than 16 .*a line of the capture names it"
    ):
        found.message()


@pytest.mark.parametrize(
    ("lines", "complaint"),
    [
        ([{"type": "touch"}], "capture.jsonl:1"),
        ([{"t_s": 1.0, "type": "set"}, {"t_s": 0.5, "type": "set"}], "capture.jsonl:2"),
        ([{"t_s": 0.0, "type": "frame", "file": "../../etc/passwd"}], "outside the capture"),
        ([[1, 2]], "capture.jsonl:1"),
    ],
)
def test_a_wrong_line_is_named(tmp_path, lines, complaint):
    with pytest.raises(CaptureError, match=re.escape(complaint)):
        read(write(tmp_path, *lines))


def test_neither_folder_nor_video_is_a_clear_error(tmp_path):
    with pytest.raises(CaptureError, match="neither a folder"):
        read(Path(__file__))
    with pytest.raises(CaptureError, match="no such file or folder"):
        read(tmp_path / "nothing.mp4")
    with pytest.raises(CaptureError, match=r"capture\.jsonl"):
        read(tmp_path)


def test_a_file_that_only_calls_itself_a_video_is_a_clear_error(tmp_path):
    for name in ("fake.mp4", "fake.mkv", "fake.webm", "fake.mov", "fake.AVI"):
        (tmp_path / name).write_bytes(b"not a video")
        with pytest.raises(CaptureError, match=f"{name}: not a video"):
            read(tmp_path / name)


def test_a_video_gives_its_frames_at_their_times_with_the_sidecars_touches(tmp_path):
    path = tmp_path / "quest.avi"
    video = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*"MJPG"), 10.0, (64, 48))
    for shade in range(0, 200, 20):
        video.write(np.full((48, 64, 3), shade, np.uint8))
    video.release()
    touch = {"t_s": 0.25, "type": "touch", "phase": "contact"}
    path.with_suffix(".jsonl").write_text(json.dumps(touch), encoding="utf-8-sig")
    capture = read(path)
    lines = list(capture.lines())
    assert (capture.frames, [line.t_s for line in lines[:5]]) == (10, [0.0, 0.1, 0.2, 0.25, 0.3])
    assert lines[3].type == "touch"
    fields = lines[0].message()
    assert (fields["width"], fields["height"], fields["format"]) == (64, 48, "jpeg")
    assert fields["image"][:2] == b"\xff\xd8"


def test_what_is_recorded_can_be_read(tmp_path):
    recorder = Recorder(tmp_path / "capture.jsonl")
    recorder.write(1.23456789, {"type": "touch", "phase": "contact"}, truth="wood")
    recorder.close()
    (line,) = read(tmp_path).lines()
    assert (line.t_s, line.fields, line.truth) == (1.234568, {"phase": "contact"}, "wood")


def decoded(line):
    return cv2.imdecode(np.frombuffer(line.image, np.uint8), cv2.IMREAD_COLOR)


def frames(path, *options):
    return [line for line in read(path, *options).lines() if line.type == "frame"]


def test_without_touches_the_middle_of_a_video_is_one_object(tmp_path):
    path = tiny_video.write(tmp_path / "quest.mp4", tiny_video.shades(3))
    capture = read(path)
    scene, *rest = capture.lines()
    assert (scene.type, scene.fields["objects"]) == ("scene", [{"object_id": CENTRE}])
    assert capture.touched == Touched(0.4)
    for line in rest:
        assert line.fields["object_id"] == CENTRE
        assert line.fields["region"] == pytest.approx({"x": 0.3, "y": 0.3, "w": 0.4, "h": 0.4})
    whole = frames(path, None, Touched(1.0))
    assert whole[0].fields["region"] == {"x": 0.0, "y": 0.0, "w": 1.0, "h": 1.0}


def test_frames_of_a_variable_rate_keep_their_own_times(tmp_path):
    path = tiny_video.write(tmp_path / "screen.mp4", tiny_video.shades(6))
    lasting = [0.5, 0.5, 2.0, 0.5, 1.5, 1.0]
    tiny_video.retime(path, lasting)
    times = [line.t_s for line in frames(path)]
    assert times == pytest.approx([0.0, *np.cumsum(lasting[:-1]) / 10.0], abs=1e-3)


def test_a_video_filmed_with_the_camera_turned_is_upright(tmp_path):
    picture = np.zeros((48, 64, 3), np.uint8)
    picture[:, :32] = 200  # light on the left: turned clockwise, on top
    path = tiny_video.write(tmp_path / "turned.mp4", [picture] * 2)
    tiny_video.turn(path)
    line = frames(path)[0]
    assert (line.fields["width"], line.fields["height"]) == (48, 64)
    upright = decoded(line)
    assert upright.shape == (64, 48, 3)
    assert upright[:24].mean() > 180
    assert upright[40:].mean() < 20


def test_one_eye_of_two_side_by_side_is_taken(tmp_path):
    both = np.zeros((48, 128, 3), np.uint8)
    both[:, :64], both[:, 64:] = 60, 180
    path = tiny_video.write(tmp_path / "stereo.mp4", [both] * 2)
    for view, shade in (("left", 60), ("right", 180)):
        line = frames(path, view)[0]
        assert (line.fields["width"], line.fields["height"]) == (64, 48)
        assert decoded(line).mean() == pytest.approx(shade, abs=8)


def test_a_picture_larger_than_a_service_takes_is_halved(tmp_path):
    wide = np.full((64, 4160, 3), 120, np.uint8)
    line = frames(tiny_video.write(tmp_path / "wide.mp4", [wide]))[0]
    assert (line.fields["width"], line.fields["height"]) == (2080, 32)


def damaged(folder, how):
    path = tiny_video.write(folder / "quest.mp4", tiny_video.shades(4))
    match how:
        case "cut":
            path.write_bytes(path.read_bytes()[:100])
        case "empty":
            path.write_bytes(b"")
        case "no frames":
            tiny_video.blank(path)
    return path


@pytest.mark.parametrize(
    ("how", "complaint"),
    [
        ("cut", "not a video that OpenCV can read"),
        ("empty", "not a video that OpenCV can read"),
        ("no frames", "no frame can be decoded"),
    ],
)
def test_a_damaged_video_is_a_clear_error(tmp_path, how, complaint):
    with pytest.raises(CaptureError, match=rf"quest\.mp4: {complaint}"):
        read(damaged(tmp_path, how))


def test_what_does_not_fit_the_capture_is_refused(tmp_path):
    path = tiny_video.write(tmp_path / "quest.mp4", tiny_video.shades(2, width=48))
    with pytest.raises(CaptureError, match="not two eyes side by side"):
        read(path, "left")
    path.with_suffix(".jsonl").write_text("")
    with pytest.raises(CaptureError, match=r"quest\.jsonl beside it"):
        read(path, None, Touched(0.5))
    with pytest.raises(CaptureError, match="for videos"):
        read(write(tmp_path, {"t_s": 0.0, "type": "set"}), "left")
