"""Tests what a bake writes of a scene, and that corrections by hand survive the next one."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import jsonschema
import msgspec
import pytest

from hapticvlm.errors import UsageError
from hapticvlm.evidence.ladder import Evidence
from hapticvlm.materials import MATERIALS
from hapticvlm.messages import ObjectSurface, Scene, SceneObject, Vibrates
from hapticvlm.scenes import bake
from hapticvlm.scenes.bake import BakedSurface, Materials
from hapticvlm.scenes.scene import SceneNode, Surface, Texture

ROOT = Path(__file__).parents[2]
KETTLE = SceneObject(
    object_id="kettle",
    name="SteelKettle",
    vibrates=Vibrates(frequency_hz=100.0, level=0.2),
    temperature_c=80.0,
)
OBJECTS = [
    SceneObject(object_id="thing", name="Thing"),
    SceneObject(object_id="table", name="OakTable", thickness_m=0.03),
    SceneObject(object_id="chair", material="leather"),
    KETTLE,
]


def baked(objects: list[SceneObject], before: Materials | None = None) -> bake.Bake:
    scene = Scene(id=1, objects=objects, replace=True)
    return bake.bake(bake.model_of([scene], MATERIALS), MATERIALS, before)


def surface(materials: Materials, object_id: str) -> BakedSurface:
    return materials.objects[object_id].surfaces[0]


def corrected(materials: Materials, object_id: str, **fields: Any) -> Materials:
    """Edit the file as a person would."""
    document = json.loads(bake.encode(materials))
    document["objects"][object_id]["surfaces"][0].update(fields)
    return bake.decode(json.dumps(document).encode())


def test_each_object_has_the_material_of_the_service_and_by_what() -> None:
    materials = baked(OBJECTS).materials
    table, chair, kettle = (surface(materials, name) for name in ("table", "chair", "kettle"))
    assert (table.material, table.by, table.thickness_m) == ("wood", "name", 0.03)
    assert (chair.material, chair.by, chair.belief) == ("leather", "scene", 1.0)
    assert (kettle.material, kettle.surface_c, kettle.surface_by) == ("metal", 80.0, "scene")
    assert kettle.hum is not None
    assert len(kettle.hum.drives) == 3  # 100, 200 and 300 Hz; 400 Hz is above the band


def test_the_feel_has_the_materials_of_the_scene_and_no_others() -> None:
    assert list(baked(OBJECTS).felt) == ["leather", "metal", "wood"]


def test_what_is_not_baked_is_said_and_names_the_unknown_object() -> None:
    sentences = baked(OBJECTS).materials.not_baked
    assert [sentence.split(":")[0] for sentence in sentences] == [
        *("heat", "pictures", "studies"),
        "materials",
    ]
    assert "thing" in sentences[-1]


def test_the_order_of_the_scene_does_not_change_the_bytes() -> None:
    turned = baked(OBJECTS[::-1])
    assert bake.encode(turned.materials) == bake.encode(baked(OBJECTS).materials)
    assert [*turned.felt] == [*baked(OBJECTS).felt]


def test_a_correction_by_hand_survives_and_brings_its_material() -> None:
    first = baked(OBJECTS).materials
    edited = corrected(first, "thing", material="stone", by="hand")
    edited = corrected(edited, "table", material="glass", by="hand")
    again = baked(OBJECTS, edited)
    assert surface(again.materials, "thing").material == "stone"
    table = json.loads(bake.encode(again.materials))["objects"]["table"]["surfaces"][0]
    assert (table["material"], table["belief"], table["thickness_m"]) == ("glass", 1.0, 0.03)
    assert "impact_gain" not in table  # 1: full strength
    assert "stone" in again.felt
    assert not any(sentence.startswith("materials:") for sentence in again.materials.not_baked)
    assert baked(OBJECTS, again.materials).materials == again.materials


def test_a_material_changed_without_saying_by_hand_is_baked_again() -> None:
    edited = corrected(baked(OBJECTS).materials, "table", material="glass")
    assert surface(baked(OBJECTS, edited).materials, "table").material == "wood"


def test_corrections_of_objects_that_are_gone_are_named() -> None:
    edited = corrected(baked(OBJECTS).materials, "thing", material="stone", by="hand")
    assert baked(OBJECTS[1:], edited).lost == ("thing",)


def test_a_correction_to_no_material_of_the_table_names_the_nearest() -> None:
    edited = corrected(baked(OBJECTS).materials, "thing", material="ston", by="hand")
    with pytest.raises(UsageError, match=r"objects\.thing: .*nearest is `stone`"):
        baked(OBJECTS, edited)


@pytest.mark.parametrize(
    "content", [b"", b"[]", b'{"version": 1}', b'{"version": 9, "objects": {}, "not_baked": []}']
)
def test_a_damaged_file_is_refused_with_what_to_do(content: bytes) -> None:
    with pytest.raises(UsageError, match="remove it"):
        bake.decode(content)


def test_the_file_keeps_its_schema() -> None:
    schema = json.loads((ROOT / "schemas/materials.schema.json").read_text())
    document = msgspec.json.decode(bake.encode(baked(OBJECTS).materials))
    jsonschema.Draft202012Validator(schema).validate(document)


def test_each_surface_of_an_object_is_baked_and_corrected_by_itself() -> None:
    parts = [ObjectSurface(name="oak_planks"), ObjectSurface(name="steel_frame")]
    bench = [SceneObject(object_id="bench", surfaces=parts)]
    first = baked(bench).materials
    assert [each.material for each in first.objects["bench"].surfaces] == ["wood", "metal"]
    document = json.loads(bake.encode(first))
    document["objects"]["bench"]["surfaces"][1] |= {"material": "plastic", "by": "hand"}
    again = baked(bench, bake.decode(json.dumps(document).encode()))
    assert [each.material for each in again.materials.objects["bench"].surfaces] == [
        *("wood", "plastic")
    ]
    assert list(again.felt) == ["plastic", "wood"]


def test_a_correction_stays_with_its_material_when_the_order_changes() -> None:
    parts = [ObjectSurface(name="oak_planks"), ObjectSurface(name="steel_frame")]
    first = baked([SceneObject(object_id="bench", surfaces=parts)]).materials
    edited = corrected(first, "bench", material="rubber", by="hand")
    again = baked([SceneObject(object_id="bench", surfaces=parts[::-1])], edited)
    felt = {each.name: each.material for each in again.materials.objects["bench"].surfaces}
    assert felt == {"steel_frame": "metal", "oak_planks": "rubber"}
    gone = baked([SceneObject(object_id="bench", surfaces=parts[1:])], edited)
    assert gone.lost == ("bench (oak_planks)",)


def test_a_correction_follows_a_thing_that_has_another_id_and_its_old_names() -> None:
    edited = corrected(baked(OBJECTS).materials, "thing", material="stone", by="hand")
    renamed = [SceneObject(object_id="thing2", name="Room/Thing"), *OBJECTS[1:]]
    assert surface(baked(renamed, edited).materials, "thing2").material == "stone"


def test_corrections_by_a_pattern_of_names_stay_and_end_with_the_pattern() -> None:
    shades = [
        SceneObject(object_id=f"thing{at}", surfaces=[ObjectSurface(name=f"shade{at}")])
        for at in range(3)
    ]
    first = baked(shades).materials
    edited = msgspec.structs.replace(first, corrections={"shade[01]": "stone", "gone*": "wood"})
    again = baked(shades, bake.decode(bake.encode(edited)))
    felt = [surface(again.materials, f"thing{at}") for at in range(3)]
    assert [each.material for each in felt] == ["stone", "stone", None]
    assert again.materials.corrections == edited.corrections
    assert again.lost == ("corrections.gone*",)
    withdrawn = msgspec.structs.replace(again.materials, corrections={})
    assert surface(baked(shades, withdrawn).materials, "thing0").material is None
    wrong = msgspec.structs.replace(first, corrections={"shade*": "ston"})
    with pytest.raises(UsageError, match=r"corrections\.shade\*: .*nearest is `stone`"):
        baked(shades, wrong)


def test_things_of_which_nothing_is_known_are_felt_as_chosen_or_listed_by_material() -> None:
    shades = [
        SceneObject(object_id=f"thing{at}", surfaces=[ObjectSurface(name="shadeBrown")])
        for at in range(9)
    ]
    listed = baked(shades).materials.not_baked[-1]
    assert "9 surfaces" in listed
    assert listed.count("shadeBrown") == 1
    model = bake.model_of([Scene(id=1, objects=shades, replace=True)], MATERIALS)
    chosen = bake.bake(model, MATERIALS, unknown="leather")
    felt = surface(chosen.materials, "thing3")
    assert (felt.material, felt.belief, felt.by) == ("leather", 0.0, "unknown")
    assert list(chosen.felt) == ["leather"]


def test_each_texture_is_read_once_and_only_where_names_leave_the_surface_open() -> None:
    maps = [Texture(f"map_{index}", bytes) for index in range(256 + 3)]
    open_ones = [
        SceneNode(f"Mesh.{index}", ("Mesh",), (Surface("mat", None, each, 1),) * 2)
        for index, each in enumerate(maps[1:])
    ]
    table = SceneNode("Table", ("OakTable",), (Surface("oak_planks", None, maps[0], 1),))
    read: list[Texture] = []

    def look(texture: Texture) -> Evidence | None:
        read.append(texture)
        return None if texture is maps[-1] else Evidence("texture", (("stone", 0.9),))

    nodes = [table, *open_ones]
    surfaces = [(node, index) for node in nodes for index in range(len(node.surfaces))]
    objects = [
        SceneObject(
            object_id=node.object_id,
            name=node.name,
            surfaces=[ObjectSurface(name=each.name) for each in node.surfaces],
        )
        for node in nodes
    ]
    model = bake.model_of([Scene(id=1, objects=objects, replace=True)], MATERIALS)
    bake.read_textures(model, surfaces, look)
    materials = bake.bake(model, MATERIALS).materials
    assert [id(each) for each in read] == [id(each) for each in maps[1:]]
    assert surface(materials, "Table").material == "wood"
    *shown, unread = (materials.objects[node.object_id].surfaces for node in open_ones)
    assert {(each.material, each.by) for pair in shown for each in pair} == {("stone", "texture")}
    assert [each.material for each in unread] == [None, None]
