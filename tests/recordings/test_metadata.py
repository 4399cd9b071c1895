"""Recorded pictures lose place, device and small copies, and not a pixel."""

import io
from typing import Any

import numpy as np
from each_case import each
from PIL import Image, PngImagePlugin
from profiles import profile_with_red_and_green_swapped

from hapticvlm.messages import Frame
from hapticvlm.recordings.metadata import without_metadata
from hapticvlm.recordings.recorder import Recorder

SHOWN = Image.fromarray(np.random.default_rng(5).integers(0, 255, (48, 80, 3), np.uint8))
MAKER, PLACE, ORIENTATION = 0x010F, 0x8825, 0x0112


def photograph(form: str = "JPEG", order: str = ">", **options: Any) -> bytes:
    exif = Image.Exif()
    exif.endian = order
    exif[MAKER], exif[ORIENTATION] = "PhoneMaker", 6
    exif[PLACE] = {1: "N", 2: (48.0, 8.0, 7.5), 29: "2026:11:28"}
    data = io.BytesIO()
    profile = profile_with_red_and_green_swapped()
    SHOWN.save(data, form, exif=exif, icc_profile=profile, **options)
    return data.getvalue()


def note() -> PngImagePlugin.PngInfo:
    notes = PngImagePlugin.PngInfo()
    notes.add_text("Place", "PhoneMaker")
    return notes


PICTURES = {
    "baseline": photograph(),
    "another order of bytes": photograph(order="<"),
    "progressive": photograph(progressive=True),
    "restarts": photograph(restart_marker_blocks=2),
    "comment": photograph(comment="PhoneMaker"),
    "two pictures": photograph("MPO", save_all=True, append_images=[SHOWN]),
    "stray bytes": photograph()[:-2] + b"\0\0" + photograph()[-2:],
    "png": photograph("PNG", pnginfo=note()),
}


@each(kind=list(PICTURES))
def test_the_orientation_and_colours_stay_and_nothing_else_beside_the_pixels(kind: str) -> None:
    data = PICTURES[kind]
    kept = without_metadata("png" if kind == "png" else "jpeg", data)
    assert b"PhoneMaker" in data
    assert b"PhoneMaker" not in kept
    with Image.open(io.BytesIO(data)) as before, Image.open(io.BytesIO(kept)) as after:
        assert np.array_equal(np.asarray(before), np.asarray(after))
        assert after.info["icc_profile"] == before.info["icc_profile"]
        assert dict(after.getexif()) == ({} if kind == "png" else {ORIENTATION: 6})


@each(size=[0, 1, 3, 30, 400])
def test_bytes_without_an_end_stay_as_they_are(size: int) -> None:
    for form, data in (("jpeg", photograph()), ("png", photograph("PNG"))):
        assert without_metadata(form, data[:size]) == data[:size]


def test_a_recorder_strips_what_it_keeps(tmp_path: Any) -> None:
    recorder = Recorder(tmp_path, frames=True)
    tell = recorder.begin({"owner": True})
    frame = Frame(1, 0.0, "jpeg", *SHOWN.size, photograph(), "top", mask=b"four")
    tell({"now": 1.0, "in": "tick", "reading": {}}, frame)
    recorder.close()
    (kept,) = tmp_path.glob("*/frames/*.jpg")
    assert kept.read_bytes() == without_metadata("jpeg", photograph())
    files = [each for each in tmp_path.glob("**/*") if each.is_file()]
    assert recorder.written_bytes == sum(each.stat().st_size for each in files)
