"""A session that began under a stop, or beside one that lifts it, replays the same."""

import random
from contextlib import suppress
from typing import Any

from hapticvlm.materials import MATERIALS
from hapticvlm.messages import MessageError, Scene, SceneObject, Touch
from hapticvlm.recordings import recorded_session as recorded
from hapticvlm.recordings.recorder import Recorder
from hapticvlm.recordings.replay import replay
from hapticvlm.rendering.heat.limits import AT_REST
from hapticvlm.session.hands import Hold
from hapticvlm.session.settings import SessionSettings

GIVEN: dict[str, Any] = {"captured_at": 1.0, "hand": "right", "speed_mps": 0.3, "force_n": 1.0}
TABLE = SceneObject(object_id="table", material="wood")


def touch(phase, id):
    return Touch(id=id, phase=phase, object_id="table", **GIVEN)


def recording(folder, hold):
    recorder = Recorder(folder, frames=False)
    settings = SessionSettings(owner=True)
    write = recorder.begin(recorded.head(settings, hold))
    session = recorded.RecordedSession(settings, hold, write_line=write)
    session.receive(Scene(id=1, objects=[TABLE], replace=True), 0.0)
    return recorder, session


def replayed(folder, recorder):
    recorder.close()
    (session,) = folder.iterdir()
    return replay(session, MATERIALS)


def test_a_session_begun_under_a_stop_replays_the_same(tmp_path):
    hold = Hold()
    hold.stop("speaker")
    recorder, session = recording(tmp_path, hold)
    session.receive(touch("contact", 2), 1.0)
    session.tick(1.02, AT_REST)
    outcome = replayed(tmp_path, recorder)
    assert outcome.is_same, outcome.first_difference
    assert not outcome.sounds


def test_a_hold_that_another_session_lifts_just_before_a_stop_is_in_the_record(tmp_path):
    hold = Hold()
    recorder, session = recording(tmp_path, hold)
    hold.stop("all")
    session.write_stop("all")
    hold.update(touch("release", 1))
    hold.update(touch("contact", 2))  # of another session
    hold.stop("peltier")  # before this session has done anything
    session.write_stop("peltier")
    session.receive(touch("contact", 3), 2.0)
    session.tick(2.02, AT_REST)
    outcome = replayed(tmp_path, recorder)
    assert outcome.is_same, outcome.first_difference
    assert outcome.sounds  # the speaker is free: only the plate was stopped again


def act_at_random(chance, hold, sessions, now):
    """Do one of the things that a gateway does to its sessions, which share the hold."""
    session = chance.choice(sessions)
    match chance.choice(("touch", "touch", "tick", "rest", "stop", "own")):
        case "touch":
            phase = chance.choice(("approach", "contact", "slide", "release"))
            with suppress(MessageError):  # it does not own the outputs, or a stop holds them
                session.receive(touch(phase, 2), now)
        case "tick":
            session.tick(now, AT_REST)
        case "rest":
            session.rest()
        case "own":
            session.set_owner(owner=chance.random() < 0.7)
        case "stop":
            scope = chance.choice(("all", "speaker", "peltier"))
            hold.stop(scope)
            for each in sessions:
                each.write_stop(scope)


def test_two_sessions_that_stop_and_lift_at_random_each_replay_the_same(tmp_path):
    chance = random.Random(1)
    for number in range(20):
        hold = Hold()
        folders = [tmp_path / f"{number}-{name}" for name in "ab"]
        recorders, sessions = zip(*(recording(folder, hold) for folder in folders), strict=True)
        for step in range(60):
            act_at_random(chance, hold, sessions, step / 50)
        for folder, recorder in zip(folders, recorders, strict=True):
            outcome = replayed(folder, recorder)
            assert outcome.is_same, outcome.first_difference
