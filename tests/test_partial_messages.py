"""Messages that are not in order: the usable rest is taken, and every part left out is named."""

import json
import math
import tracemalloc

import msgpack
import pytest
from each_case import each
from scene_cases import CASES, objects_of

from hapticvlm.materials import MATERIALS
from hapticvlm.messages import Decision, Hello, MessageError, Ok, Touch
from hapticvlm.partial_messages import MAX_LISTED, decode
from hapticvlm.session.actions import Reply
from hapticvlm.session.session import SceneSession
from hapticvlm.session.settings import SessionSettings

TOUCH = {
    "type": "touch",
    "id": 7,
    "phase": "contact",
    "object_id": "kettle",
    "hand": "right",
    "speed_mps": 0.25,
    "force_n": 1.5,
    "captured_at": 12.5,
}


def scene(*objects, **fields):
    return {"type": "scene", "id": 2, "replace": True, "objects": list(objects), **fields}


def read(value):
    return decode(msgpack.packb(value), MATERIALS)


def answer(session, value, now=1.0):
    partial = read(value)
    actions = session.receive(partial.message, now, partial.left_out)
    (ok,) = [a.message for a in actions if isinstance(a, Reply) and isinstance(a.message, Ok)]
    return ok


def paths(ok):
    return [part.path for part in ok.left_out or ()]


def owner():
    return SceneSession(SessionSettings(owner=True))


def decided(session, object_id):
    message = read({**TOUCH, "object_id": object_id}).message
    replies = [a.message for a in session.receive(message, 2.0) if isinstance(a, Reply)]
    return next(each.material for each in replies if isinstance(each, Decision))


@each(case=CASES, encoding=["MessagePack", "JSON"])
def test_of_a_scene_the_good_part_is_felt_and_the_rest_is_named(case, encoding):
    value = scene(*objects_of(case))
    data = msgpack.packb(value) if encoding == "MessagePack" else json.dumps(value)
    partial = decode(data, MATERIALS)
    session = owner()
    session.receive(partial.message, 1.0, partial.left_out)
    assert [part.path for part in partial.left_out] == case["left_out"]
    assert {name: decided(session, name) for name in case["felt"]} == case["felt"]


def test_an_answer_says_what_was_wrong_the_limit_and_the_cure():
    ok = answer(owner(), scene({"object_id": "a", "temperature_c": 5500, "sunlit": "yes"}))
    assert all("; " in part.text for part in ok.left_out)
    assert "400" in ok.left_out[0].text


def test_a_temperature_beyond_the_range_is_never_brought_to_its_limit():
    value = scene({"object_id": "a", "temperature_c": 401}, ambient_c=81)
    partial = read(value)
    assert partial.message.objects[0].temperature_c is None
    assert partial.message.ambient_c is None
    assert [part.path for part in partial.left_out] == ["ambient_c", "objects[0].temperature_c"]


def test_without_replace_an_object_that_is_left_out_stays_as_it_was():
    session = owner()
    answer(session, scene({"object_id": "kettle", "material": "metal"}))
    wrong = {"object_id": "kettle", "material": "wood"}
    answer(session, scene({"object_id": "vase"}, [wrong]) | {"replace": False})
    assert decided(session, "kettle") == "metal"


def test_a_scene_without_a_required_field_is_refused_and_named():
    for field, path in (("replace", "$"), ("id", "$"), ("objects", "$")):
        value = {name: part for name, part in scene().items() if name != field}
        with pytest.raises(MessageError, match=field) as refused:
            read(value)
        assert refused.value.path == path


def test_paths_count_as_the_client_does_also_behind_parts_that_are_gone():
    table = {"object_id": "table", "stands_on": ["a", 1, "b", ""]}
    partial = read(scene({"no": "id"}, table, {"object_id": "table"}, materials=["no", "wood"]))
    assert [part.path for part in partial.left_out] == [
        "materials[0]",
        "objects[0]",
        "objects[1].stands_on[1]",
        "objects[1].stands_on[3]",
        "objects[2].object_id",
    ]
    assert partial.message.objects[0].stands_on == ["a", "b"]
    assert partial.message.materials == ["wood"]


def test_surfaces_keep_their_numbers_when_one_is_left_out():
    surfaces = [{"name": "Oak"}, 3, {"name": "Glass"}]
    (chair,) = read(scene({"object_id": "chair", "surfaces": surfaces})).message.objects
    assert [surface.name or "" for surface in chair.surfaces] == ["Oak", "", "Glass"]


def test_an_unknown_material_of_a_surface_is_left_out_of_that_surface():
    surfaces = [{"name": "Oak"}, {"name": "Glass", "material": "porcelain"}]
    partial = read(scene({"object_id": "chair", "surfaces": surfaces}))
    assert [part.path for part in partial.left_out] == ["objects[0].surfaces[1].material"]
    assert [s.name for s in partial.message.objects[0].surfaces] == ["Oak", "Glass"]


def test_a_long_list_of_parts_is_cut_and_its_length_told():
    partial = read(scene(*({"object_id": str(i), "x": 1} for i in range(100))))
    assert len(partial.left_out) == MAX_LISTED + 1
    assert "68" in partial.left_out[-1].text
    assert len(partial.message.objects) == 100


@pytest.mark.parametrize(
    ("field", "sent", "used"),
    [
        ("speed_mps", 20.0000001, 20.0),
        ("speed_mps", -1e-12, 0.0),
        ("force_n", 200.5, 200.0),
        ("force_n", math.inf, 200.0),
        ("distance_m", -0.01, 0.0),
        ("closing_mps", 20.5, 20.0),
    ],
)
def test_a_measured_quantity_becomes_the_nearest_limit_and_is_told_once(field, sent, used):
    session = owner()
    partial = read({**TOUCH, field: sent})
    assert getattr(partial.message, field) == used
    assert paths(answer(session, {**TOUCH, field: sent})) == [field]
    assert paths(answer(session, {**TOUCH, field: sent}, 1.1)) == []


def test_a_quantity_that_is_not_a_number_is_refused_as_such():
    with pytest.raises(MessageError, match="not a number") as refused:
        read({**TOUCH, "speed_mps": math.nan})
    assert (refused.value.path, refused.value.id) == ("$.speed_mps", 7)


@pytest.mark.parametrize(
    "wrong", [{"phase": "hover"}, {"sped_mps": 1}, {"object_id": ""}, {"captured_at": 1e13}]
)
def test_all_else_of_a_touch_is_refused(wrong):
    with pytest.raises(MessageError) as refused:
        read({**TOUCH, **wrong})
    assert refused.value.path == f"$.{next(iter(wrong))}"


@pytest.mark.parametrize("field", ["surface", "interaction", "region", "distance_m", "closing_mps"])
def test_a_field_of_a_touch_that_a_serialiser_wrote_as_null_is_absent(field):
    touch = decode(json.dumps(TOUCH | {field: None}), MATERIALS)
    assert touch.message == decode(json.dumps(TOUCH), MATERIALS).message
    assert touch.left_out == ()
    with pytest.raises(MessageError, match="hand"):
        decode(json.dumps(TOUCH | {"hand": None}), MATERIALS)


def test_a_number_without_a_fraction_is_an_integer():
    touch = read({**TOUCH, "id": 3.0}).message
    assert isinstance(touch, Touch)
    assert (touch.id, type(touch.id)) == (3, int)
    version = {"major": 1.0, "minor": 0.0}
    hello = {"type": "hello", "id": 1.0, "client": {"name": "a", "version": "1"}, "role": "scene"}
    assert isinstance(read({**hello, "protocol": version}).message, Hello)
    with pytest.raises(MessageError) as refused:
        read({**TOUCH, "id": 3.0, "phase": "hover"})
    assert refused.value.id == 3, "whoever waits by id gets its answer"
    with pytest.raises(MessageError):
        read({**TOUCH, "id": 3.5})


@pytest.mark.parametrize("key", [b"id", 0])
def test_keys_that_are_not_text_are_named_in_one_sentence(key):
    with pytest.raises(MessageError, match="a key of a map is not text"):
        read({key: 1})


def test_a_list_in_place_of_a_map_is_told_to_name_its_fields():
    with pytest.raises(MessageError, match="send a map with named fields"):
        read([1, 2])


def bomb(body, count=4_000_000):
    head = b"\x84\xa4type\xa5scene\xa2id\x01\xa7replace\xc3"
    return head + body + b"\xdd" + count.to_bytes(4, "big") + b"\x80" * count


@pytest.mark.parametrize("field", [b"\xa7objects", b"\xa6forget", b"\xa1x"])
def test_millions_of_empty_maps_take_no_memory(field):
    data = bomb(field)
    tracemalloc.start()
    with pytest.raises(MessageError):
        decode(data, MATERIALS)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak < 5 * len(data)


@pytest.mark.parametrize("name", ["`a", "a` - at `$.objects[0]", "$.id", "", "a.b[3]", "\x00`"])
def test_names_of_unknown_fields_that_look_like_paths_silence_no_other_object(name):
    partial = read(scene({"object_id": "a", name: 1}, {"object_id": "b"}))
    assert [each.object_id for each in partial.message.objects][-1] == "b"
    assert partial.left_out[0].path.startswith("objects[0]")
    with pytest.raises(MessageError):
        read({**TOUCH, name: 1})
