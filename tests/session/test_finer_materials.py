"""What an object is made of more exactly, and how thick it is: in its decision and on the plate."""

import pytest
from session_messages import only, owner, replies, scene, touch

from hapticvlm.evidence.sub_materials import SUB_MATERIALS
from hapticvlm.materials import MATERIALS, derive
from hapticvlm.messages import Decision, ObjectSurface, SceneObject
from hapticvlm.rendering.heat.contact import contact_temperature_c, thermal_contact
from hapticvlm.rendering.heat.limits import AT_REST
from hapticvlm.session.actions import DrivePlate
from hapticvlm.session.session import SceneSession
from hapticvlm.session.settings import SessionSettings


def decided(table=MATERIALS, object_id="thing", **fields) -> Decision:
    """Return the decision on one object that is touched in a room of 22 degC."""
    session = SceneSession(SessionSettings(owner=True, reading=AT_REST, table=table))
    session.receive(scene(SceneObject(object_id=object_id, **fields), ambient_c=22.0), 0.0)
    (decision,) = replies(session.receive(touch("contact", object_id), 0.1), Decision)
    return decision


def met_c(bulk) -> float:
    return contact_temperature_c(thermal_contact(bulk, 22.0))


def test_a_name_that_says_more_is_felt_as_what_it_says():
    brick = decided(name="BrickWall_02")

    assert (brick.material, brick.sub_material) == ("stone", "brick")
    assert brick.contact_c is not None
    assert brick.contact_c == pytest.approx(met_c(SUB_MATERIALS["brick",].thermal))
    assert brick.contact_c > met_c(MATERIALS["stone"].thermal) + 1.0


def test_a_stated_material_is_refined_by_a_name_of_that_material_only():
    assert decided(name="Styrofoam_Cup", material="plastic").sub_material == "styrofoam"
    assert decided(name="Styrofoam_Cup", material="ceramic").sub_material is None


def test_the_object_id_says_it_where_there_is_no_name():
    assert decided(object_id="cork_board").sub_material == "cork"


def test_a_thing_that_is_never_thick_has_a_thickness_and_the_scenes_own_wins():
    leaf, stated = decided(name="Oak_Leaf"), decided(name="Oak_Leaf", thickness_m=0.02)

    assert leaf.thickness_m == pytest.approx(3e-4)
    assert stated.thickness_m == pytest.approx(0.02)
    assert decided(name="oak table").thickness_m is None


def test_a_thin_thing_is_felt_less_on_the_plate_as_it_warms_up():
    def setpoint_c(**fields) -> float:
        session = owner(SceneObject(object_id="x", material="metal", temperature_c=22.0, **fields))
        for tick in range(500):
            now = 0.02 * tick
            session.receive(touch("contact", "x", 0.0), now)
            actions = session.tick(now, AT_REST)
        return only(actions, DrivePlate)[0].setpoint_c

    assert setpoint_c(name="soda_can") > setpoint_c() + 4.0


def test_a_users_own_material_is_felt_as_the_user_says():
    own = derive("corkboard", "wood", ["cork board"], {"thermal": {"conductivity": 0.3}})
    found = decided(table={**MATERIALS, "corkboard": own}, name="Cork_Board")

    assert (found.material, found.sub_material) == ("corkboard", None)
    assert found.contact_c == pytest.approx(met_c(own.thermal))


def surfaces(*labels: str) -> list[ObjectSurface]:
    return [ObjectSurface(name=label) for label in labels]


def test_the_largest_surfaces_name_decides_over_the_objects():
    table = decided(name="OakTable_02", surfaces=surfaces("M_BrushedSteel", "Rubber_Feet"))

    assert (table.material, table.source) == ("metal", "name")
    assert decided(name="OakTable_02", surfaces=[]).material == "wood"
    assert decided(name="OakTable_02", surfaces=surfaces("mat14")).material == "wood"
    assert decided(surfaces=surfaces("T_Leather_D.png")).material == "leather"


def test_a_surface_names_the_finer_material():
    wall = decided(name="Wall_03", surfaces=surfaces("Brick_Red"))

    assert (wall.material, wall.sub_material) == ("stone", "brick")
    assert decided(name="BrickWall_02", surfaces=surfaces("mat3")).sub_material == "brick"


def test_the_parents_in_a_name_give_no_temperature_and_no_finer_material():
    assert decided(name="IceCube/Tray_Plastic").surface_source == "ambient"
    assert decided(name="BrickWall/Door_Oak").sub_material is None
