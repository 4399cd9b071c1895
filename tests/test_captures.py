"""The capture format: folders and videos, read in time order, refused with file and line."""

import json
import re

import numpy as np
import pytest

from hapticvlm.captures import CaptureError, Recorder, read


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
    assert found.message(with_mask=False) == {"width": 4, "image": b"jpeg", "region": {"x": 0}}


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
        read(tmp_path / "nothing")
    with pytest.raises(CaptureError, match=r"capture\.jsonl"):
        read(tmp_path)


def test_a_file_that_only_calls_itself_a_video_is_a_clear_error(tmp_path):
    (tmp_path / "fake.mp4").write_bytes(b"not a video")
    with pytest.raises(CaptureError, match=r"fake\.mp4"):
        read(tmp_path / "fake.mp4")


def test_a_video_gives_its_frames_at_their_times_with_the_sidecars_touches(tmp_path):
    cv2 = pytest.importorskip("cv2")
    path = tmp_path / "quest.avi"
    video = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*"MJPG"), 10.0, (64, 48))
    for shade in range(0, 200, 20):
        video.write(np.full((48, 64, 3), shade, np.uint8))
    video.release()
    touch = {"t_s": 0.25, "type": "touch", "phase": "contact"}
    path.with_suffix(".jsonl").write_text(json.dumps(touch))
    capture = read(path)
    lines = list(capture.lines())
    assert (capture.frames, [line.t_s for line in lines[:5]]) == (10, [0.0, 0.1, 0.2, 0.25, 0.3])
    assert lines[3].type == "touch"
    fields = lines[0].message()
    assert (fields["width"], fields["height"], fields["format"]) == (64, 48, "jpeg")
    assert fields["image"][:2] == b"\xff\xd8"


def test_what_is_recorded_can_be_read(tmp_path):
    recorder = Recorder(tmp_path / "capture.jsonl")
    recorder.write(0.25, {"type": "touch", "phase": "contact"}, truth="wood")
    recorder.close()
    (line,) = read(tmp_path).lines()
    assert (line.t_s, line.fields, line.truth) == (0.25, {"phase": "contact"}, "wood")
