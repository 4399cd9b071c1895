"""The session log is a file format: its names stay when code is renamed."""

import json
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from recorded_session import record

from hapticvlm.commands.main import main
from hapticvlm.evidence.ladder import Evidence
from hapticvlm.materials import MATERIALS
from hapticvlm.messages import Frame, Scene, SceneObject, Stop, Touch
from hapticvlm.recordings import recorded_session as recorded
from hapticvlm.recordings import timeline
from hapticvlm.recordings.lines import Input, Output
from hapticvlm.recordings.recorded_session import RecordedSession
from hapticvlm.recordings.recorder import SESSION_LOG
from hapticvlm.recordings.replay import replay, waveform
from hapticvlm.recordings.session_log import SessionLogError, read_session_log
from hapticvlm.rendering.heat.limits import AT_REST
from hapticvlm.rendering.vibration.voices import Voices
from hapticvlm.session.hands import Hold
from hapticvlm.session.settings import SessionSettings
from hapticvlm.session.targets import RecognitionRequest

PICTURE = Frame(
    id=2,
    captured_at=0.0,
    format="rgb8",
    width=1,
    height=1,
    origin="top",
    image=b"abc",
    object_id="blob",
)
VERSION_2 = Path(__file__).parent / "version_2"


def test_the_names_in_a_session_log_are_those_of_format_version_2():
    lines = []
    given: dict[str, Any] = {"captured_at": 1.0, "hand": "right", "speed_mps": 0.3, "force_n": 1.0}
    session = RecordedSession(
        SessionSettings(owner=True), None, write_line=lambda line, _: lines.append(line)
    )
    table = SceneObject(object_id="table", material="wood")
    session.receive(Scene(id=1, objects=[table], replace=True), 0.0)
    session.receive(Touch(id=2, phase="contact", object_id="table", **given), 1.0)
    session.tick(1.02, AT_REST)
    session.receive(Touch(id=3, phase="release", object_id="table", **given), 1.1)
    session.tick(60.0, AT_REST)
    session.receive(Stop(id=4, scope="all"), 61.0)
    outputs = [output for line in lines for output in line.get("out", [])]
    names = [output["do"] for output in outputs]
    assert names == [
        "play_vibration",
        "decision",
        "drive_plate",
        "release_hand",
        "rest_plate",
        "hold_outputs",
    ]
    assert outputs[0]["command"]["motion"] == {"speed_mps": 0.3, "force_n": 1.0}
    assert [line["in"] for line in lines if "in" in line][:3] == ["message", "message", "tick"]


@pytest.mark.parametrize(("feel", "basis"), [("full", "least_error"), ("graded", "expectation")])
def test_a_log_says_how_its_session_was_felt_and_one_that_does_not_was_graded(feel, basis):
    lines: list[dict[str, Any]] = []
    settings = SessionSettings(owner=True, feel=feel)
    session = RecordedSession(settings, None, write_line=lambda line, _: lines.append(line))
    session.receive(Scene(id=1, objects=[SceneObject(object_id="blob")], replace=True), 0.0)
    (looked,) = session.receive(PICTURE, 1.0)
    assert isinstance(looked, RecognitionRequest)
    session.recognised(looked, Evidence("encoder", (("metal", 0.4), ("glass", 0.4))), {}, 1.1)
    (decision,) = (output for line in lines for output in line.get("out", []))
    assert decision["basis"] == basis
    head = recorded.head(settings, Hold())
    assert recorded.settings_of(head, MATERIALS).feel == feel
    del head["feel"]
    assert recorded.settings_of(head, MATERIALS).feel == "graded"


def test_a_session_of_version_2_replays_bit_for_bit_with_every_kind_of_line():
    # A record holds the name of an object and not what was believed of it: when the word lists
    # change, old records differ in that belief. The one number in this file is today's.
    outcome = replay(VERSION_2, MATERIALS)
    assert outcome.is_same, outcome.first_difference
    assert outcome.outputs == 32
    assert set(outcome.counts) == set(Input)
    lines = list(read_session_log(VERSION_2))
    assert {output["do"] for line in lines for output in line.get("out", [])} == set(Output)
    wave = waveform(outcome, Voices())
    assert np.abs(wave).max() > 0.01
    assert np.array_equal(wave, waveform(replay(VERSION_2, MATERIALS), Voices()))
    assert {touch.object_id for touch in timeline.read(VERSION_2, MATERIALS, Voices()).touches} >= {
        "mug",
        "thing",
        "stool",
    }


@pytest.mark.parametrize(
    ("field", "other"),
    [('"force_n": 1.0', '"force_n": 1.5'), ('"setpoint_c": 32.2', '"setpoint_c": 32.3')],
)
def test_a_change_in_a_session_of_version_2_makes_its_replay_differ(field, other, tmp_path):
    copy = shutil.copytree(VERSION_2, tmp_path / "copy")
    log = copy / SESSION_LOG
    log.write_text(log.read_text().replace(field, other, 1))
    assert replay(copy, MATERIALS).differing > 0


def test_a_damaged_line_is_named_with_its_place(tmp_path):
    copy = shutil.copytree(VERSION_2, tmp_path / "copy")
    log = copy / SESSION_LOG
    log.write_text(log.read_text().replace('"phase": "contact"', '"phase": 1', 1))
    with pytest.raises(SessionLogError, match=r"session\.jsonl:\d+: .*line"):
        replay(copy, MATERIALS)


@pytest.mark.parametrize("version", [3, 1, 0, "two", None, [1]])
def test_a_session_of_an_unknown_version_is_refused_with_the_version_that_is_read(
    version, tmp_path
):
    head = {"line": 0, "head": {"version": version}}
    (tmp_path / SESSION_LOG).write_text(json.dumps(head) + "\n")
    with pytest.raises(
        SessionLogError, match=r"session\.jsonl:1: format version .*reads 2: update"
    ):
        replay(tmp_path, MATERIALS)


def test_a_log_that_lacks_a_line_and_replays_the_same_is_called_incomplete(tmp_path, capsys):
    session = record(tmp_path)
    log = session / SESSION_LOG
    rows = log.read_text().splitlines(keepends=True)
    lost = next(number for number, row in enumerate(rows) if '"tick"' in row)
    log.write_text("".join(rows[:lost] + rows[lost + 1 :]))
    assert main(["replay", str(session), "--json"]) == 1
    result = json.loads(capsys.readouterr().out)
    assert (result["replay"], result["missing"], result["differing"]) == ("incomplete", 1, 0)
    assert main(["replay", str(session)]) == 1
    assert "None" not in capsys.readouterr().out
