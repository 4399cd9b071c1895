"""A recorded session as a timeline."""

import json
from pathlib import Path

import numpy as np
import pytest
from each_case import each_row
from recorded_session import record, record_messages, touch
from word_tables import words

from hapticvlm.materials import MATERIALS
from hapticvlm.recordings import timeline
from hapticvlm.recordings.page.page import document
from hapticvlm.recordings.recorder import SESSION_LOG
from hapticvlm.recordings.replay import replay
from hapticvlm.recordings.session_log import SessionLogError
from hapticvlm.rendering.vibration.vibration import RATE_HZ
from hapticvlm.rendering.vibration.voices import Voices
from hapticvlm.session.targets import ObjectTarget


@pytest.fixture
def session(tmp_path):
    return record(tmp_path)


def read(folder):
    return timeline.read(folder, MATERIALS, Voices())


def test_a_touch_lasts_from_its_contact_to_its_release(session):
    (held,) = read(session).touches
    assert (held.object_id, held.hand) == ("mug", "right")
    assert (held.from_s, held.to_s) == pytest.approx((0.5, 1.55))


def test_a_touch_has_the_times_at_which_the_hand_began_to_move_and_stopped(tmp_path):
    mug = {"object_id": "mug", "name": "TeaMug_01"}
    said = [(0.0, {"type": "scene", "objects": [mug], "replace": True})]
    speeds = [(0.5, "contact", 0.0), (0.7, "slide", 0.2), (0.8, "slide", 0.3), (0.9, "slide", 0.0)]
    said += [(at_s, touch(phase, "mug") | {"speed_mps": mps}) for at_s, phase, mps in speeds]
    (held,) = read(record_messages(tmp_path, [*said, (1.2, touch("release"))])).touches
    assert [moves for _, moves in held.motion] == [True, False]
    assert [at_s for at_s, _ in held.motion] == pytest.approx([0.7, 0.9])


def test_the_vibration_stands_at_the_time_of_its_touch(session):
    wave = read(session).wave
    loud = np.flatnonzero(np.abs(wave) > 1e-3) / RATE_HZ
    assert 0.5 <= loud.min() < 0.51
    assert 1.55 <= loud.max() < 1.6


def test_names_decisions_and_plate_are_found_at_their_times(session):
    what = read(session)
    mug = ObjectTarget("mug")
    assert (what.name(mug), what.title(mug)) == ("TeaMug_01", "Tea mug")
    assert what.decision_at(0.4, mug) is None or what.decisions[0].t_s <= 0.4
    assert what.decision_at(1.0, mug)["material"] == "ceramic"
    assert {point.plate_c for point in what.plate} == {31.0}
    assert what.touch_at(1.0) is what.touches[0]
    assert what.touch_at(0.2) is None


@each_row(("name", "title"), words(Path(__file__).with_name("titles.csv"), "title"))
def test_a_title_is_the_name_in_plain_words(name, title):
    assert timeline.in_plain_words(name) == title


def test_two_names_with_the_same_words_keep_their_numbers(tmp_path):
    mugs = [{"object_id": name, "name": name} for name in ("Mug_01", "Mug_02", "OldKettle")]
    said = [(0.0, {"type": "scene", "objects": mugs, "replace": True})]
    what = read(record_messages(tmp_path, [*said, (0.5, touch("contact", "Mug_01"))]))
    titles = [what.title(ObjectTarget(mug["object_id"])) for mug in mugs]
    assert titles == ["Mug 01", "Mug 02", "Old kettle"]


def test_each_surface_that_a_hand_touched_is_an_entry_of_its_own_and_replays_the_same(tmp_path):
    surfaces = [{"name": "Oak_Floor"}, {"name": "WindowGlass"}, {}]
    room = {"object_id": "room", "name": "Hall", "surfaces": surfaces}
    said = [(0.0, {"type": "scene", "objects": [room], "replace": True})]
    said += [(0.5, touch("contact", "room")), (0.7, touch("slide", "room", surface=1))]
    said += [(0.9, touch("slide", "room", surface=9)), (1.1, touch("release", "room"))]
    folder = record_messages(tmp_path, said)
    what = read(folder)

    touched = [(touch.target, what.name(touch.target), touch.from_s) for touch in what.touches]
    assert touched == [
        (ObjectTarget("room"), "Hall, Oak_Floor", pytest.approx(0.5)),
        (ObjectTarget("room", 1), "Hall, WindowGlass", pytest.approx(0.7)),
        (ObjectTarget("room"), "Hall, Oak_Floor", pytest.approx(0.9)),
    ]
    materials = [what.decision_at(touch.to_s, touch.target)["material"] for touch in what.touches]
    assert materials == ["wood", "glass", "wood"]
    assert what.name(ObjectTarget("room", 2)) == "Hall, surface 2"
    page = document(what, "hall")
    assert [each["surface"] for each in page["touches"]] == [0, 1, 0]
    assert [each["surface"] for each in page["decisions"]] == [0, 1]
    assert replay(folder, MATERIALS).is_same


def test_a_folder_without_a_session_is_refused_with_its_name(tmp_path):
    with pytest.raises(SessionLogError, match=r"session\.jsonl.*record"):
        read(tmp_path)


def test_a_session_in_which_nothing_was_sent_says_so(session):
    log = session / SESSION_LOG
    head = log.read_text().splitlines()[0]
    assert "head" in json.loads(head)
    log.write_text(head + "\n")
    with pytest.raises(SessionLogError, match="nothing was sent"):
        read(session)
