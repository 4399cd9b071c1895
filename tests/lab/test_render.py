from pathlib import Path

import numpy as np
import pytest
import torch
from PIL import Image

from hapticvlm import materials
from hapticvlm_lab.training.render import Batch, batch, load_tiles, render, view
from hapticvlm_lab.training.render import __main__ as command
from hapticvlm_lab.training.render.bodies import solids
from hapticvlm_lab.training.render.bodies.body import Body
from hapticvlm_lab.training.render.compose import Props, compose
from hapticvlm_lab.training.render.dice import Dice
from hapticvlm_lab.training.render.light import load_lights, sky
from hapticvlm_lab.training.render.mesh import Mesh, floats, patch
from hapticvlm_lab.training.render.radiance import read_radiance
from hapticvlm_lab.training.render.scene import Camera, Part, Scene, Sun
from hapticvlm_lab.training.render.shade import lighting
from hapticvlm_lab.training.render.shards import Order, load, make, mixture, shards
from hapticvlm_lab.training.render.surface import Finish, Surface, bank
from hapticvlm_lab.training.render.surfaces import KINDS
from hapticvlm_lab.training.render.tiles import dressed

SIDE = 32


@pytest.fixture(autouse=True)
def _one_thread():
    before = torch.get_num_threads()
    torch.set_num_threads(1)
    yield
    torch.set_num_threads(before)


def plain(colour=0.5, roughness=0.8, metalness=0.0, finish=None) -> Surface:
    level = torch.zeros(256, 256)
    albedo = torch.full((3, 256, 256), colour)
    return Surface(albedo, level, level + roughness, 0.0, metalness, finish or Finish())


def ball_scene(*, material=0, sun=0.0, others=(), glass=False) -> Scene:
    """A ball of half the picture's width, seen along -z, alone."""
    mesh = patch(solids.spherical(), closed=True)
    eye = floats([0, 0, 4])
    turn = floats([[1, 0, 0], [0, 1, 0], [0, 0, -1]])
    lamp = Sun(floats([0, 0, 1]), floats([1, 1, 1]) * np.float32(sun))
    return Scene(
        target=Part(mesh, material),
        glass=glass,
        walled=False,
        others=others,
        planes=(),
        camera=Camera(eye, turn, 1.0, (0.5, 0.5)),
        sun=lamp,
        surrounding=0,
        bare=False,
        coarse=0.0,
    )


def room(top: float, bottom: float) -> torch.Tensor:
    picture = torch.full((3, 256, 512), float(top))
    picture[:, 128:] = bottom
    return picture


def paint(scenes, surfaces, surroundings):
    """Radiance (N, 3, SIDE, SIDE) and the target's pixels (N, SIDE, SIDE)."""
    seen = view.view(scenes, SIDE, "cpu")
    light = lighting(seen, sky(surroundings))
    canvas, cover = batch.painted(seen, bank(surfaces), light)
    shape = (len(scenes), SIDE, SIDE)
    return canvas.view(3, *shape).transpose(0, 1), cover.view(shape)


def test_the_same_seed_gives_the_same_bytes_and_another_seed_gives_others():
    first, again, other = (render(seed, ["glass"], views=1, side=SIDE) for seed in (3, 3, 4))
    assert first.images.tobytes() == again.images.tobytes()
    assert first.masks.tobytes() == again.masks.tobytes()
    assert first.kinds == again.kinds
    assert first.images.tobytes() != other.images.tobytes()


def test_every_class_renders_pictures_that_show_something_where_the_mask_says():
    names = [*materials.MATERIALS, materials.UNKNOWN]
    made = render(1, names, views=1, side=SIDE)
    assert made.images.shape == (len(names), SIDE, SIDE, 3)
    assert made.images.dtype == made.masks.dtype == np.uint8
    assert made.labels == tuple(names)
    assert all(kind.split("/")[0] == name for kind, name in zip(made.kinds, names, strict=True))
    assert set(np.unique(made.masks)) <= {0, 255}
    assert (made.masks > 0).mean((1, 2)).min() >= 0.05
    assert made.images.reshape(len(names), -1).std(1).min() > 1


def test_views_of_one_sample_share_its_instance_and_differ_in_the_picture():
    made = render(2, ["rubber", "paper"], views=2, side=SIDE)
    assert made.instances.tolist() == [0, 0, 1, 1]
    assert made.labels == ("rubber",) * 2 + ("paper",) * 2
    assert len({image.tobytes() for image in made.images}) == 4


@pytest.mark.parametrize("names", [["gold"], []])
def test_names_outside_the_material_table_are_refused(names):
    with pytest.raises(ValueError, match="material"):
        render(0, names, views=1, side=SIDE)


@pytest.mark.parametrize("name", sorted(KINDS))
def test_every_kind_of_every_class_is_finite_and_in_bounds(name):
    dice = Dice(5)
    made = [make_one(dice) for _, make_one, _ in KINDS[name]]
    rows = bank(made).rows
    assert bool(torch.isfinite(rows).all())
    assert rows[:, :3].min() >= 0
    assert rows[:, :3].max() <= 1
    assert rows[:, 5].min() >= 0.03


def test_the_mask_is_the_disc_that_the_ball_projects_to():
    _, cover = paint([ball_scene()], [plain()], [room(1, 1)])
    radius = SIDE / np.sqrt(4**2 - 1)  # px: tangent of the ball's half angle at distance 4, focal 1
    assert int(cover.sum()) == pytest.approx(np.pi * radius**2, rel=0.06)
    y, x = cover[0].nonzero(as_tuple=True)
    assert float(x.float().mean()) == pytest.approx(SIDE / 2 - 0.5, abs=0.3)
    assert float(y.float().mean()) == pytest.approx(SIDE / 2 - 0.5, abs=0.3)


def test_outside_the_mask_the_picture_does_not_depend_on_the_target():
    surfaces = [plain(0.8), plain(0.1)]
    light, cover = paint([ball_scene()], surfaces, [room(1, 0.2)])
    dark, _ = paint([ball_scene(material=1)], surfaces, [room(1, 0.2)])
    outside = ~cover[0]
    assert torch.equal(light[0][:, outside], dark[0][:, outside])
    assert float((light - dark)[0][:, cover[0]].min()) > 0


def test_an_occluder_is_cut_out_of_the_mask():
    mesh = solids.cuboid(0.3, 0.3, 0.05).moved(np.eye(3, dtype=np.float32), floats([0, 0, 2]))
    _, alone = paint([ball_scene()], [plain()], [room(1, 1)])
    _, hidden = paint([ball_scene(others=(Part(mesh, 0),))], [plain()], [room(1, 1)])
    assert not bool(hidden[0, SIDE // 2, SIDE // 2])
    assert 0 < int(hidden.sum()) < int(alone.sum())


def test_brighter_light_brightens_the_target():
    levels = []
    for sun in (0.0, 1.0, 3.0):
        picture, cover = paint([ball_scene(sun=sun)], [plain()], [room(1, 1)])
        levels.append(float(picture[0][:, cover[0]].mean()))
    assert levels[0] < levels[1] < levels[2]


def test_what_stands_before_the_sun_throws_a_shadow():
    mesh = solids.cuboid(1.5, 1.5, 0.05).moved(np.eye(3, dtype=np.float32), floats([0, 0, 6]))
    lit, cover = paint([ball_scene(sun=3.0)], [plain()], [room(1, 1)])
    shaded, _ = paint([ball_scene(sun=3.0, others=(Part(mesh, 0),))], [plain()], [room(1, 1)])
    assert float(shaded[0][:, cover[0]].mean()) < 0.7 * float(lit[0][:, cover[0]].mean())


def test_polished_metal_mirrors_its_surroundings_and_rubber_does_not():
    metal, rubber = plain(0.9, 0.03, 1.0), plain(0.05, 0.8)
    contrasts = []
    for surface in (metal, rubber):
        picture, _ = paint([ball_scene()], [surface], [room(2, 0.1)])
        middle = picture[0, :, :, SIDE // 2].mean(0)
        contrasts.append(float(middle[SIDE // 2 - 5] - middle[SIDE // 2 + 5]))
    assert contrasts[0] > 10 * max(contrasts[1], 0.01)


def test_clear_glass_shows_what_is_behind_and_plastic_hides_it():
    behind = solids.cuboid(2, 2, 0.05).moved(np.eye(3, dtype=np.float32), floats([0, 0, -2]))
    clear = plain(0.01, 0.03, finish=Finish(transmission=1.0, thin=1.0))
    changes = []
    for surface, glass in ((clear, True), (plain(), False)):
        pictures = [
            paint(
                [ball_scene(others=(Part(behind, number),), glass=glass)],
                [surface, plain(0.9), plain(0.02)],
                [room(1, 1)],
            )[0]
            for number in (1, 2)
        ]
        middle = slice(SIDE // 2 - 2, SIDE // 2 + 2)
        changes.append(float((pictures[0] - pictures[1])[0, :, middle, middle].mean()))
    assert changes[0] > 0.3
    assert changes[1] == pytest.approx(0, abs=1e-6)


def test_pictures_are_the_same_alone_and_side_by_side():
    surfaces = [plain(0.9, 0.03, 1.0), plain(0.3), plain(0.01, finish=Finish(transmission=1.0))]
    dice = Dice(9)
    scenes = []
    for number, name in enumerate(("metal", "stone", "glass")):
        props = Props(number, name, name == "glass", (0, 1), ((1, 1.0),), (1,), 2)
        scenes.append(compose(dice, props))
    rooms = [room(1, 0.2), room(0.3, 0.8)]
    together, covers = paint(scenes, surfaces, rooms)
    for number, scene in enumerate(scenes):
        alone, cover = paint([scene], surfaces, rooms)
        assert torch.equal(covers[number], cover[0])
        assert torch.allclose(together[number], alone[0], atol=1e-4)


def test_tiles_dress_metal_as_metal_and_wood_as_wood(tmp_path):
    _write_tiles(tmp_path)
    tiles = load_tiles(tmp_path)
    found = [dressed(Dice(1), name, tiles) for name in ("metal", "wood")]
    (_, metal), (_, wood) = [pair for pair in found if pair is not None]
    assert dressed(Dice(1), "glass", tiles) is None
    assert float(torch.as_tensor(metal.metalness).mean()) > 0.8
    assert float(torch.as_tensor(wood.metalness).max()) == 0


def test_tiles_and_skies_that_are_held_back_are_never_opened(tmp_path):
    _write_tiles(tmp_path)
    (tmp_path / "hdri").mkdir()
    (tmp_path / "hdri" / "kiara_1_dawn_512.hdr").write_bytes(_radiance())
    (tmp_path / "hdri" / "lebombo_512.hdr").write_bytes(b"not to be read")
    tiles, lights = load_tiles(tmp_path), load_lights(tmp_path)
    assert lights.names == ("kiara_1_dawn",)
    assert sorted(tiles.by_material) == ["metal", "stone", "wood"]
    assert all(tile.family != "grass" for kept in tiles.by_material.values() for tile in kept)


def test_a_radiance_picture_is_read_and_a_broken_one_is_named(tmp_path):
    path = tmp_path / "a.hdr"
    path.write_bytes(_radiance())
    assert read_radiance(path) == pytest.approx(np.full((8, 16, 3), [1.0, 0.5, 0.25]), abs=0.01)
    path.write_bytes(_radiance()[:-5])
    with pytest.raises(ValueError, match="cut short"):
        read_radiance(path)
    path.write_bytes(b"P6 1 1")
    with pytest.raises(ValueError, match=r"a\.hdr"):
        read_radiance(path)


def test_a_shard_is_balanced_with_the_first_four_twice_as_often():
    names = mixture(60)
    assert len(names) == 60
    counts = {name: names.count(name) for name in set(names)}
    assert set(counts) == {*materials.MATERIALS, materials.UNKNOWN}
    assert counts["glass"] >= 1.5 * counts["paper"]
    assert counts[materials.UNKNOWN] <= counts["paper"]


def test_runs_with_other_seeds_share_neither_files_nor_pictures(tmp_path):
    first, second = (shards(Order(tmp_path, 5000, seed)) for seed in (1, 2))
    assert not {path for path, _ in first} & {path for path, _ in second}
    assert not {seed for _, seed in first} & {seed for _, seed in second}


def test_a_shard_that_exists_is_not_made_again_and_a_missing_one_is(tmp_path, monkeypatch):
    monkeypatch.setattr("hapticvlm_lab.training.render.shards.PER_SHARD", 4)
    order = Order(tmp_path / "out", 8, 7, SIDE)
    paths = list(make(order, None, None))
    kept, lost = paths
    before = kept.read_bytes(), lost.read_bytes()
    kept.write_bytes(b"kept")
    lost.unlink()
    assert list(make(order, None, None)) == paths
    assert kept.read_bytes() == b"kept"
    assert _same(load(lost), _loaded(before[1], tmp_path))
    assert not list(order.folder.glob("*.partial"))


def test_the_command_writes_contact_sheets(tmp_path):
    arguments = ["--out", str(tmp_path), "--side", "16", "--count", "4", "--sheet", "paper"]
    assert command.main(arguments) == 0
    with Image.open(tmp_path / "paper.png") as sheet:
        assert sheet.size == (12 * 16, 16)


def test_bodies_are_centred_fit_a_ball_and_their_faces_look_outward():
    from hapticvlm_lab.training.render.bodies import _SHAPES

    makers = {maker for shapes in _SHAPES.values() for maker, _ in shapes}
    dice = Dice(11)
    for maker in sorted(makers, key=lambda one: one.__name__):
        shape: Body = maker(dice)
        mesh: Mesh = shape.mesh
        assert mesh.radius == pytest.approx(1, abs=0.01), maker.__name__
        assert np.isfinite(mesh.normals).all(), maker.__name__
        assert np.allclose(np.linalg.norm(mesh.normals, axis=1), 1, atol=1e-3), maker.__name__
        if not shape.open:
            assert _volume(mesh) > 0, maker.__name__


def _volume(mesh: Mesh) -> float:
    a, b, c = (mesh.points[mesh.faces[:, corner]] for corner in range(3))
    return float((a * np.cross(b, c)).sum() / 6)


def _same(first: Batch, second: Batch) -> bool:
    return first.images.tobytes() == second.images.tobytes() and first.labels == second.labels


def _loaded(content: bytes, folder: Path) -> Batch:
    path = folder / "copy.npz"
    path.write_bytes(content)
    return load(path)


def _write_tiles(folder: Path) -> None:
    """Tiles that may teach, and ones that are held back and no pictures at all."""
    rng = np.random.default_rng(0)
    for name in ("wood/Wood001.jpg", "metal/Metal001.jpg", "brick/Bricks002.jpg"):
        path = folder / "ambientcg_tiles" / name
        path.parent.mkdir(parents=True, exist_ok=True)
        Image.fromarray(rng.integers(0, 255, (120, 120, 3), np.uint8)).save(path)
    for name in ("foliage/Grass001.jpg", "wood/WoodFloor043.jpg"):
        path = folder / "ambientcg_tiles" / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(b"not to be read")


def _radiance() -> bytes:
    """A picture of 8 rows of 16 px, red 1, green 0.5, blue 0.25."""
    row = b"\x02\x02\x00\x10" + b"".join(bytes([128 + 16, value]) for value in (128, 64, 32, 129))
    return b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 8 +X 16\n" + 8 * row


def test_more_shards_than_a_seed_has_numbers_for_are_refused(tmp_path):
    with pytest.raises(ValueError, match="several"):
        shards(Order(tmp_path, 10**6, 1))
