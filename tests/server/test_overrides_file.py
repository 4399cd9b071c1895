"""The file of materials that a person stated: what is written is read, what is wrong is refused."""

import pytest

from hapticvlm.materials import MATERIALS
from hapticvlm.messages import ObjectSurface, SceneObject
from hapticvlm.server.web import overrides_file

NAMES = ("cup", 'a "quoted" \\ name\n', "\x7f\N{SNOWMAN}\N{PILE OF POO}")
ODD = {name: SceneObject(object_id=name, material="glass") for name in NAMES}
SURFACES = [ObjectSurface(), ObjectSurface(material="stone")]
ROOM = {"room": SceneObject(object_id="room", surfaces=SURFACES)}


def test_what_was_stated_is_read_again(tmp_path):
    file = tmp_path / "stated.json"
    for stated in ({}, ODD, ROOM):
        file.write_bytes(overrides_file.text(stated))
        assert overrides_file.read(file, MATERIALS) == stated


@pytest.mark.parametrize(
    ("text", "fault"),
    [
        ('{"objects": [{"object_id": "cup", "material": "mettal"}]}', "unknown material `mettal`"),
        ('{"objects": [{"object_id": "cup"}]}', "material"),
        ('{"objects": [{"object_id": "cup", "material": "wood", "sunlit": true}]}', "nothing else"),
        (
            '{"objects": [{"object_id": "room", "surfaces": [{}, {"material": "mettal"}]}]}',
            r"objects\[0\]\.surfaces\[1\]\.material: unknown material `mettal`",
        ),
        ('{"objects": [{"object_id": "", "material": "wood"}]}', "object_id"),
        ('{"objects": [], "things": []}', "things"),
        ("[" * 100_000, "Save"),
        ("metal", "Save"),
    ],
)
def test_a_file_that_save_did_not_give_is_refused(tmp_path, text, fault):
    file = tmp_path / "stated.json"
    file.write_text(text)
    with pytest.raises(ValueError, match=fault) as refused:
        overrides_file.read(file, MATERIALS)
    assert str(file) in str(refused.value)
