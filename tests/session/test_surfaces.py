"""The surfaces of one object: each is decided, felt, pictured and restated by itself."""

from functools import partial

import pytest
from session_messages import frame, only, owner, replies, scene, touch

from hapticvlm.evidence.ladder import Evidence
from hapticvlm.messages import (
    Decision,
    Error,
    MessageError,
    ObjectSurface,
    Scene,
    SceneObject,
    Shader,
)
from hapticvlm.rendering.heat.limits import AT_REST
from hapticvlm.session.actions import DrivePlate, PlayVibration
from hapticvlm.session.targets import RecognitionRequest

session_of = partial(owner, ambient_c=22.0)
STEEL = ObjectSurface(name="mat7", shader=Shader(metallic=1.0, roughness=0.2))
ROOM = SceneObject(
    object_id="room",
    name="mesh2057757694",
    surfaces=[
        ObjectSurface(name="Oak_Floor"),
        ObjectSurface(name="WindowGlass"),
        ObjectSurface(name="Curtain_Linen"),
        STEEL,
        ObjectSurface(name="mat14"),
    ],
)


def state(session, *objects: SceneObject, at: float = 0.0):
    return session.receive(scene(*objects, replace=False, ambient_c=22.0), at)


def touched(session, surface=0, phase="contact", at=1.0, object_id="room", **fields):
    return session.receive(touch(phase, object_id, at, surface=surface, **fields), at)


def pictured(session, material, at=1.0, **fields):
    shown = frame(3, "room", at, **fields)
    [request] = only(session.receive(shown, at), RecognitionRequest)
    evidence = Evidence("encoder", ((material, 0.9),))
    return replies(session.recognised(request, evidence, {}, at), Decision)


def played(actions) -> str | None:
    [play] = only(actions, PlayVibration)
    return play.command.material


def test_each_surface_of_a_mesh_is_felt_as_what_it_is():
    session = session_of(ROOM)
    felt = {}
    for surface in range(4):
        actions = touched(session, surface, at=1.0 + surface)
        [decision] = replies(actions, Decision)
        assert (decision.object_id, decision.surface) == ("room", surface)
        assert played(actions) == decision.material
        felt[surface] = (decision.material, decision.source)
        touched(session, phase="release", at=1.5 + surface)

    assert felt == {
        0: ("wood", "name"),
        1: ("glass", "name"),
        2: ("fabric", "name"),
        3: ("metal", "shader"),
    }


def test_a_hand_that_slides_onto_another_surface_feels_it_without_a_second_impact():
    session = session_of(ROOM)
    touched(session)
    [over] = only(touched(session, 2, "slide", at=1.1), PlayVibration)

    assert (over.command.material, over.command.interaction) == ("fabric", "slide")
    assert not over.command.onset


def test_the_plate_is_driven_for_the_surface_under_the_hand():
    def setpoint_c(surface: int) -> float:
        session = session_of(ROOM)
        actions = []
        for tick in range(100):
            now = 0.02 * tick
            touched(session, surface, at=now)
            actions = session.tick(now, AT_REST)
        [drive] = [action for action in actions if isinstance(action, DrivePlate)]
        return drive.setpoint_c

    assert setpoint_c(3) < setpoint_c(2) - 2.0  # steel is colder than linen


def test_an_object_of_one_surface_is_decided_on_as_before():
    one = SceneObject(object_id="room", surfaces=[ObjectSurface(name="Oak")])
    for alone in (one, SceneObject(object_id="room", name="Oak")):
        [decision] = replies(touched(session_of(alone)), Decision)
        assert (decision.material, decision.surface) == ("wood", None)


def test_a_shader_says_nothing_where_a_name_is_sure():
    table = SceneObject(object_id="room", name="OakTable", shader=STEEL.shader)
    [decision] = replies(touched(session_of(table)), Decision)
    assert (decision.material, [each.rung for each in decision.evidence]) == ("wood", ["name"])


def test_a_surface_of_several_has_a_name_of_its_own():
    session = session_of(ROOM, SceneObject(object_id="cup", name="Cup", surfaces=[STEEL]))
    names = [session.name("room", surface) for surface in (None, 1, 5)]
    assert names == ["mesh2057757694, Oak_Floor", "mesh2057757694, WindowGlass", "mesh2057757694"]
    assert (session.name("cup", 0), session.name("jug")) == ("Cup", None)


def test_what_a_surface_states_comes_before_what_its_object_states():
    box = SceneObject(
        object_id="room",
        material="wood",
        surfaces=[ObjectSurface(name="Glass"), ObjectSurface(material="metal")],
    )
    session = session_of(box)

    assert [decision.material for decision in replies(touched(session), Decision)] == ["wood"]
    assert [d.material for d in replies(touched(session, 1, "slide"), Decision)] == ["metal"]


def test_a_surface_that_tells_nothing_is_decided_by_its_objects_name():
    table = SceneObject(
        object_id="room",
        name="OakTable_02",
        surfaces=[ObjectSurface(name="M_BrushedSteel"), ObjectSurface(name="mat14")],
    )
    [decision] = replies(touched(session_of(table), 1), Decision)

    assert (decision.material, decision.source) == ("wood", "name")


def test_a_surface_that_its_object_does_not_state_is_felt_as_the_largest_and_told_once():
    session = session_of(ROOM)
    actions = touched(session, 9)
    [told] = replies(actions, Error)

    assert played(actions) == "wood"
    assert replies(actions, Decision)[0].surface == 0
    assert (told.id, told.code, told.path) == (0, "message", "$.surface")
    for part in ("`room`", "5 surfaces", "9", "largest"):
        assert part in told.text
    assert replies(touched(session, 9, at=1.1), Error) == []
    assert len(session._model.objects.known) == 1


def test_a_stated_object_tells_again_after_it_was_stated_again():
    session = session_of(ROOM)
    touched(session, 9)
    state(session, ROOM)

    assert len(replies(touched(session, 9, at=1.1), Error)) == 1


def test_a_picture_of_a_surface_decides_that_one_alone():
    session = session_of(ROOM)
    [decision] = pictured(session, "leather", surface=4)

    assert (decision.id, decision.surface, decision.material) == (3, 4, "leather")
    assert [d.material for d in replies(touched(session, 4), Decision)] == []  # announced before
    assert played(touched(session, 4, "slide")) == "leather"
    assert played(touched(session, 0, "slide")) == "wood"


def test_a_picture_of_the_whole_object_serves_a_surface_that_tells_nothing_itself():
    blank = SceneObject(
        object_id="room",
        name="Object_07",
        surfaces=[
            ObjectSurface(name="mat1"),
            ObjectSurface(name="mat2"),
            ObjectSurface(name="Oak"),
        ],
    )
    session = session_of(blank)
    assert replies(touched(session, 1), Decision)[0].material == "unknown"
    pictured(session, "leather", at=1.1)

    assert [d.material for d in replies(touched(session, 1, "slide", 1.2), Decision)] == ["leather"]
    assert [d.material for d in replies(touched(session, 2, "slide", 1.3), Decision)] == ["wood"]
    pictured(session, "stone", at=1.4, surface=1)
    assert played(touched(session, 1, "slide", 1.5)) == "stone"
    assert played(touched(session, 0, "slide", 1.6)) == "leather"


def test_a_picture_of_a_surface_that_is_not_stated_is_refused():
    session = session_of(ROOM)
    with pytest.raises(MessageError, match="state the object first") as refusal:
        pictured(session, "stone", surface=5)

    assert refusal.value.path == "$.surface"
    assert refusal.value.id == 3


def test_restating_an_object_keeps_what_was_seen_of_the_surfaces_it_still_has():
    session = session_of(ROOM)
    pictured(session, "leather", surface=4)
    state(session, ROOM)
    assert played(touched(session, 4)) == "leather"

    fewer = SceneObject(object_id="room", surfaces=(ROOM.surfaces or [])[:2])
    state(session, fewer, at=1.5)
    state(session, ROOM, at=1.6)
    assert played(touched(session, 4, at=1.7)) is None


def test_a_picture_under_way_is_dropped_once_its_surface_is_gone():
    session = session_of(ROOM)
    [request] = only(session.receive(frame(3, "room", 1.0, surface=4), 1.0), RecognitionRequest)
    state(session, SceneObject(object_id="room"))
    actions = session.recognised(request, Evidence("encoder", (("stone", 0.9),)), {}, 1.1)

    assert replies(actions, Decision) == []


def test_a_restated_surface_that_became_another_material_is_announced():
    session = session_of(ROOM)
    touched(session, 1)
    touched(session, phase="release", at=1.1)
    other = [ObjectSurface(name="Oak"), ObjectSurface(name="BrushedSteel")]
    actions = state(session, SceneObject(object_id="room", surfaces=other))

    [decision] = replies(actions, Decision)
    assert (decision.surface, decision.material) == (1, "metal")


def test_forgetting_an_object_forgets_all_its_surfaces():
    session = session_of(ROOM)
    pictured(session, "leather", surface=4)
    session.receive(Scene(id=5, objects=[], replace=False, forget=["room"]), 2.0)
    assert session._model.objects.known == {}


def test_an_unknown_material_of_a_surface_names_its_field():
    box = SceneObject(object_id="a", surfaces=[ObjectSurface(), ObjectSurface(material="wodo")])
    with pytest.raises(MessageError, match="wood") as refusal:
        session_of(box)

    assert refusal.value.path == "$.objects[0].surfaces[1].material"
