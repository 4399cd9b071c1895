"""Real sessions are recorded and replayed: the same outputs bit for bit, or an error says why."""

import asyncio
import json
import shutil
import time

import numpy as np
import pytest
import soundfile
from conftest import peer
from in_process import hapticvlm
from scene_client import OBJECTS, frame

from hapticvlm import captures
from hapticvlm.client.local_service import running
from hapticvlm.materials import MATERIALS
from hapticvlm.recordings import replay
from hapticvlm.recordings.recorder import SESSION_LOG


async def a_scene(service):
    """Objects, frames, both hands, a stop and its release, a setting, and a refused message."""
    async with peer(service) as client:
        welcome = await client.hello()
        await client.ask(type="scene", objects=OBJECTS, ambient_c=21.0, replace=True)
        await client.ask(**frame(1, object_id="thing"))
        for number in range(12):
            phase = "contact" if number == 0 else "slide"
            await client.touch(phase, "table", speed_mps=0.1 + 0.03 * number)
            await client.touch("approach", "thing", hand="left")
            await client.ask(**frame(2 + number, region={"x": 0.2, "y": 0.2, "w": 0.5, "h": 0.5}))
        await client.ask(type="set", thermal_gain=0.5, vibration_gain=0.7)
        await client.ask(type="stop", scope="all")
        assert (await client.touch("contact", "table"))["code"] == "unsafe"
        await client.touch("release", "table")
        await client.touch("contact", "table")
        await client.telemetry()
        return welcome


@pytest.fixture(scope="module")
def record(tmp_path_factory):
    """The folder of one recorded session, frames kept, and what its welcome said."""
    folder = tmp_path_factory.mktemp("record")
    palm = ["--contact-resistance", "0.002", "--thermal-strength", "0.7"]
    with running(["--record", str(folder), "--record-frames", *palm]) as service:
        welcome = asyncio.run(a_scene(service))
        time.sleep(0.5)
    (session,) = folder.iterdir()
    return session, welcome


@pytest.fixture
def copy(record, tmp_path):
    return shutil.copytree(record[0], tmp_path / "copy")


@pytest.fixture(scope="module")
def wave(record, tmp_path_factory):
    """What is heard of the record."""
    path = tmp_path_factory.mktemp("heard") / "plain.wav"
    done = hapticvlm("replay", record[0], "--wav", path)
    assert done.code == 0, done.out + done.err
    assert "bit for bit" in done.out
    return soundfile.read(path)[0]


def test_a_record_runs_again_bit_for_bit_and_its_sound_is_the_same_each_time(
    record, wave, tmp_path
):
    again = tmp_path / "again.wav"
    told = json.loads(hapticvlm("replay", record[0], "--json", "--wav", again).out)
    assert told["replay"] == "same"
    assert told["outputs"] > 20
    head = json.loads((record[0] / "session.jsonl").read_text().splitlines()[0])["head"]
    assert (head["contact_resistance"], head["thermal_gain"]) == (0.002, 0.7)
    assert told["counts"]["recognition"] > 5
    assert np.array_equal(wave, soundfile.read(again)[0])
    assert np.abs(wave).max() > 0.01


def test_a_record_is_heard_with_other_recordings_in_place_of_synthesis(record, wave, tmp_path):
    patterns, played = tmp_path / "patterns", tmp_path / "played.wav"
    patterns.mkdir()
    hum = 0.3 * np.sin(2 * np.pi * 333.0 * np.arange(24_000) / 48_000)
    soundfile.write(patterns / "wood-slide.wav", hum, 48_000)
    done = hapticvlm("replay", record[0], "--wav", played, "--patterns", patterns)
    assert done.code == 0, done.err
    assert not np.array_equal(soundfile.read(played)[0], wave)
    refused = hapticvlm("replay", record[0], "--wav", played, "--patterns", tmp_path / "nowhere")
    assert refused.code == 2
    assert "no such folder" in refused.err


def test_welcome_says_that_frames_are_kept(record):
    assert record[1]["privacy"]["frames_stored"]


def test_a_record_is_a_capture_that_can_be_streamed(record):
    capture = captures.read(record[0])
    kinds = [line.type for line in capture.lines()]
    assert {"scene", "frame", "touch", "set", "stop"} <= set(kinds)
    pictures = [line.message()["image"] for line in capture.lines() if line.type == "frame"]
    assert len(pictures) == 13
    assert all(picture[:2] == b"\xff\xd8" for picture in pictures)


def test_decisions_lie_beside_the_session_log(record):
    rows = (record[0] / "decisions.jsonl").read_text().splitlines()
    assert {"table", "thing"} <= {json.loads(row).get("object_id") for row in rows}


def test_a_changed_touch_makes_the_outputs_differ_and_the_first_place_is_named(copy):
    log = copy / SESSION_LOG
    rows = log.read_text().splitlines(keepends=True)
    slide = next(i for i, row in enumerate(rows) if '"slide"' in row and '"in"' in row)
    rows[slide] = rows[slide].replace('"force_n": 1.5', '"force_n": 1.501')
    log.write_text("".join(rows))
    done = hapticvlm("replay", copy)
    assert done.code == 1
    assert "first: line" in done.out
    assert "NOT as recorded" in done.out


@pytest.mark.parametrize(
    ("wound", "word"),
    [
        (lambda text: text[: text.index('"slide"') + 3], "incomplete, or not JSON"),
        (lambda _: "", "head is missing"),
        (lambda text: text.replace('"materials": ["wood"', '"materials": ["velcro"'), "--gallery"),
        (lambda text: text + '{"line": 9999, "in": "message", "now": 1}\n', "not a line"),
    ],
)
def test_a_session_log_that_cannot_be_replayed_is_named_with_its_place(copy, wound, word):
    log = copy / SESSION_LOG
    log.write_text(wound(log.read_text()))
    done = hapticvlm("replay", copy)
    assert done.code == 2
    assert word in done.err
    assert len(done.err.splitlines()) == 1


def test_recognising_again_with_the_same_encoder_finds_the_same(record):
    done = hapticvlm("replay", record[0], "--recognise", "--json")
    told = json.loads(done.out)
    assert done.code == 0, done.err
    assert told["counts"]["recognised again"] == told["counts"]["recognition"]
    assert told["counts"]["recognised differently"] == 0


def test_other_digits_of_the_same_materials_are_no_difference_of_recognition(copy):
    log = copy / SESSION_LOG
    rows = [json.loads(row) for row in log.read_text().splitlines()]
    for decision in (output for row in rows for output in row.get("out", ())):
        if decision.get("confidence"):
            decision["confidence"] -= 0.001
    log.write_text("".join(json.dumps(row) + "\n" for row in rows))
    result = json.loads(hapticvlm("replay", copy, "--recognise", "--json").out)
    assert result["counts"]["recognised differently"] == 0
    assert result["differing"] > 0
    assert result["replay"] == "same"


async def test_without_being_asked_no_picture_is_kept_and_the_session_still_replays(tmp_path):
    with running(["--record", str(tmp_path)]) as service:
        welcome = await a_scene(service)
        await asyncio.sleep(0.5)
    (session,) = tmp_path.iterdir()
    assert not welcome["privacy"]["frames_stored"]
    assert sorted(path.name for path in session.iterdir()) == [
        "capture.jsonl",
        "decisions.jsonl",
        SESSION_LOG,
    ]
    outcome = replay.replay(session, MATERIALS)
    assert outcome.is_same
    assert outcome.outputs > 20
    done = hapticvlm("replay", session, "--recognise")
    assert done.code == 2
    assert "record with --record-frames" in done.err
    assert "recognised differently" not in done.out


def test_a_recorder_whose_record_is_full_counts_what_it_loses(tmp_path):
    from hapticvlm.recordings.recorder import Recorder

    recorder = Recorder(tmp_path, frames=False, max_bytes=2000)
    tell = recorder.begin({"owner": True})
    for _ in range(200):
        tell({"now": 1.0, "in": "tick", "reading": {}}, None)
        time.sleep(0.001)
    recorder.close()
    assert recorder.lost > 50
    longest = 200
    assert recorder.written_bytes < 2000 + longest
