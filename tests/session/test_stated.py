"""What an observer may say of the owner's scene: materials of its objects, and nothing else."""

import pytest

from hapticvlm.messages import MessageError, Scene, SceneObject
from hapticvlm.session.stated import with_materials

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
