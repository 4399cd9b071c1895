"""Reads drawn rooms, and files as strangers make them: odd, broken, huge or hostile."""

from __future__ import annotations

import base64
import json
import math
import os
import struct
import unicodedata
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from gltf_room import OBJECT, SURFACES, glb, write_room
from PIL import Image, features
from word_tables import cases

from hapticvlm.scenes import files, gltf, reading
from hapticvlm.scenes.reading import read_scene
from hapticvlm.scenes.scene import Scene, SceneError
from hapticvlm.session import scene_objects
from hapticvlm.vision.files import decode_frame
from hapticvlm.vision.pictures import decode_upright

Document = dict[str, Any]
TABLES = Path(__file__).with_name("scene_files.json")
ENDINGS = (".glb", ".gltf")
MANY = (10_000, pytest.param(100_000, marks=pytest.mark.nightly))


def area(size: tuple[float, float, float]) -> float:
    x, y, z = size
    return 2.0 * (x * y + y * z + z * x)


def write(path: Path, document: Document) -> Path:
    path.write_text(json.dumps({"asset": {"version": "2.0"}, **document}), encoding="utf-8")
    return path


def scene_of(tmp_path: Path, document: Document) -> Scene:
    return read_scene(write(tmp_path / "scene.gltf", document))


def chairs(count: int, **more: Any) -> Document:
    """A document with this many nodes of one mesh, all of them roots."""
    return {
        "nodes": [{"name": f"Chair_{number}", "mesh": 0} for number in range(count)],
        "meshes": [{"primitives": [{}]}],
        **more,
    }


def textured(image: Document, texture: Document | None = None) -> Document:
    """A document with one surface, whose base-colour map is this picture."""
    material = {"name": "m", "pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}
    return {
        "nodes": [{"name": "Wall", "mesh": 0}],
        "meshes": [{"primitives": [{"material": 0}]}],
        "materials": [material],
        "textures": [{"source": 0} if texture is None else texture],
        "images": [image],
    }


def picture(scene: Scene) -> Callable[[], bytes]:
    texture = scene.objects[0].surfaces[0].texture
    assert texture is not None
    return texture.read


@pytest.mark.parametrize("ending", ENDINGS)
def test_a_room_of_one_object_has_its_twenty_surfaces_the_largest_first(
    ending: str, tmp_path: Path
) -> None:
    scene = read_scene(write_room(tmp_path / f"room{ending}"))
    (room,) = scene.objects
    assert (room.object_id, room.path, scene.notes) == (OBJECT, (OBJECT,), ())
    largest_first = sorted(SURFACES, key=lambda surface: -area(surface.size))
    assert [surface.name for surface in room.surfaces] == [each.name for each in largest_first]
    assert {surface.triangles for surface in room.surfaces} == {12}


@pytest.mark.parametrize("ending", ENDINGS)
def test_a_surface_has_the_shader_and_texture_of_its_material(ending: str, tmp_path: Path) -> None:
    (room,) = read_scene(write_room(tmp_path / f"room{ending}")).objects
    by_name = {surface.name: surface for surface in room.surfaces}
    for drawn in SURFACES:
        surface = by_name[drawn.name]
        assert surface.shader is not None
        assert surface.shader.metallic == drawn.metallic
        assert surface.shader.roughness == drawn.roughness
        assert surface.shader.transmission == drawn.transmission
        assert (surface.texture and surface.texture.name) == drawn.texture
        if surface.texture is None:
            assert surface.shader.base_color == drawn.color
        else:
            assert surface.texture.read().startswith(b"\x89PNG")


@pytest.mark.parametrize(("mode", "opacity"), [("BLEND", 0.25), ("MASK", None), ("OPAQUE", None)])
def test_only_alpha_that_is_blended_is_an_opacity(
    mode: str, opacity: float | None, tmp_path: Path
) -> None:
    pane = {"alphaMode": mode, "pbrMetallicRoughness": {"baseColorFactor": [1, 1, 1, 0.25]}}
    older = {"KHR_materials_pbrSpecularGlossiness": {"diffuseFactor": [1, 1, 1, 0.25]}}
    materials = [pane, {"alphaMode": mode, "extensions": older}]
    mesh = {"primitives": [{"material": 0}, {"material": 1}]}
    scene = scene_of(tmp_path, {"nodes": [{"mesh": 0}], "meshes": [mesh], "materials": materials})
    shaders = [surface.shader for surface in scene.objects[0].surfaces]
    assert [shader and shader.opacity for shader in shaders] == [opacity, opacity]


def mapped(name: str) -> Document:
    """A document with one material that has a metallic-roughness map, orm.png."""
    pbr = {"metallicRoughnessTexture": {"index": 0}, "roughnessFactor": 0.5}
    material = {"name": name, "pbrMetallicRoughness": pbr}
    maps = {"textures": [{"source": 0}], "images": [{"uri": "orm.png"}]}
    return chairs(1, meshes=[{"primitives": [{"material": 0}]}], materials=[material], **maps)


@pytest.mark.parametrize(("name", "metallic"), [("mat7", 0.8), ("Oak_Planks", None)])
def test_a_metallic_map_gives_its_mean_where_the_name_is_not_sure(
    name: str, metallic: float | None, tmp_path: Path
) -> None:
    Image.new("RGB", (128, 64), (255, 51, 204)).save(tmp_path / "orm.png")
    (surface,) = scene_of(tmp_path, mapped(name)).objects[0].surfaces
    assert surface.shader is not None
    assert surface.shader.metallic == pytest.approx(metallic, abs=0.01)
    assert surface.shader.roughness == pytest.approx(metallic and 0.1, abs=0.01)


def test_a_metallic_map_that_cannot_be_read_is_a_note(tmp_path: Path) -> None:
    (note,) = scene_of(tmp_path, mapped("mat7")).notes
    assert "orm.png" in note


def test_an_object_is_named_behind_its_parents_and_a_nameless_one_by_its_mesh(
    tmp_path: Path,
) -> None:
    scene = scene_of(
        tmp_path,
        {
            "nodes": [
                {"name": "Rifle", "children": [1, 2, 3]},
                {"name": "Magazine", "mesh": 0},
                {"children": [4], "mesh": 0},
                {"mesh": 1},
                {"name": "Spring", "mesh": 1},
            ],
            "meshes": [{"name": "Barrel", "primitives": [{}]}, {"primitives": [{}]}],
        },
    )
    assert [node.name for node in scene.objects] == [
        "Rifle/Magazine",
        "Rifle/Barrel",
        "Rifle/Spring",
        "Rifle/#3",
    ]


def test_objects_of_one_name_and_of_too_long_a_name_have_ids_of_their_own(tmp_path: Path) -> None:
    names = ["Chair", "Chair", "Chair~2", "Chair", "x" * 300, "y" + "x" * 299]
    document = chairs(len(names))
    for node, name in zip(document["nodes"], names, strict=True):
        node["name"] = name
    ids = [node.object_id for node in scene_of(tmp_path, document).objects]
    assert ids[0] == "Chair"
    assert len(set(ids)) == len(names)
    assert max(map(len, ids)) <= reading.MAX_ID


def test_only_the_scene_that_the_file_shows_is_read(tmp_path: Path) -> None:
    document = chairs(3, scenes=[{"nodes": [0]}, {"nodes": [2]}], scene=1)
    assert [node.name for node in scene_of(tmp_path, document).objects] == ["Chair_2"]


def test_points_and_lines_are_no_surfaces(tmp_path: Path) -> None:
    document = chairs(2)
    document["meshes"] = [{"primitives": [{"mode": 0}, {"mode": 3}]}, {"primitives": [{}]}]
    document["nodes"][1]["mesh"] = 1
    assert [node.name for node in scene_of(tmp_path, document).objects] == ["Chair_1"]


@pytest.mark.parametrize(("factor", "stated"), [(0.0, 0.0), (1.0, None)])
def test_a_factor_below_a_map_says_nothing_unless_it_is_0(
    factor: float, stated: float | None, tmp_path: Path
) -> None:
    pbr: Document = {"metallicRoughnessTexture": {"index": 0}}
    pbr |= {"metallicFactor": factor, "roughnessFactor": factor}
    document = chairs(1, materials=[{"pbrMetallicRoughness": pbr}], textures=[{}])
    document["meshes"] = [{"primitives": [{"material": 0}]}]
    shader = scene_of(tmp_path, document).objects[0].surfaces[0].shader
    assert shader is not None
    assert (shader.metallic, shader.roughness) == (stated, stated)


def test_the_older_parameters_give_colour_and_roughness(tmp_path: Path) -> None:
    older = {"diffuseFactor": [0.5, 0.25, 0.0, 1.0], "glossinessFactor": 0.75}
    material = {"extensions": {"KHR_materials_pbrSpecularGlossiness": older}}
    document = chairs(1, materials=[material])
    document["meshes"] = [{"primitives": [{"material": 0}]}]
    shader = scene_of(tmp_path, document).objects[0].surfaces[0].shader
    assert shader is not None
    assert (shader.metallic, shader.roughness) == (None, 0.25)
    assert shader.base_color == (0.5, 0.25, 0.0)


def measured(corners: list[float], counts: tuple[int, int], mode: int = 4) -> Document:
    """A document with two surfaces over the same corners, of which each uses the first ones."""
    data = struct.pack(f"<{len(corners)}f", *corners)
    uri = f"data:application/octet-stream;base64,{base64.b64encode(data).decode()}"
    primitives = [
        {"attributes": {"POSITION": 0}, "material": 0},
        {"attributes": {"POSITION": 1}, "material": 1, "mode": mode},
    ]
    accessors = [
        {"bufferView": 0, "componentType": 5126, "count": count, "type": "VEC3"} for count in counts
    ]
    return {
        "nodes": [{"name": "Sheet", "mesh": 0}],
        "meshes": [{"primitives": primitives}],
        "materials": [{"name": "first"}, {"name": "second"}],
        "accessors": accessors,
        "bufferViews": [{"buffer": 0, "byteLength": len(data)}],
        "buffers": [{"byteLength": len(data), "uri": uri}],
    }


def test_a_strip_is_measured_like_its_triangles(tmp_path: Path) -> None:
    square = [0.0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 1, 0]
    scene = scene_of(tmp_path, measured(square, (3, 4), mode=5))
    assert [surface.name for surface in scene.objects[0].surfaces] == ["second", "first"]
    assert [surface.triangles for surface in scene.objects[0].surfaces] == [2, 1]
    assert scene.notes == ()


@pytest.mark.parametrize("far", [math.nan, math.inf, 3e38])
def test_positions_that_no_scene_has_are_told(far: float, tmp_path: Path) -> None:
    scene = scene_of(tmp_path, measured([far, -far, far, 1, 0, 0, 0, 1, 0], (3, 3)))
    assert len(scene.objects[0].surfaces) == 2
    (note,) = scene.notes
    assert "not finite" in note


def without_buffer(document: Document) -> None:
    document["buffers"][0]["uri"] = "gone.bin"


def with_draco(document: Document) -> None:
    for primitive in document["meshes"][0]["primitives"]:
        primitive["extensions"] = {"KHR_draco_mesh_compression": {"bufferView": 0}}
    document["accessors"] = [
        {key: value for key, value in each.items() if key != "bufferView"}
        for each in document["accessors"]
    ]


def with_meshopt(document: Document) -> None:
    for view in document["bufferViews"]:
        view["extensions"] = {"EXT_meshopt_compression": {"buffer": 0, "mode": "ATTRIBUTES"}}


@pytest.mark.parametrize(
    ("damage", "word"),
    [(without_buffer, "gone.bin"), (with_draco, "Draco"), (with_meshopt, "meshopt")],
)
def test_geometry_that_cannot_be_read_is_told_and_names_are_still_there(
    damage: Callable[[Document], None], word: str, tmp_path: Path
) -> None:
    path = write_room(tmp_path / "room.gltf")
    document = json.loads(path.read_text())
    damage(document)
    path.write_text(json.dumps(document))
    scene = read_scene(path)
    assert {surface.name for surface in scene.objects[0].surfaces} == {s.name for s in SURFACES}
    (note,) = scene.notes
    assert word in note


def test_geometry_beyond_the_budget_is_not_read(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = write_room(tmp_path / "room.glb")
    monkeypatch.setattr(files, "GEOMETRY_BYTES", 3000)
    (note,) = read_scene(path).notes
    assert "limit" in note


@pytest.mark.parametrize("uri", cases(TABLES, "elsewhere"))
def test_a_picture_elsewhere_is_never_read(uri: str, tmp_path: Path) -> None:
    (tmp_path / "secret.png").write_bytes(b"\x89PNG secret")
    folder = tmp_path / "scene"
    folder.mkdir()
    (folder / "link").symlink_to(tmp_path)
    read = picture(scene_of(folder, textured({"uri": uri})))
    with pytest.raises(SceneError, match=r"outside|address"):
        read()


def test_a_folder_that_is_scanned_may_have_its_pictures_in_another_sub_folder(
    tmp_path: Path,
) -> None:
    for name in ("models", "textures"):
        (tmp_path / name).mkdir()
    (tmp_path / "textures" / "old oak.png").write_bytes(b"\x89PNG")
    document = textured({"uri": "../textures/old%20oak.png"})
    scene = read_scene(write(tmp_path / "models" / "a.gltf", document), tmp_path)
    texture = scene.objects[0].surfaces[0].texture
    assert texture is not None
    assert (texture.name, texture.read()) == ("old oak.png", b"\x89PNG")


@pytest.mark.parametrize(("image", "texture", "word"), cases(TABLES, "unreadable"))
def test_a_picture_that_cannot_be_read_says_why(
    image: Document, texture: Document | None, word: str, tmp_path: Path
) -> None:
    (tmp_path / "a.ktx2").write_bytes(b"\xabKTX 20\xbb\r\n\x1a\n")
    with (tmp_path / "large.png").open("wb") as file:
        file.truncate(files.MAX_PICTURE_BYTES + 1)
    read = picture(scene_of(tmp_path, textured(image, texture)))
    with pytest.raises(SceneError, match=word):
        read()


def test_a_picture_in_the_text_is_decoded(tmp_path: Path) -> None:
    uri = "data:image/png;base64," + base64.b64encode(b"\x89PNG").decode()
    scene = scene_of(tmp_path, textured({"uri": uri, "name": "Planks"}))
    texture = scene.objects[0].surfaces[0].texture
    assert texture is not None
    assert (texture.name, texture.read()) == ("Planks", b"\x89PNG")


def whole() -> bytes:
    return glb({"asset": {"version": "2.0"}, **chairs(1)}, bytes(8))


BROKEN: dict[str, tuple[bytes, str]] = {
    **{name: (text.encode("latin-1"), word) for name, text, word in cases(TABLES, "broken")},
    "an older .glb": (b"glTF\1\0\0\0" + bytes(12), "version 1"),
    "cut in its JSON": (whole()[:40], "too early"),
    "cut in its data": (whole()[:-4], "too early"),
    "data first": (b"glTF\2\0\0\0\0\0\0\0" + b"\4\0\0\0BIN\0abcd", "begin with JSON"),
    "nested deep": (b'{"asset": {"version": "2.0"}, "extras": ' + b"[" * 9000, "glTF file"),
}


@pytest.mark.parametrize("name", BROKEN)
def test_a_broken_file_is_refused_with_its_name_and_a_reason(name: str, tmp_path: Path) -> None:
    content, word = BROKEN[name]
    path = tmp_path / "broken.glb"
    path.write_bytes(content)
    with pytest.raises(SceneError) as caught:
        read_scene(path)
    assert str(path) in str(caught.value)
    assert word in str(caught.value)


def test_a_text_of_too_many_values_is_refused_before_it_is_parsed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(gltf, "MAX_VALUES", 1000)
    with pytest.raises(SceneError, match=r"1000 values, the limit"):
        scene_of(tmp_path, chairs(600))


def test_nodes_that_are_below_themselves_count_once(tmp_path: Path) -> None:
    document = chairs(3, scenes=[{"nodes": [0, 0]}])
    document["nodes"][0]["children"] = [1, 2]
    document["nodes"][1]["children"] = [0, 2]
    scene = scene_of(tmp_path, document)
    assert [node.name for node in scene.objects] == [
        "Chair_0",
        "Chair_0/Chair_1",
        "Chair_0/Chair_1/Chair_2",
    ]
    (note,) = scene.notes
    assert note.startswith("3 nodes")


def lods(levels: dict[int, list[int]], children: dict[int, list[int]]) -> Document:
    """Chairs of which some are below others, and some are lower levels of detail of others."""
    document = chairs(5)
    for index, ids in levels.items():
        document["nodes"][index]["extensions"] = {"MSFT_lod": {"ids": ids}}
    for index, below in children.items():
        document["nodes"][index]["children"] = below
    return document


@pytest.mark.parametrize(
    ("levels", "children", "objects"),
    [
        ({2: [0, 1], 3: [4]}, {}, {2: [0, 1], 3: [4]}),
        ({1: [2], 2: [4], 4: [3]}, {}, {0: [], 1: [2, 3, 4]}),  # each names the next
        ({0: [3], 1: [0]}, {}, {1: [0, 3], 2: [], 4: []}),  # the later names the earlier one
        ({0: [1], 1: [0, 9]}, {}, {0: [1], 2: [], 3: [], 4: []}),
        ({2: [0, 3]}, {0: [1], 1: [2]}, {0: [], 1: [], 2: [3], 4: []}),  # one above itself
        ({2: [3], 3: [0]}, {0: [1, 2]}, {0: [], 1: [], 2: [3], 4: []}),
    ],
)
def test_a_lower_level_of_detail_is_felt_as_the_node_that_it_stands_for_but_nothing_above_it_is(
    levels: dict[int, list[int]],
    children: dict[int, list[int]],
    objects: dict[int, list[int]],
    tmp_path: Path,
) -> None:
    own = {
        node.index: sorted(int(path[-1]) for path in node.spelled["scene"])
        for node in scene_of(tmp_path, lods(levels, children)).objects
    }
    assert own == {index: sorted([index, *lower]) for index, lower in objects.items()}


@pytest.mark.parametrize("roots", [[0], [0, 1]])
def test_what_is_below_a_lower_level_of_detail_is_felt_as_itself_if_its_original_has_parts(
    roots: list[int], tmp_path: Path
) -> None:
    document = lods({0: [1], 4: [2]}, {0: [3, 4], 1: [2]}) | {"scenes": [{"nodes": roots}]}
    document["nodes"].append({"name": "Chair_5", "mesh": 0})
    document["nodes"][2]["children"] = [5]  # the level of a chair without parts
    assert [node.name for node in scene_of(tmp_path, document).objects] == [
        *("Chair_0", "Chair_0/Chair_3", "Chair_0/Chair_4")
    ]
    document["nodes"][4]["extensions"] = {}
    scene = scene_of(tmp_path, document)
    assert [node.name for node in scene.objects][3:] == [
        "Chair_1/Chair_2",
        "Chair_1/Chair_2/Chair_5",
    ]
    assert scene.notes == ()


@pytest.mark.parametrize("count", MANY)
def test_of_many_nodes_as_many_objects_are_read_as_the_service_knows(
    count: int, tmp_path: Path
) -> None:
    scene = scene_of(tmp_path, chairs(count))
    assert len(scene.objects) == reading.MAX_OBJECTS == scene_objects.MAX_KNOWN
    (note,) = scene.notes
    assert note.startswith(f"{count - reading.MAX_OBJECTS} objects were left out")


@pytest.mark.parametrize("count", MANY)
def test_a_long_chain_of_parents_is_read(count: int, tmp_path: Path) -> None:
    nodes: list[Document] = [{"name": f"n{at}", "children": [at + 1]} for at in range(count - 1)]
    document = chairs(0, nodes=[*nodes, {"name": "Cup", "mesh": 0}])
    (node,) = scene_of(tmp_path, document).objects
    assert node.path[-2:] == (f"n{count - 2}", "Cup")
    assert len(node.path) == 1 + 8


def test_of_too_many_surfaces_the_largest_are_kept(tmp_path: Path) -> None:
    document = chairs(1)
    count = reading.MAX_SURFACES + 5
    accessors = [{"componentType": 5126, "count": 3 * n, "type": "VEC3"} for n in range(count)]
    primitives = [{"attributes": {"POSITION": n}, "material": n} for n in range(count)]
    document |= {"meshes": [{"primitives": primitives}], "accessors": accessors}
    document["materials"] = [{"name": f"m{n}"} for n in range(count)]
    scene = scene_of(tmp_path, document)
    triangles = [surface.triangles for surface in scene.objects[0].surfaces]
    assert triangles == list(range(count - 1, 4, -1))
    assert any(f"{count} surfaces" in note for note in scene.notes)


def test_all_primitives_of_one_material_are_one_surface(tmp_path: Path) -> None:
    sizes = (30, 60, 45)
    accessors = [{"componentType": 5126, "count": size, "type": "VEC3"} for size in sizes]
    primitives = [
        {"attributes": {"POSITION": at}, "material": material}
        for at, material in enumerate((0, 1, 0))
    ]
    document = chairs(
        1,
        meshes=[{"primitives": primitives}],
        accessors=accessors,
        materials=[{"name": "Oak"}, {"name": "Steel"}],
    )
    (chair,) = scene_of(tmp_path, document).objects
    assert [(each.name, each.primitives, each.triangles) for each in chair.surfaces] == [
        ("Oak", (0, 2), 25),
        ("Steel", (1,), 20),
    ]


@pytest.mark.parametrize("form", ["NFC", "NFD"])
def test_a_texture_is_found_whichever_form_of_unicode_names_it(tmp_path: Path, form: Any) -> None:
    other: Any = {"NFC": "NFD", "NFD": "NFC"}[form]
    (tmp_path / unicodedata.normalize(other, "Tür.png")).write_bytes(b"\x89PNG")
    named = unicodedata.normalize(form, "Tür.png")
    assert picture(scene_of(tmp_path, textured({"uri": named})))() == b"\x89PNG"


def test_a_texture_that_git_lfs_keeps_elsewhere_says_so(tmp_path: Path) -> None:
    (tmp_path / "t.png").write_bytes(b"version https://git-lfs.github.com/spec/v1\noid sha256:0\n")
    with pytest.raises(SceneError, match="git lfs pull"):
        picture(scene_of(tmp_path, textured({"uri": "t.png"})))()


@pytest.mark.skipif(not features.check("avif"), reason="this Pillow reads no AVIF")
def test_a_texture_in_avif_alone_is_read(tmp_path: Path) -> None:
    Image.new("RGB", (8, 8), "red").save(tmp_path / "t.avif")
    image = {"uri": "t.avif", "mimeType": "image/avif"}
    only = {"extensions": {"EXT_texture_avif": {"source": 0}}}
    frame = decode_frame(picture(scene_of(tmp_path, textured(image, only)))(), Path("t"))
    assert decode_upright(frame, 1)[0, 0].argmax() == 0


def test_whole_numbers_may_be_written_with_a_point(tmp_path: Path) -> None:
    document = chairs(0, nodes=[{"name": "Cup", "mesh": 0.0}], scene=0.0, scenes=[{"nodes": [0.0]}])
    assert [each.object_id for each in scene_of(tmp_path, document).objects] == ["Cup"]


def test_what_a_file_has_beside_the_default_is_told(tmp_path: Path) -> None:
    document = chairs(
        1,
        scenes=[{"nodes": [0]}, {"nodes": []}],
        extensionsUsed=["KHR_materials_variants"],
        materials=[{}],
    )
    notes = " ".join(scene_of(tmp_path, document).notes)
    assert all(word in notes for word in ("2 scenes", "variants", "1 materials have no name"))


def test_a_file_may_state_materials_and_an_unknown_one_is_told_and_ignored(
    tmp_path: Path,
) -> None:
    document = chairs(
        2,
        materials=[
            {"name": "M", "extras": {"haptic_material": "leather"}},
            {"name": "N", "extras": {"haptic_material": "lether"}},
            {"name": "O", "extras": 7},
        ],
    )
    document["meshes"] = [{"primitives": [{"material": at} for at in range(3)]}]
    document["nodes"][1]["extras"] = {"haptic_material": "wood"}
    scene = scene_of(tmp_path, document)
    stated = {each.name: each.material for each in scene.objects[0].surfaces}
    assert stated == {"M": "leather", "N": None, "O": None}
    assert [node.material for node in scene.objects] == [None, "wood"]
    (note,) = [note for note in scene.notes if "haptic_material" in note]
    assert "nearest is `leather`" in note


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="this system has no fifo")
def test_a_buffer_that_is_no_file_does_not_hang(tmp_path: Path) -> None:
    path = write_room(tmp_path / "room.gltf")
    path.with_suffix(".bin").unlink()
    os.mkfifo(path.with_suffix(".bin"))
    (note,) = read_scene(path).notes
    assert "not a regular file" in note
