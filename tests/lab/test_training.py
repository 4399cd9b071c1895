"""Training: what it writes, how it varies pictures, that it learns, goes on, and ships the same."""

import json

import numpy as np
import pytest

torch = pytest.importorskip("torch", reason="extra `train` is not installed")

from hapticvlm import materials  # noqa: E402
from hapticvlm.recognition.encoders.encoder import load_encoder  # noqa: E402
from hapticvlm.recognition.galleries.calibration import surprise  # noqa: E402
from hapticvlm.recognition.galleries.gallery import believe, score  # noqa: E402
from hapticvlm.recognition.pictures import Crop  # noqa: E402
from hapticvlm_lab.training import augment, export, fit, shards, sources, table, teacher  # noqa: E402
from hapticvlm_lab.training.network import Network, Shape, prepare  # noqa: E402
from hapticvlm_lab.training.train import BASIS, CHECKPOINT, Plan, Run, train  # noqa: E402

TINY = Shape((1, 1), (8, 16), 16)


@pytest.fixture(autouse=True)
def one_thread():
    torch.set_num_threads(1)


def stripes(rng, side, along):
    wave = np.sin(np.arange(side) * 0.8 + rng.uniform(0, 6)) * 90 + 128
    plane = np.tile(wave, (side, 1)) if along else np.tile(wave[:, None], (1, side))
    noisy = plane[..., None] + rng.normal(0, 12, (side, side, 3))
    return np.clip(noisy, 0, 255).astype(np.uint8)


def make_shards(folder, count=96, side=32):
    rng = np.random.default_rng(1)
    kinds = ["trashnet", "clothing"]
    images = np.stack([stripes(rng, side, row % 2) for row in range(count)])
    labels = np.array([("glass", "fabric", "")[row % 2 if row % 6 else 2] for row in range(count)])
    masks = np.full((count, side, side), 255, np.uint8)
    path = folder / "crops" / "shard_00000.npz"
    named = np.array([kinds[row % 2] for row in range(count)])
    shards.write(shards.Shard(images, masks, labels, np.arange(count), named), path)
    features = np.eye(1280)[[row % 2 for row in range(count)]] + rng.random((count, 1280)) * 0.05
    np.save(shards.features_path(path), features.astype(np.float16))
    return path


def lively(network):
    """Give batch norms statistics of a trained network, so that folding them matters."""
    for module in network.modules():
        if isinstance(module, torch.nn.BatchNorm1d | torch.nn.BatchNorm2d):
            module.running_mean.normal_(0, 0.3)
            module.running_var.uniform_(0.5, 2.0)
            module.weight.data.uniform_(0.5, 1.5)
            module.bias.data.normal_(0, 0.3)
    return network.eval()


def test_no_source_both_teaches_and_is_reported():
    groups = [sources.LABELLED, sources.HELD_BACK, sources.CALIBRATION]
    everything = [name for group in groups for name in group]
    assert len(everything) == len(set(everything))
    assert not sources.LIVING_TAUGHT & sources.LIVING_HELD_BACK


def test_variants_of_one_texture_are_held_back_together():
    for asset in ("Wood001", "Metal041", "Fabric020", "Bamboo001"):
        kept = {sources.is_tile_held_back(f"ambientcg_tiles/x/{asset}{v}.jpg") for v in "ABC"}
        assert len(kept) == 1
    assert sources.is_tile_held_back("ambientcg_tiles/wood/WoodFloor043.jpg")


def test_brick_and_concrete_count_as_stone_and_soil_as_nothing():
    assert sources.material_of("brick") == "stone"
    assert sources.material_of("other") == materials.UNKNOWN


def test_a_shard_comes_back_as_it_was_written(tmp_path):
    path = make_shards(tmp_path)
    assert shards.paths([tmp_path / "crops"]) == [path]
    again = shards.read(path)
    assert again.images.shape == (96, 32, 32, 3)
    assert again.labels[1] == "fabric"


def test_varied_crops_keep_their_shape_and_always_have_an_object():
    dice = torch.Generator().manual_seed(2)
    crops = torch.randint(0, 255, (64, 40, 40, 4), dtype=torch.uint8)
    crops[..., 3] = 0
    crops[:, 18:20, 18:20, 3] = 255
    varied = augment.vary(crops, 32, dice)
    assert varied.shape == (64, 32, 32, 4)
    assert set(varied[..., 3].unique().tolist()) <= {0, 255}
    assert bool((varied[..., 3] > 0).flatten(1).any(dim=1).all())
    assert not torch.equal(varied[0], varied[1])


def test_what_lies_outside_the_mask_hardly_reaches_the_network():
    crops = torch.full((2, 32, 32, 4), 90, dtype=torch.uint8)
    crops[..., 3] = 0
    crops[:, 8:24, 8:24, 3] = 255
    crops[1, :, :4, :3] = 250
    first, second = prepare(crops)
    crops[1] = crops[0]
    crops[1, 10:14, 10:14, :3] = 250
    _, inside = prepare(crops)
    outside_moved = float((first - second).abs().max())
    assert outside_moved < 0.3 * float((first - inside).abs().max())


def test_the_teachers_feature_leans_on_what_is_under_the_mask():
    maps = np.zeros((1, 2, 7, 7), np.float32)
    maps[0, 0, :, :3], maps[0, 1, :, 3:] = 1.0, 1.0
    mask = np.zeros((1, 70, 70), np.uint8)
    mask[:, :, :28] = 255
    feature = teacher.pool(maps, mask)[0]
    assert feature[0] > 2 * feature[1]


def test_dimming_leaves_the_object_alone():
    images = np.full((1, 8, 8, 3), 200, np.uint8)
    masks = np.zeros((1, 8, 8), np.uint8)
    masks[:, 2:6, 2:6] = 255
    dimmed = teacher.dim(images, masks)
    assert (dimmed[0, 2:6, 2:6] == 200).all()
    assert np.ptp(dimmed[0, 0, 0].astype(int)) < 20
    assert dimmed[0, 0, 0].max() < 150


def test_draws_take_cells_evenly_and_calibration_pictures_never(tmp_path):
    path = make_shards(tmp_path)
    shard = shards.read(path)
    kinds = shard.kinds.copy().astype("<U20")
    kinds[:10] = "weather"
    shards.write(
        shards.Shard(shard.images, shard.masks, shard.labels, shard.instances, kinds), path
    )
    known = table.load([tmp_path / "crops"], tmp_path / BASIS)
    assert len(known.labels) == 86
    assert not any("weather" in name for name in known.names)
    rows = table.Draws(known, 0.25, 1).batch(400)
    labels = known.labels[rows]
    assert 80 <= (labels == table.NOBODY_KNOWS).sum() <= 120
    glass = (labels == table.CLASSES.index("glass")).sum()
    assert 100 <= glass <= 200


def test_a_run_learns_two_textures_and_goes_on_where_it_was_cut(tmp_path):
    make_shards(tmp_path)
    plan = Plan(shape=TINY, steps=60, batch=24, side=32, late_side=32, warm_up=5, rate=5e-3)
    run = Run(plan, torch.device("cpu"))
    before = _loss(run, tmp_path)
    train(run, tmp_path, [tmp_path / "crops"])
    assert _loss(run, tmp_path) < 0.7 * before
    again = Run(plan, torch.device("cpu"))
    again.load(tmp_path / CHECKPOINT)
    assert again.step == 60
    ours, theirs = run.network.state_dict(), again.network.state_dict()
    assert all(torch.equal(ours[key], theirs[key]) for key in ours)


def _loss(run, folder):
    known = table.load([folder / "crops"], folder / BASIS)
    run.network.eval()
    with torch.no_grad():
        features = run.network.features(prepare(torch.from_numpy(known.crops)))
        embeddings = torch.nn.functional.normalize(run.network.project(features), dim=1)
        targets, labels = torch.from_numpy(known.targets), torch.from_numpy(known.labels)
        return float(run.heads.losses(features, embeddings, targets, labels)["classify"])


def test_folding_changes_nothing():
    torch.manual_seed(3)
    network = lively(Network(TINY))
    crops = torch.randint(0, 255, (3, 32, 32, 4), dtype=torch.uint8)
    with torch.no_grad():
        assert torch.allclose(network(crops), export.fold(network)(crops), atol=1e-5)


@pytest.mark.parametrize(("precision", "least"), [("float32", 0.99999), ("int8", 0.99)])
def test_what_ships_embeds_as_the_trained_network_does(tmp_path, precision, least):
    pytest.importorskip("onnx", reason="extra `train` is not installed")
    torch.manual_seed(3)
    network = lively(Network(TINY))
    export.write(network, "tiny", 32, tmp_path, precision)
    rng = np.random.default_rng(4)
    image = rng.integers(0, 255, (3, 32, 32, 3), np.uint8)
    mask = np.where(rng.random((3, 32, 32)) < 0.5, 255, 0).astype(np.uint8)
    encoder = load_encoder(str(tmp_path))
    given = [Crop(*pair) for pair in zip(image, mask, strict=True)]
    crops = torch.from_numpy(np.concatenate([image, mask[..., None]], axis=3))
    with torch.no_grad():
        wanted = network(crops).numpy()
        again = export.read(tmp_path)(crops).numpy()
    assert ((encoder.embed(given) * wanted).sum(axis=1) > least).all()
    assert ((again * wanted).sum(axis=1) > 0.999).all()
    assert json.loads((tmp_path / "encoder.json").read_text())["dimension"] == 16


def test_each_source_of_a_class_gives_references():
    rng = np.random.default_rng(5)
    rows = rng.normal(0, 0.05, (200, 8)) + np.repeat(np.eye(8)[:2], 100, axis=0)
    labels, cells = np.repeat([0, 1], 100), np.repeat([0, 1, 2, 3], 50)
    references, of = fit.choose_references(rows.astype(np.float32), labels, cells, 1)
    assert np.allclose(np.linalg.norm(references, axis=1), 1.0, atol=1e-5)
    assert (np.diff(of) >= 0).all()
    assert (references[of == 0, 0] > 0.8).all()


def test_calibration_believes_what_it_can_tell_and_rejects_what_is_far():
    rng = np.random.default_rng(6)
    near = np.repeat(np.eye(4)[:2], 40, axis=0) + rng.normal(0, 0.1, (80, 4))
    far = np.eye(4)[[2] * 40] + rng.normal(0, 0.1, (40, 4))
    rows = np.concatenate([near, far])
    rows = (rows / np.linalg.norm(rows, axis=1, keepdims=True)).astype(np.float32)
    truth = np.array([0] * 40 + [1] * 40 + [-1] * 40)
    references, of = np.eye(4, dtype=np.float32)[:2], np.array([0, 1])
    judged = fit.Judged(rows, truth, fit.weigh(truth))
    found = fit.fit_calibration([judged], references, of, 2)
    beliefs = believe(score(rows, references, of, found.sharpness), found)
    assert beliefs[:40, 0].mean() > 0.8
    assert beliefs[80:].sum(axis=1).mean() < 0.3
    nothing = surprise(np.full((120, 2), 0.25), truth, judged.weights, 2)
    assert surprise(beliefs, truth, judged.weights, 2) < 0.5 * nothing
