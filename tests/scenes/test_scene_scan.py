"""Scans drawn scenes with the service's own evidence."""

from __future__ import annotations

import msgspec
import pytest
from gltf_room import SURFACES, write_room

from hapticvlm import materials, messages
from hapticvlm.evidence.ladder import Evidence
from hapticvlm.evidence.lexicon import read_lexicon
from hapticvlm.rendering.heat.limits import AT_REST, limits_of
from hapticvlm.scenes.declaration import messages_of
from hapticvlm.scenes.reading import read_scene
from hapticvlm.scenes.scan import Row, scan, summarise, surfaces_of
from hapticvlm.scenes.scene import Scene, SceneNode, Surface, Texture
from hapticvlm.server.edge import limits
from hapticvlm.session.scene_model import SceneModel
from hapticvlm.session.settings import SessionSettings
from hapticvlm.session.targets import ObjectTarget

LEXICON = read_lexicon(materials.MATERIALS)


def no_picture() -> bytes:
    raise AssertionError("a scan without eyes reads no picture")


def surface(name: str | None, texture: str | None = None) -> Surface:
    return Surface(name, None, Texture(texture, no_picture) if texture else None, 12)


def node(path: str, *surfaces: Surface) -> SceneNode:
    return SceneNode(path, tuple(path.split("/")), surfaces)


def rows_of(*nodes: SceneNode) -> list[Row]:
    return list(scan(surfaces_of(Scene(nodes))))


@pytest.fixture(scope="module")
def room(tmp_path_factory: pytest.TempPathFactory) -> Scene:
    return read_scene(write_room(tmp_path_factory.mktemp("room") / "room.glb"))


def test_each_surface_of_the_room_is_told_as_what_it_is(room: Scene) -> None:
    drawn = {each.name: each.material for each in SURFACES}
    names = [each.name for each in room.objects[0].surfaces]
    decided = {names[row.surface]: row.decision.material for row in scan(surfaces_of(room))}
    assert decided == drawn


def test_a_scan_decides_on_each_surface_as_a_session_does(room: Scene) -> None:
    model = SceneModel(SessionSettings(owner=True))
    for message in messages_of(room, LEXICON):
        model.declare(message)
    rows = list(scan(surfaces_of(room)))
    assert len(rows) == len(SURFACES)
    for row in rows:
        target = ObjectTarget(row.object_id, row.surface)
        decision = model.decision(target, 1.0, limits_of(AT_REST))
        assert msgspec.structs.replace(decision, surface=None) == row.decision


def test_a_surface_is_named_by_its_texture_where_its_material_says_nothing() -> None:
    (wall,) = rows_of(node("Thing", surface("mat3", "T_Bricks_D.png")))
    assert (wall.said, wall.decision.material) == ("T_Bricks_D.png", "stone")
    (door,) = rows_of(node("Thing", surface("Oak_Old", "T_Bricks_D.png")))
    assert (door.said, door.decision.material) == ("Oak_Old", "wood")
    (box,) = rows_of(node("Thing", surface("mat3", "tex7.png")))
    assert (box.said, box.sureness) == ("mat3", "unknown")


def test_parents_give_the_sense_of_a_name() -> None:
    pressed, read = rows_of(
        node("Rifle/Magazine", surface(None)), node("Table/Magazine", surface(None))
    )
    assert pressed.decision.material != read.decision.material == "paper"


def test_only_unsure_surfaces_have_their_texture_looked_at_and_each_texture_once() -> None:
    shared = Texture("tex7.png", no_picture)
    unsure = Surface("mat1", None, shared, 12)
    looked: list[str | None] = []

    def look(texture: Texture) -> Evidence:
        looked.append(texture.name)
        return Evidence("texture", (("stone", 0.7), ("ceramic", 0.2)))

    nodes = (
        node("a", unsure),
        node("b", Surface("Oak", None, Texture("oak.png", no_picture), 12)),
        node("c", unsure, surface("mat2")),
    )
    rows = list(scan(surfaces_of(Scene(nodes)), look=look))
    assert looked == ["tex7.png"]
    assert [row.decision.material for row in rows] == ["stone", "wood", "stone", "unknown"]


def test_copies_are_decided_alike_and_each_has_its_own_id() -> None:
    copies = [f"Hall/{name}" for name in ("Chair_1", "Chair_22", "Chair.003", "Chair", "7")]
    oak = surface("Oak")
    together = rows_of(*(node(name, surface(None), oak) for name in copies))
    apart = [row for name in copies for row in rows_of(node(name, surface(None), oak))]
    assert together == apart
    assert [row.object_id for row in together[::2]] == copies


def test_a_texture_that_cannot_be_read_leaves_the_verdict_as_it_is() -> None:
    thing = node("Thing", surface("mat1", "tex.ktx2"))
    (row,) = scan([(thing, 0)], look=lambda _: None)
    assert row.sureness == "unknown"


def test_the_summary_counts_and_says_what_would_help() -> None:
    rows = rows_of(
        node("a", surface("Oak"), surface("mat1", "x.png"), surface("mat2")),
        node("Chair", surface(None)),
        node("b7", surface(None)),
    )
    summary = summarise(rows)
    assert (summary.objects, summary.surfaces) == (3, 5)
    assert summary.counts == {"sure": 1, "probable": 1, "unknown": 3}
    mute, bare, ambiguous = summary.help
    assert mute.startswith("2 of them")
    assert "mat1, mat2" in mute
    assert all(each.startswith("1 of them") for each in (bare, ambiguous))


def test_the_messages_of_a_scene_are_those_of_the_protocol(room: Scene) -> None:
    (message,) = messages_of(room, LEXICON)
    encoded = messages.encode(message, as_text=True)
    assert isinstance(encoded, str)
    decoded = messages.decode(encoded)
    assert decoded == message
    assert isinstance(decoded, messages.Scene)
    assert decoded.replace
    (declared,) = decoded.objects
    names = [each.name for each in room.objects[0].surfaces]
    names[names.index("lambert3")] = "T_Planks_D.png"
    assert [each.name for each in declared.surfaces or ()] == names


def test_a_large_scene_is_declared_in_pieces_within_the_limits_of_text() -> None:
    long = "Very_Long_Name_Of_Nothing" * 4
    nodes = [
        node(f"{long}_{number}", surface("m" * 200), surface("n" * 200)) for number in range(8192)
    ]
    pieces = list(messages_of(Scene(tuple(nodes)), LEXICON))
    texts = [messages.encode(piece, as_text=True) for piece in pieces]
    assert len(pieces) > 2
    assert max(map(len, texts)) <= limits.MAX_TEXT_BYTES
    assert [piece.replace for piece in pieces] == [True] + [False] * (len(pieces) - 1)
    assert [piece.id for piece in pieces] == list(range(1, len(pieces) + 1))
    declared = [each.object_id for piece in pieces for each in piece.objects]
    assert declared == [each.object_id for each in nodes]
    for text in texts:
        messages.decode(text)


def test_a_scene_without_objects_is_declared_as_empty() -> None:
    (message,) = messages_of(Scene(()), LEXICON)
    assert (message.objects, message.replace) == ([], True)
