"""A session that somebody else gave reads and writes nothing outside its own folder."""

import json
import os

import pytest
from recorded_session import record

from hapticvlm.materials import MATERIALS
from hapticvlm.recordings import timeline
from hapticvlm.recordings.page import page
from hapticvlm.recordings.recorder import SESSION_LOG
from hapticvlm.recordings.replay import replay, waveform
from hapticvlm.recordings.session_log import SessionLogError
from hapticvlm.rendering.vibration.voices import Voices


@pytest.fixture
def session(tmp_path):
    return record(tmp_path)


def change(session, **fields):
    """Change the first line that names a picture."""
    lines = [json.loads(text) for text in (session / SESSION_LOG).read_text().splitlines()]
    next(line for line in lines if "file" in line).update(fields)
    (session / SESSION_LOG).write_text("".join(json.dumps(line) + "\n" for line in lines))


def test_the_page_takes_the_place_of_a_link_and_never_follows_it(session, tmp_path):
    victim = tmp_path / "victim.txt"
    victim.write_text("precious", encoding="utf-8")
    link = session / "session.html"
    link.symlink_to(victim)
    page.write(timeline.read(session, MATERIALS, Voices()), "x", link)
    assert victim.read_text(encoding="utf-8") == "precious"
    assert not link.is_symlink()
    assert link.read_text(encoding="utf-8").startswith("<!")
    assert not list(session.glob(".page-*"))


@pytest.mark.parametrize("name", ["../outside.jpg", "/etc/hostname", "/dev/zero"])
def test_a_picture_outside_the_folder_is_refused(session, name):
    change(session, file=name)
    with pytest.raises(SessionLogError, match="outside"):
        replay(session, MATERIALS)


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="pipes with a name, which Windows lacks")
def test_a_picture_that_is_a_pipe_is_refused_without_waiting(session):
    os.mkfifo(session / "pipe.jpg")
    change(session, file="pipe.jpg")
    with pytest.raises(SessionLogError, match="regular file"):
        replay(session, MATERIALS)


def test_the_vibration_of_weeks_is_refused_with_its_length(session):
    outcome = replay(session, MATERIALS)
    first = outcome.sounds[0]
    outcome.sounds.append((first[0] + 2 * 3600.0, first[1]))
    with pytest.raises(SessionLogError, match=r"lasts 2\.0 h"):
        waveform(outcome, Voices())
