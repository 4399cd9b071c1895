"""The main job end to end: the recorded emulated headset session through the real service."""

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import soundfile
from PIL import Image

from hapticvlm.captures import read

CAPTURE = Path(__file__).parents[2] / "examples/captures/living_room"


@pytest.fixture(scope="module")
def demo(tmp_path_factory):
    """One run of `hapticvlm demo`, and the folder it leaves."""
    out = tmp_path_factory.mktemp("demo")
    done = subprocess.run(
        [sys.executable, "-m", "hapticvlm", "demo", "--quiet", "--out", str(out)],
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
        cwd=CAPTURE.parents[2],
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done, out


def test_every_message_is_answered_and_every_frame_decided_or_counted(demo):
    _, out = demo
    summary = json.loads((out / "summary.json").read_text())
    assert summary["unanswered"] == 0
    frames = sum(
        count
        for name, count in summary["answers"].items()
        if name.startswith(("decision", "skipped"))
    )
    assert frames == summary["sent"]["frame"] == read(CAPTURE).frames
    assert not [name for name in summary["answers"] if name.startswith("error")]


def test_no_touch_is_decided_wrongly_and_what_the_scene_can_tell_is_right(demo):
    _, out = demo
    summary = json.loads((out / "summary.json").read_text())
    outcomes = summary["touch_outcomes"]
    assert outcomes.get("wrong", 0) == 0
    assert outcomes["right"] >= 0.6 * summary["touches"]


def test_what_was_played_has_sound_in_the_touches_and_silence_between(demo):
    _, out = demo
    played, rate = soundfile.read(out / "vibration.wav", dtype="float32")
    assert rate == 48_000
    # The virtual clock drops the time it was not run in; on a busy machine that is a tenth of it.
    assert played.size / rate > 0.75 * read(CAPTURE).duration_s
    assert 0.05 < np.abs(played).max() <= 1.0
    blocks = np.abs(played[: played.size // 480 * 480]).reshape(-1, 480).max(axis=1)
    assert (blocks < 1e-4).mean() > 0.1


def test_the_plate_moves_both_ways_and_stays_within_its_limits(demo):
    _, out = demo
    events = [json.loads(line) for line in (out / "decisions.jsonl").read_text().splitlines()]
    plates = [event["plate_c"] for event in events if event["type"] == "telemetry"]
    setpoints = [event["setpoint_c"] for event in events if event["type"] == "telemetry"]
    assert 18.0 <= min(setpoints) < 29.0
    assert max(setpoints) <= 40.0
    assert 13.0 < min(plates) < 30.0
    assert max(plates) < 43.0


def test_the_pictures_it_leaves_are_not_blank(demo):
    _, out = demo
    for name in ("plate.png", "touches.png"):
        picture = np.asarray(Image.open(out / name).convert("RGB"))
        assert picture.shape[1] > 600
        assert picture.std() > 15


def test_it_ends_by_telling_how_to_go_on(demo):
    done, _ = demo
    for hint in ("http://127.0.0.1:8790/", "Unity", "vibration.wav", "touches:"):
        assert hint in done.stdout
