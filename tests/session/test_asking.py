"""The session and a vision-language model: what is asked, and what an answer changes."""

import numpy as np
import pytest
from session_messages import READING, TABLE, frame, only, replies, scene, touch

from hapticvlm.evidence.ambient import SceneView
from hapticvlm.evidence.ladder import Evidence
from hapticvlm.evidence.reading import Reading
from hapticvlm.messages import Decision, SceneObject
from hapticvlm.perception import NEUTRAL_C
from hapticvlm.session.actions import AskAmbient, AskMaterial, DrivePlate
from hapticvlm.session.session import SceneSession
from hapticvlm.session.settings import SessionSettings
from hapticvlm.session.targets import SURROUNDINGS, RecognitionRequest

BLOB = SceneObject(object_id="blob", name="Object_07")
SUNNY = ("shade", "sun")
SOMETHING = Evidence("encoder", (("wood", 0.2), ("stone", 0.15)))
GLASS = Evidence("vlm", (("glass", 0.9),))


def sight(seed=0):
    vector = np.random.default_rng(seed).normal(size=128).astype(np.float32)
    return SceneView(vector / np.linalg.norm(vector), 0.5)


def reading(value_c, half_c=3.0):
    return Reading(value_c, value_c - half_c, value_c + half_c, None, "readout", 1.0)


def asking(*objects, can_ask=True, **stated):
    session = SceneSession(SessionSettings(owner=True, can_ask=can_ask))
    session.receive(scene(*objects, **stated), 0.0)
    return session


def looks(session, message, now):
    found = only(session.receive(message, now), RecognitionRequest)
    return {look.target == SURROUNDINGS: look for look in found}


def asked_ambient(session, now=1.0, seed=0):
    look = looks(session, frame(), now)[True]
    (ask,) = session.scene_view_received(look, sight(seed), now)
    assert isinstance(ask, AskAmbient)
    return ask


def test_a_live_frame_is_also_looked_at_as_a_whole_only_when_somebody_can_be_asked():
    whole = looks(asking(TABLE), frame(mask=None), 1.0)[True]
    assert (whole.picture.object_id, whole.reply_to) == (None, None)
    assert (whole.picture.region.w, whole.picture.region.h) == (1.0, 1.0)
    assert True not in looks(asking(TABLE, can_ask=False), frame(), 1.0)
    assert True not in looks(asking(TABLE, ambient_c=20.0), frame(), 1.0)
    assert True not in looks(asking(TABLE), frame(purpose="enrol"), 1.0)


def test_a_new_ambient_is_announced_labelled_and_moves_the_plate_no_faster_than_the_slew():
    session = asking(SceneObject(object_id="table", material="metal"))
    ask = asked_ambient(session)
    now, before = 1.0, NEUTRAL_C
    session.tick(now, READING)
    said = []
    for step in range(600):
        now += 0.02
        session.receive(touch("contact" if step == 0 else "slide"), now)
        if step == 150:
            said += replies(session.answered(ask, reading(-15.0), now), Decision)
        if step == 300:
            later = session.scene_view_received(ask_again(session, now), sight(5), now)
            assert later == []  # another view must last before it is asked about
        for heat in only(session.tick(now, READING), DrivePlate):
            assert abs(heat.setpoint_c - before) <= 12.0 * 0.02 + 1e-9
            before = heat.setpoint_c
    assert said
    assert said[-1].ambient_source == "vlm"
    assert (said[-1].ambient_low_c, said[-1].ambient_high_c) == (-18.0, -12.0)
    assert said[-1].surface_c == -15.0
    assert before == 18.0


def ask_again(session, now):
    return looks(session, frame(), now)[True]


def test_a_failed_question_leaves_the_default():
    session = asking(TABLE)
    session.answered(asked_ambient(session), None, 2.0)
    (decision,) = replies(session.receive(touch(at=3.0), 3.0), Decision)
    assert (decision.ambient_source, decision.ambient_c) == ("default", 22.0)


def test_a_picture_that_stands_still_is_asked_about_again_after_a_failure():
    session = asking(TABLE)
    session.answered(asked_ambient(session), None, 2.0)
    asked = [
        now
        for now in range(2, 30)
        if session.scene_view_received(ask_again(session, float(now)), None, float(now))
    ]
    assert asked == [21]


def unknown_look(session, now=1.0):
    look = looks(session, frame(object_id="blob"), now)[False]
    return only(session.recognised(look, SOMETHING, {}, now), AskMaterial)


def test_an_object_the_encoder_leaves_unknown_is_asked_about_and_the_answer_is_a_rung():
    session = asking(BLOB)
    (ask,) = unknown_look(session)
    assert ask.picture.object_id == "blob"
    assert unknown_look(session, 2.0) == []
    session.answered(ask, GLASS, 3.0)
    (decision,) = replies(session.receive(touch(object_id="blob"), 4.0), Decision)
    assert (decision.material, decision.source) == ("glass", "vlm")
    assert [item.rung for item in decision.evidence] == ["encoder", "vlm"]


def test_a_question_without_an_answer_is_asked_again_a_minute_later():
    session = asking(BLOB)
    (ask,) = unknown_look(session, 100.0)
    session.answered(ask, None, 103.0)
    assert unknown_look(session, 159.0) == []
    assert len(unknown_look(session, 161.0)) == 1


def test_nothing_is_asked_about_an_object_that_is_known_or_when_nobody_can_be_asked():
    session = asking(BLOB)
    look = looks(session, frame(object_id="blob"), 1.0)[False]
    sure = Evidence("encoder", (("metal", 0.9),))
    assert only(session.recognised(look, sure, {}, 1.0), AskMaterial) == []
    assert unknown_look(asking(BLOB, can_ask=False)) == []


def test_what_the_scene_says_lies_in_the_sun_is_warmer_than_the_air():
    objects = [SceneObject(object_id=id, material="metal", sunlit=id == "sun") for id in SUNNY]
    session = asking(*objects)
    found = {
        id: replies(session.receive(touch(object_id=id), 1.0), Decision)[0].surface_c
        for id in SUNNY
    }
    assert found["shade"] == 22.0 < 30.0 < found["sun"]


def test_an_answer_for_a_scene_since_replaced_is_not_believed():
    session = asking(BLOB)
    (ask,) = unknown_look(session)
    session.receive(scene(BLOB), 2.0)
    session.answered(ask, GLASS, 3.0)
    (decision,) = replies(session.receive(touch(object_id="blob"), 4.0), Decision)
    assert decision.material == "unknown"


@pytest.mark.parametrize(
    ("name", "stated", "source", "value_c"),
    [
        ("Ice_Cube", None, "name", 0.0),
        ("Ice_Cube", -5.0, "scene", -5.0),
        ("Oak_Table", None, "ambient", 22.0),
        ("Stove_Top", None, "ambient", 22.0),
    ],
)
def test_a_surface_is_as_warm_as_stated_then_as_its_name_says_then_as_the_room(
    name, stated, source, value_c
):
    object_ = SceneObject(object_id="o", name=name, material="glass", temperature_c=stated)
    session = asking(object_)
    (decision,) = replies(session.receive(touch(object_id="o"), 1.0), Decision)
    assert (decision.surface_source, decision.surface_c) == (source, value_c)
    assert decision.surface_low_c <= value_c <= decision.surface_high_c
    assert decision.surface_why
