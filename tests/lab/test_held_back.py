"""The held-back rendered set: what it may be made of, that it repeats, and that it is whole."""

import json
from io import BytesIO
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from hapticvlm import materials
from hapticvlm.captures import Line, read
from hapticvlm_lab.training import sources, traced
from hapticvlm_lab.training.held_back import cameras, catalogue, classes, plan, stage

TAUGHT_TILE, HELD_TILE = "ambientcg_tiles/wood/Wood001.jpg", "ambientcg_tiles/wood/Wood005.jpg"
pytestmark = pytest.mark.nightly

MEASURED = (
    *classes.BARE_METALS,
    *("Glass (Soda-lime)", "Glass (Borosilicate)", "Porcelain", "Terracotta", "Cardboard"),
    *("Office Paper", "Tire"),
)
VALUES = [
    {
        "name": name,
        "color": [{"colorSpace": "srgb-linear", "color": [0.5, 0.4, 0.3]}],
        "complexIor": [{"colorSpace": "srgb-linear", "n": [1.0, 0.9, 0.8], "k": [6.0, 5.0, 4.0]}],
        "ior": 1.5,
    }
    for name in MEASURED
]


def row(path: str, label: str = "wood", licence: str = "CC0-1.0", **more: str) -> dict[str, str]:
    return {"path": path, "class": label, "licence": licence, "source": "", "note": "", **more}


def object_share(line: Line) -> float:
    with Image.open(BytesIO(line.message()["mask"])) as mask:
        return float(np.mean(np.asarray(mask) > 0))


@pytest.fixture(scope="module")
def data(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A data folder in small: a tile of every class, one sky, the measured values used."""
    mitsuba = pytest.importorskip("mitsuba", reason="the extra 'train' brings Mitsuba 3")
    mitsuba.set_variant("scalar_rgb")
    folder = tmp_path_factory.mktemp("data")
    rng = np.random.default_rng(5)
    lines = ["path,class,licence,source,kind,subclass,note"]
    kinds = {"stone": "Rock"}
    maps = [f"pbr/{name}/one/albedo.jpg" for name in materials.MATERIALS]
    for path in (TAUGHT_TILE, HELD_TILE, "pbr/stone/two/albedo.jpg", *maps):
        (folder / path).parent.mkdir(parents=True, exist_ok=True)
        Image.fromarray(rng.integers(0, 255, (8, 8, 3), np.uint8)).save(folder / path)
        material = path.split("/")[1]
        kind = "Marble" if "two" in path else kinds.get(material, "")
        lines.append(f"{path},{material},CC0-1.0,,,{kind},")
        about = {"maps": {"albedo": "albedo.jpg"}, "metallic": 0.0}
        (folder / path).with_name("material.json").write_text(json.dumps(about))
    (folder / "hdri").mkdir()
    for sky in ("lebombo_512.hdr", "kiara_1_dawn_512.hdr"):
        mitsuba.Bitmap(np.ones((8, 16, 3), np.float32)).write(str(folder / "hdri" / sky))
        lines.append(f"hdri/{sky},environment,CC0-1.0,,hdri,,")
    (folder / "labels.csv").write_text("\n".join(lines) + "\n")
    (folder / "pb_renders").mkdir()
    (folder / "pb_renders" / "values.json").write_text(json.dumps({"data": VALUES}))
    return folder


def test_a_texture_that_teaches_is_never_taken() -> None:
    assert not sources.is_tile_held_back(TAUGHT_TILE)
    assert sources.is_tile_held_back(HELD_TILE)
    assert [catalogue.is_texture(row(path)) for path in (TAUGHT_TILE, HELD_TILE)] == [False, True]


@pytest.mark.parametrize("source", [*sources.LABELLED, "weather", "unlabelled_caltech101"])
def test_a_source_that_teaches_is_never_taken(source: str) -> None:
    taken = row(f"{source}/glass/one.jpg", "glass")
    if source == "ambientcg_tiles":
        taken = row(TAUGHT_TILE)
    assert not catalogue.is_texture(taken)
    assert not catalogue.is_model(taken)
    assert not catalogue.is_sky(taken)


@pytest.mark.parametrize(
    ("refused", "why"),
    [
        (row("pbr/wood/oak/albedo.jpg", note="texture origin not stated"), "origin"),
        (row("pbr/wood/hull/albedo.jpg", note="object atlas (ship planks)"), "atlas"),
        (row("pbr/wood/oak/albedo.jpg", licence="CC-BY-4.0"), "condition"),
    ],
)
def test_textures_of_unclear_origin_atlases_and_conditions_are_left_out(
    refused: dict[str, str], why: str
) -> None:
    assert not catalogue.is_texture(refused), why
    assert catalogue.is_texture(row("pbr/wood/oak/albedo.jpg"))


def test_models_are_free_of_conditions() -> None:
    assert catalogue.is_model(row("models/aws_house/Vase_01.glb", licence="MIT-0"))
    assert not catalogue.is_model(row("models/some/Vase_01.glb", licence="MIT"))
    assert not catalogue.is_model(row("pbr/wood/oak/albedo.jpg"))


def test_only_held_back_skies_give_light() -> None:
    every = [*sources.HDRI_HELD_BACK, "kiara_1_dawn", "rooitou_park"]
    seen = {name for name in every if catalogue.is_sky(row(f"hdri/{name}_512.hdr"))}
    assert seen == sources.HDRI_HELD_BACK


def test_a_catalogue_lists_nothing_that_teaches(data: Path) -> None:
    found = catalogue.read_catalogue(data)
    names = {texture.name for pool in found.textures.values() for texture in pool}
    assert "Wood001" not in names
    assert "Wood005" in names
    assert [path.name for path in found.skies] == ["lebombo_512.hdr"]


def test_a_folder_without_labels_is_refused(tmp_path: Path) -> None:
    with pytest.raises(catalogue.CatalogueError, match="is not a data folder"):
        catalogue.read_catalogue(tmp_path)


def test_what_teaches_and_what_is_held_back_share_nothing(data: Path) -> None:
    held, taught = (catalogue.read_catalogue(data, teaches=teaches) for teaches in (False, True))
    assert [texture.name for texture in taught.textures["wood"]] == ["Wood001"]
    assert [path.name for path in taught.skies] == ["kiara_1_dawn_512.hdr"]
    assert not taught.models
    places = [
        {t.maps["albedo"] for pool in c.textures.values() for t in pool} for c in (held, taught)
    ]
    assert not places[0] & places[1]


def test_a_traced_object_teaches_from_twelve_sides_and_is_none_of_the_held_back() -> None:
    ids = {made.object_id for made in (*plan.approaches(), *plan.orbits())}
    every = [traced.plan(number) for number in range(120)]
    assert not ids & {made.object_id for made in every}
    assert {made.truth for made in every} == {*materials.MATERIALS, materials.UNKNOWN}
    points = np.random.default_rng(1).uniform(-1, 1, (50, 3))
    near = cameras.approach(points, np.random.default_rng(2))
    turned = traced.views(near, np.random.default_rng(3))
    assert len(turned) == 12
    for number, camera in enumerate(turned):
        first = near[number // traced.TURNS]
        assert np.linalg.norm(camera.eye - camera.target) == pytest.approx(
            np.linalg.norm(first.eye - first.target)
        )
        assert camera.eye[1] == pytest.approx(first.eye[1])


@pytest.mark.parametrize("truth", ["wood", "glass"])
def test_the_same_object_twice_gives_equal_bytes(truth: str, data: Path, tmp_path: Path) -> None:
    from hapticvlm_lab.training.held_back import __main__ as command
    from hapticvlm_lab.training.held_back import renderer

    assert renderer.start(renderer.SCALAR) == "scalar_rgb"
    made = plan.Plan(f"{truth}_try", truth, 0, "ball", is_model=False, own=False)
    job = command.Job("approach", [made], cameras.VIEWS, 16, 1, 75, 0.15, 0.3)
    found = catalogue.read_catalogue(data)
    for folder in ("one", "two"):
        command.make_set(job, found, tmp_path / folder)
    made_files = [path for path in (tmp_path / "one").rglob("*.*") if path.is_file()]
    assert len(made_files) == 2 * cameras.VIEWS + 2
    for path in made_files:
        again = tmp_path / "two" / path.relative_to(tmp_path / "one")
        assert path.read_bytes() == again.read_bytes()
    lines = list(read(tmp_path / "one").lines())
    assert [line.truth for line in lines] == [truth] * cameras.VIEWS
    shares = [object_share(line) for line in lines]
    assert 0.15 < shares[0] < shares[-1] <= 1


def test_a_stage_depends_on_the_object_s_id_alone(data: Path) -> None:
    found = catalogue.read_catalogue(data)
    made = plan.Plan("fabric_try", "fabric", 2, "cushion", is_model=False, own=False)
    one, other = (stage.set_stage(made, found, circling=True) for _ in range(2))
    assert one.target[0].mesh.points == pytest.approx(other.target[0].mesh.points)
    assert len(one.cameras) == plan.ORBIT_FRAMES
    assert one.surroundings == other.surroundings
