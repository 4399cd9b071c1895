"""Training: what it writes, how it varies pictures, that it learns, goes on, and ships the same."""

import json
import shutil
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

torch = pytest.importorskip("torch", reason="extra `train` is not installed")

from hapticvlm import materials  # noqa: E402
from hapticvlm.vision.encoders.loading import load_encoder  # noqa: E402
from hapticvlm.vision.galleries.gallery import Gallery, Pictures  # noqa: E402
from hapticvlm.vision.pictures import Crop  # noqa: E402
from hapticvlm_lab.training import answers, export, fit, pool, sources, teacher  # noqa: E402
from hapticvlm_lab.training.distil import (  # noqa: E402
    CHECKPOINT,
    Plan,
    Run,
    left_out_scores,
    train,
)
from hapticvlm_lab.training.finish import fit_projection  # noqa: E402
from hapticvlm_lab.training.network import Network, Shape, prepare  # noqa: E402
from hapticvlm_lab.training.variations import mix, vary  # noqa: E402

NEVER_TAUGHT = ("choose_web", "report_web", "caltech101", "pb_renders", "weather", "sealed")
TINY = Shape((1, 1), (8, 16), 16)


@pytest.fixture(autouse=True)
def one_thread():
    torch.set_num_threads(1)


def stripes(rng, side, along):
    wave = np.sin(np.arange(side) * 0.8 + rng.uniform(0, 6)) * 90 + 128
    plane = np.tile(wave, (side, 1)) if along else np.tile(wave[:, None], (1, side))
    noisy = plane[..., None] + rng.normal(0, 12, (side, side, 3))
    return np.clip(noisy, 0, 255).astype(np.uint8)


def make_pool(folder, count=96, side=32):
    """Two textures as a pool: the teachers answer each with a direction of its own."""
    rng = np.random.default_rng(1)
    images = np.stack([stripes(rng, side, row % 2) for row in range(count)])
    masks = np.full((count, side, side, 1), 255, np.uint8)
    labels = np.array([("glass", "fabric", "")[row % 2 if row % 6 else 2] for row in range(count)])
    features = np.eye(1280)[[row % 2 for row in range(count)]] + rng.random((count, 1280)) * 0.05
    scores = np.zeros((count, 1000))
    folder.mkdir(parents=True, exist_ok=True)
    np.save(folder / f"a{pool.CROPS}", np.concatenate([images, masks], axis=3))
    answers = {f"features_{name}": features.astype(np.float16) for name in teacher.FILES}
    answers |= {f"scores_{name}": scores.astype(np.float16) for name in teacher.FILES}
    sources_of = np.array(["rooms", "clothing"])[np.arange(count) % 2]
    every: dict[str, Any] = {**answers, "label": labels, "source": sources_of}
    np.savez(folder / f"a{pool.ANSWERS}", **every)
    return folder


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
    groups = [sources.ROUNDS, sources.HELD_BACK, sources.CALIBRATION]
    groups.append((sources.CHOICE, sources.REPORT))
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


def test_nothing_that_is_only_reported_on_teaches(tmp_path):
    (tmp_path / "labels.csv").write_text(
        "path,class\n" + "".join(f"{name}/x/a.jpg,wood\n" for name in NEVER_TAUGHT)
    )
    assert pool.pictures(tmp_path) == []


def test_varied_crops_keep_their_shape_and_a_mask_of_two_values():
    crops = np.random.default_rng(2).integers(0, 255, (64, 128, 128, 4), np.uint8)
    crops[..., 3] = 255
    varied = vary(crops, 96, np.random.default_rng(3))
    assert varied.shape == (64, 96, 96, 4)
    assert set(varied[..., 3].unique().tolist()) == {255}
    assert not torch.equal(varied[0], varied[1])


def test_a_mixed_batch_mixes_targets_as_it_mixes_crops():
    planes = torch.arange(4.0).view(4, 1, 1, 1)
    wanted = {"names": torch.arange(4.0).view(4, 1)}
    for seed in range(20):
        rng = np.random.default_rng(seed)
        mixed, targets, known = mix(planes, wanted, torch.ones(4), rng)
        assert torch.allclose(mixed.view(-1), targets["names"].view(-1))
        assert known.tolist() == [1.0] * 4


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


def test_renders_get_their_share_of_a_batch_and_left_out_rows_are_never_drawn(tmp_path):
    known = answers.Pool(make_pool(tmp_path / "pool"), tmp_path)
    rows = known.draw(4000, np.random.default_rng(1))
    assert not set(rows.tolist()) & set(known.left_out.tolist())
    rendered = (rows % 2 == 0).mean()
    assert abs(rendered - answers.RENDERED) < 0.05


def test_a_pool_that_grows_is_taken_in(tmp_path):
    known = answers.Pool(make_pool(tmp_path / "pool"), tmp_path)
    for suffix in (pool.CROPS, pool.ANSWERS):
        shutil.copy(tmp_path / "pool" / f"a{suffix}", tmp_path / "pool" / f"b{suffix}")
    assert known.refresh() == 192
    assert known.crops(np.array([5, 101])).shape == (2, 32, 32, 4)


def test_an_empty_pool_says_what_to_do(tmp_path):
    with pytest.raises(FileNotFoundError, match="run the pool first"):
        answers.Pool(tmp_path, tmp_path)


def test_a_run_learns_two_textures_and_goes_on_where_it_was_cut(tmp_path):
    known = answers.Pool(make_pool(tmp_path / "pool"), tmp_path)
    plan = Plan(shape=TINY, batch=24, side=32, warm_up=5, rate=5e-3)
    run = Run(plan, known.names)
    before = left_out_scores(run, known)
    train(run, known, tmp_path / CHECKPOINT, most=60)
    after = left_out_scores(run, known)
    assert after["left_out_v2"] > before["left_out_v2"] + 0.15
    assert after["left_out_classes"] == 1.0
    again = Run(plan, known.names)
    again.load(tmp_path / CHECKPOINT)
    assert again.progress.step == 60
    ours, theirs = run.model.state_dict(), again.model.state_dict()
    assert all(torch.equal(ours[key], theirs[key]) for key in ours)


def test_a_branch_cools_down_to_nothing_and_ends(tmp_path):
    known = answers.Pool(make_pool(tmp_path / "pool"), tmp_path)
    run = Run(Plan(shape=TINY, batch=8, side=32, warm_up=1, cool=6), known.names)
    train(run, known, tmp_path / CHECKPOINT, most=100)
    assert run.progress.step == 6
    assert run.optimiser.param_groups[0]["lr"] < run.plan.rate / 5


def test_a_kept_average_begins_another_run(tmp_path):
    known = answers.Pool(make_pool(tmp_path / "pool"), tmp_path)
    run = Run(Plan(shape=TINY, batch=8, side=32, warm_up=1), known.names)
    train(run, known, tmp_path / CHECKPOINT, most=3)
    run.keep(tmp_path / "kept.safetensors")
    again = Run(Plan(shape=TINY), known.names)
    again.begin_with(tmp_path / "kept.safetensors")
    crops = torch.randint(0, 255, (3, 32, 32, 4), dtype=torch.uint8)
    with torch.no_grad():
        wanted, found = (r.average.eval()["network"](crops) for r in (run, again))
    assert float((wanted * found).sum(dim=1).min()) > 0.999


def test_folding_changes_nothing():
    torch.manual_seed(3)
    network = lively(Network(TINY))
    crops = torch.randint(0, 255, (3, 32, 32, 4), dtype=torch.uint8)
    with torch.no_grad():
        assert torch.allclose(network(crops), export.fold(network)(crops), atol=1e-5)


def test_what_ships_embeds_as_the_trained_network_does(tmp_path):
    pytest.importorskip("onnx", reason="extra `train` is not installed")
    torch.manual_seed(3)
    network = lively(Network(TINY))
    export.write(network, "tiny", 32, tmp_path)
    rng = np.random.default_rng(4)
    image = rng.integers(0, 255, (3, 32, 32, 3), np.uint8)
    mask = np.where(rng.random((3, 32, 32)) < 0.5, 255, 0).astype(np.uint8)
    encoder = load_encoder(str(tmp_path))
    given = [Crop(*pair) for pair in zip(image, mask, strict=True)]
    crops = torch.from_numpy(np.concatenate([image, mask[..., None]], axis=3))
    with torch.no_grad():
        wanted = network(crops).numpy()
        again = export.read(tmp_path)(crops).numpy()
    assert ((encoder.embed(given) * wanted).sum(axis=1) > 0.999).all()
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


def test_a_gallery_is_as_sure_of_each_kind_of_picture_as_it_is_right():
    """Four clouds; renders lie well apart and photographs far from their middles."""
    rng = np.random.default_rng(6)
    middles = 0.6 * np.eye(4, 16)

    def cloud(spread, count, shift=0.0):
        labels = np.tile(np.arange(4), count)
        rows = middles[labels] + rng.normal(shift, spread, (len(labels), 16))
        return (rows / np.linalg.norm(rows, axis=1, keepdims=True)).astype(np.float32), labels

    rows, labels = cloud(0.15, 60)
    taught = fit.Taught(rows, labels, labels, np.full(len(labels), "own"))
    plain = Gallery("e", fit.FOUR, np.eye(4, 16, dtype=np.float32), np.arange(4), fit.ALL_KNOWN)
    judged, kinds = [], (("renders", 0.15), ("photographs", 0.6))
    kind: Pictures
    for kind, spread in kinds:  # type: ignore[assignment]
        shown, truth = cloud(spread, 60)
        judged.append(fit.Judged(kind, kind, shown, np.array(fit.FOUR)[truth]))
    made = fit.fit_gallery(plain, taught, judged)
    for one in judged:
        beliefs = replace(made, pictures=one.pictures).beliefs(one.embeddings)
        right = np.array(fit.FOUR)[beliefs.argmax(axis=1)] == one.truth
        assert beliefs.max(axis=1).mean() == pytest.approx(right.mean(), abs=0.12)


def test_a_source_that_judges_does_not_teach():
    rows = np.eye(4, dtype=np.float32)
    taught = fit.Taught(rows, np.arange(4), np.arange(4), np.array(["a", "b", "a", "b"]))
    assert taught.without("a").labels.tolist() == [1, 3]


def test_the_embedding_keeps_what_tells_pictures_and_classes_apart():
    rng = np.random.default_rng(7)
    features = (rng.normal(0, 0.1, (300, 12)) + 3.0).astype(np.float32)
    features[:, 4] += rng.normal(0, 2.0, 300).astype(np.float32)  # pictures differ most in this
    quiet = np.zeros((3, 12), np.float32)
    quiet[0, 9] = 40.0  # and a head reads a class off what they hardly differ in
    weights, bias = fit_projection(features, [(quiet, np.ones(3, np.float32))], 2)
    found = features @ weights.T + bias
    assert np.abs(found.mean(axis=0)).max() < 1e-3
    for column in (4, 9):
        rows = np.column_stack([found, np.ones(300)])
        left = features[:, column] - rows @ np.linalg.lstsq(rows, features[:, column])[0]
        assert left.std() < 0.2 * features[:, column].std()
