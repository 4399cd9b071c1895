"""What an observer may say of the owner's scene: materials of its objects, and nothing else."""

import json

import pytest
from each_case import each_row
from session_messages import replies, touch

from hapticvlm.materials import MATERIALS
from hapticvlm.messages import (
    Decision,
    MessageError,
    ObjectSurface,
    Ok,
    Scene,
    SceneObject,
)
from hapticvlm.recordings import recorded_session
from hapticvlm.session.actions import Reply
from hapticvlm.session.hands import Hold
from hapticvlm.session.overrides import with_materials
from hapticvlm.session.session import SceneSession
from hapticvlm.session.settings import SessionSettings
from hapticvlm.session.targets import ObjectTarget

MUG = SceneObject(object_id="mug", name="TeaMug_01", temperature_c=45.0)
KNOWN = {"mug": MUG, "shown": SceneObject(object_id="shown")}


def scene(*objects, **more):
    fields = {"id": 7, "replace": False, **more}
    return Scene(objects=[SceneObject(**fields_) for fields_ in objects], **fields)


def stated(*objects, **more):
    return with_materials(scene(*objects, **more), KNOWN.get)


def test_a_stated_material_leaves_the_rest_of_the_object_as_it_was():
    (mug,) = stated({"object_id": "mug", "material": "metal"}).objects
    assert (mug.name, mug.temperature_c, mug.material) == ("TeaMug_01", 45.0, "metal")


def test_an_object_that_was_only_shown_can_be_stated():
    (shown,) = stated({"object_id": "shown", "material": "wood"}).objects
    assert shown == SceneObject(object_id="shown", material="wood")


@each_row(
    ("objects", "more", "path"),
    [
        ([{"object_id": "mug", "material": "wood"}], {"replace": True}, "$.replace"),
        ([{"object_id": "mug", "material": "wood"}], {"forget": ["mug"]}, "$.forget"),
        ([{"object_id": "mug", "material": "wood"}], {"ambient_c": 21.0}, "$"),
        ([{"object_id": "mug", "material": "wood"}], {"materials": ["wood"]}, "$"),
        ([{"object_id": "mug"}], {}, "$.objects[0]"),
        ([{"object_id": "mug", "material": "wood", "temperature_c": 60.0}], {}, "$.objects[0]"),
        ([{"object_id": "mug", "material": "wood", "name": "Knife"}], {}, "$.objects[0]"),
        ([{"object_id": "other", "material": "wood"}], {}, "$.objects[0].object_id"),
    ],
)
def test_anything_else_is_refused_with_its_path(objects, more, path):
    with pytest.raises(MessageError) as refused:
        stated(*objects, **more)
    assert (refused.value.path, refused.value.id) == (path, 7)


def test_a_new_statement_on_an_object_that_was_decided_is_decided_at_once():
    session = SceneSession(SessionSettings(owner=True))
    session.receive(scene({"object_id": "shown"}, {"object_id": "other"}), 0.0)
    session.receive(touch("contact", "shown"), 1.0)
    session.receive(touch("release", "shown"), 1.1)
    both = [{"object_id": name, "material": "metal"} for name in ("shown", "other")]
    actions = session.receive(scene(*both), 2.0)
    decided = [(each.object_id, each.material) for each in replies(actions, Decision)]
    assert decided == [("shown", "metal")]
    again = session.receive(scene(*both), 3.0)
    assert [action.message for action in again if isinstance(action, Reply)] == [Ok(id=7)]


ROOM = SceneObject(
    object_id="room",
    surfaces=[ObjectSurface(name="Oak"), ObjectSurface(name="Glass"), ObjectSurface(name="mat3")],
)


def materials_felt(session):
    """Return the material that each surface of the room is decided to have."""
    objects = session._model.objects
    return [objects.verdict(ObjectTarget("room", index)).material for index in range(3)]


def correction(*materials, **whole):
    surfaces = [ObjectSurface(material=material) for material in materials]
    room = SceneObject(object_id="room", surfaces=surfaces or None, **whole)
    return Scene(id=9, objects=[room], replace=False)


def session_in(room=ROOM, saved=()):
    saved_materials = {override.object_id: override for override in saved}
    session = SceneSession(SessionSettings(owner=True, saved_materials=saved_materials))
    session.receive(Scene(id=1, objects=[room], replace=True), 0.0)
    return session


def test_a_corrected_surface_leaves_the_others_as_they_were():
    session = session_in()
    session.override(correction(None, "metal"), 1.0)
    session.override(correction(None, None, "leather"), 1.1)
    assert materials_felt(session) == ["wood", "metal", "leather"]

    session.override(correction(material="stone"), 1.2)
    assert materials_felt(session) == ["stone", "stone", "stone"]


def test_corrected_surfaces_are_saved_and_apply_again_in_the_next_run():
    first = session_in()
    first.override(correction(None, "metal"), 1.0)
    first.override(correction("glass"), 1.1)
    saved = tuple(first.overrides.by_object.values())
    assert materials_felt(session_in(saved=saved)) == ["glass", "metal", "unknown"]

    own = [ObjectSurface(material="paper"), ObjectSurface(name="Glass"), ObjectSurface()]
    stated = SceneObject(object_id="room", surfaces=own)
    assert materials_felt(session_in(stated, saved))[:2] == ["paper", "metal"]


def test_a_correction_of_more_surfaces_than_the_object_has_names_its_field():
    with pytest.raises(MessageError, match="3 surfaces") as refused:
        session_in().override(correction(None, None, None, "wood"), 1.0)
    assert refused.value.path == "$.objects[0].surfaces"


def test_a_correction_that_names_a_surface_is_refused():
    named = SceneObject(object_id="room", surfaces=[ObjectSurface(name="x", material="wood")])
    with pytest.raises(MessageError, match="materials only"):
        session_in().override(Scene(id=9, objects=[named], replace=False), 1.0)


def test_a_log_keeps_overrides_of_surfaces_and_reads_those_of_objects_as_before():
    cup = SceneObject(object_id="cup", material="glass")
    room = SceneObject(object_id="room", surfaces=[ObjectSurface(), ObjectSurface(material="wood")])
    settings = SessionSettings(owner=True, saved_materials={"cup": cup, "room": room})
    head = json.loads(json.dumps(recorded_session.head(settings, Hold())))

    assert head["saved_materials"]["cup"] == "glass"
    assert recorded_session.settings_of(head, MATERIALS) == settings
