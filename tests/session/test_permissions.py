"""What an observer may say of the owner's scene: materials of its objects, and nothing else."""

import msgspec
import pytest

from hapticvlm.messages import Decision, MessageError, Ok, Scene, SceneObject, Touch
from hapticvlm.session.actions import Reply
from hapticvlm.session.overrides import with_materials
from hapticvlm.session.session import SceneSession
from hapticvlm.session.settings import SessionSettings

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


@pytest.mark.parametrize(
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
    touch = Touch(
        id=8,
        phase="contact",
        hand="right",
        object_id="shown",
        speed_mps=0.3,
        force_n=1.0,
        captured_at=1.0,
    )
    session.receive(touch, 1.0)
    session.receive(msgspec.structs.replace(touch, phase="release"), 1.1)
    both = [{"object_id": name, "material": "metal"} for name in ("shown", "other")]
    actions = session.receive(scene(*both), 2.0)
    messages = [action.message for action in actions if isinstance(action, Reply)]
    decided = [(m.object_id, m.material) for m in messages if isinstance(m, Decision)]
    assert decided == [("shown", "metal")]
    again = session.receive(scene(*both), 3.0)
    assert [action.message for action in again if isinstance(action, Reply)] == [Ok(id=7)]
