"""Texture maps: asked for once where names and shaders leave a surface open, and believed."""

from functools import partial

import pytest
from msgspec.structs import replace
from session_messages import only, owner, replies, scene, touch

from hapticvlm.evidence.ladder import Evidence
from hapticvlm.messages import (
    Decision,
    Frame,
    MessageError,
    ObjectSurface,
    SceneObject,
    Shader,
    Skipped,
    Textures,
)
from hapticvlm.rendering.heat.limits import AT_REST
from hapticvlm.session import textures
from hapticvlm.session.targets import RecognitionRequest

PLANKS = "0123456789abcdef0123456789abcdef"
BRICKS = "fedcba9876543210fedcba9876543210"
OPEN = ObjectSurface(name="mat14", texture=PLANKS)
WALL = ObjectSurface(name="mat15", texture=BRICKS)


session_of = partial(owner, ambient_c=22.0)


def state(session, *objects, **fields):
    return session.receive(scene(*objects, ambient_c=22.0, **fields), 0.0)


def room(*surfaces: ObjectSurface, object_id: str = "room", **fields) -> SceneObject:
    return SceneObject(object_id=object_id, name="mesh205", surfaces=list(surfaces), **fields)


def asked(session, ticks: int = 200) -> list[str]:
    """Return every map that the session asks for within some ticks."""
    events = [
        message
        for tick in range(ticks)
        for message in replies(session.tick(1.0 + 0.02 * tick, AT_REST), Textures)
    ]
    return [texture for event in events for texture in event.hashes]


def map_of(surface: int = 0, object_id: str = "room", side: int = 16, **fields) -> Frame:
    return Frame(
        id=9,
        captured_at=2.0,
        format="rgb8",
        width=side,
        height=side,
        origin="top",
        image=bytes(3 * side * side),
        purpose="texture",
        object_id=object_id,
        surface=surface,
        **fields,
    )


def read(session, material: str, belief: float, **fields):
    """Send a map and give the session what it showed; return the actions that follow."""
    [request] = only(session.receive(map_of(**fields), 2.0), RecognitionRequest)
    evidence = Evidence("texture", ((material, belief),))
    return session.recognised(request, evidence, {"texture": 30.0}, 2.1)


def touched(session, surface=0, at=3.0, object_id="room"):
    return replies(session.receive(touch("contact", object_id, at, surface=surface), at), Decision)


def test_only_maps_of_surfaces_left_open_are_asked_for_and_each_once():
    session = session_of(
        room(
            OPEN,
            ObjectSurface(name="Oak_Varnished", texture="1" * 32),
            ObjectSurface(name="mat3", texture="2" * 32, material="glass"),
            ObjectSurface(
                name="mat4", texture="3" * 32, shader=Shader(metallic=1.0, roughness=0.1)
            ),
            ObjectSurface(name="mat5"),
        ),
        room(OPEN, WALL, object_id="hall"),
    )
    assert asked(session) == [PLANKS, BRICKS]
    assert asked(session) == []
    state(session, room(OPEN, object_id="attic"), replace=False)
    assert asked(session) == []


def test_a_map_that_two_surfaces_have_is_asked_for_if_one_of_them_is_open():
    told = ObjectSurface(name="Oak_Varnished", texture=PLANKS)
    assert asked(session_of(room(told, OPEN))) == [PLANKS]
    assert asked(session_of(room(told))) == []


def test_a_map_that_was_not_sent_is_asked_for_again_by_the_next_scene():
    session = session_of(room(OPEN, WALL))
    assert asked(session) == [PLANKS, BRICKS]
    read(session, "wood", 0.9)
    state(session, room(OPEN, WALL))
    assert asked(session) == [BRICKS]


def test_the_maps_of_a_large_scene_are_asked_for_in_pieces_and_up_to_a_limit():
    surfaces = [ObjectSurface(name="mat", texture=f"{number:032x}") for number in range(400)]
    parts = [room(*surfaces[at : at + 40], object_id=f"part{at}") for at in range(0, 400, 40)]
    session = session_of(*parts)
    events = [
        event
        for tick in range(400)
        for event in replies(session.tick(1.0 + 0.02 * tick, AT_REST), Textures)
    ]
    assert max(len(event.hashes) for event in events) <= textures.ASKED_TOGETHER + textures.CHECKED
    assert len({texture for event in events for texture in event.hashes}) == textures.MOST


def test_what_a_map_shows_decides_every_surface_that_has_it():
    session = session_of(room(WALL, OPEN), room(OPEN, object_id="hall"))
    [answer] = replies(read(session, "wood", 0.85, surface=1), Decision)
    assert (answer.id, answer.material, answer.source) == (9, "wood", "texture")
    assert answer.surface == 1
    assert touched(session, 1) == []  # the answer announced it
    [other] = touched(session, object_id="hall", at=4.0)
    assert (other.material, other.source) == ("wood", "texture")
    [wall] = touched(session, 0, at=5.0)
    assert wall.material == "unknown"


def test_a_decision_is_sent_of_what_was_announced_and_changes():
    session = session_of(room(OPEN), room(OPEN, object_id="hall"))
    before = [*touched(session, object_id="hall"), *touched(session)]
    assert [each.material for each in before] == ["unknown"] * 2
    changed = replies(read(session, "wood", 0.85), Decision)
    assert [(d.id, d.object_id, d.material) for d in changed] == [
        (9, "room", "wood"),
        (0, "hall", "wood"),
    ]


def test_a_map_counts_less_than_what_the_scene_and_a_sure_name_say():
    oak = ObjectSurface(name="Oak_Varnished", texture=PLANKS)
    session = session_of(room(oak, OPEN), room(OPEN, object_id="stated", material="glass"))
    read(session, "stone", 0.95, surface=1)
    assert touched(session, 0)[0].material == "wood"
    assert touched(session, object_id="stated", at=4.0)[0].material == "glass"


def test_a_sure_map_needs_no_frame_and_an_unsure_one_leaves_the_encoder_to_speak():
    session = session_of(room(OPEN), room(WALL, object_id="hall"))
    read(session, "wood", 0.85)
    read(session, "stone", 0.4, object_id="hall")
    live = {"purpose": "live", "id": 4}
    for object_id, count in (("room", 0), ("hall", 1)):
        frame = replace(map_of(object_id=object_id), **live)
        requests = only(session.receive(frame, 5.0), RecognitionRequest)
        requests = [each for each in requests if each.reference_material is None]
        things = [item for item in requests if getattr(item.target, "object_id", "") == object_id]
        assert len(things) == count


def test_only_materials_of_the_scene_are_believed_of_a_map():
    session = session_of()
    state(session, room(OPEN), materials=["stone", "wood"])
    [answer] = replies(read(session, "glass", 0.9), Decision)
    assert answer.material == "unknown"


def test_a_map_read_before_is_answered_at_once():
    session = session_of(room(OPEN), room(OPEN, object_id="hall"))
    read(session, "wood", 0.85)
    [answer] = replies(session.receive(map_of(object_id="hall"), 3.0), Decision)
    assert (answer.id, answer.material) == (9, "wood")


def test_a_map_whose_surface_has_another_meanwhile_is_superseded():
    session = session_of(room(OPEN))
    [request] = session.receive(map_of(), 2.0)
    assert isinstance(request, RecognitionRequest)
    state(session, room(WALL), replace=False)
    evidence = Evidence("texture", (("wood", 0.9),))
    [answer] = replies(session.recognised(request, evidence, {}, 2.1), Skipped)
    assert (answer.id, answer.reason) == (9, "superseded")
    assert touched(session)[0].material == "unknown"


def test_a_forgotten_object_has_no_map():
    session = session_of(room(OPEN))
    state(session, replace=False, forget=["room"])
    assert asked(session) == []


@pytest.mark.parametrize(
    ("frame", "path"),
    [
        (map_of(object_id="nobody"), "$.surface"),
        (map_of(surface=1), "$.surface"),
        (map_of(surface=7), "$.surface"),
        (map_of(side=512 + 1), "$.width"),
    ],
)
def test_a_map_of_no_stated_texture_or_of_too_many_pixels_is_refused(frame, path):
    session = session_of(room(OPEN, ObjectSurface(name="mat3")))
    with pytest.raises(MessageError) as refused:
        session.receive(frame, 2.0)
    expected = "limit" if path == "$.width" else "message"
    assert (refused.value.code, refused.value.path) == (expected, path)
