"""Training: what may teach, that a head learns, is the same again, and ships as it was fitted."""

import numpy as np
import pytest

torch = pytest.importorskip("torch", reason="extra `train` is not installed")
onnx = pytest.importorskip("onnx", reason="extra `train` is not installed")

from hapticvlm import materials  # noqa: E402
from hapticvlm.vision.encoders import joint_embedding  # noqa: E402
from hapticvlm.vision.encoders.encoder import SHIPPED  # noqa: E402
from hapticvlm.vision.encoders.onnx_encoder import open_session  # noqa: E402
from hapticvlm.vision.galleries.gallery import LinearLayer  # noqa: E402
from hapticvlm_lab.training import (  # noqa: E402
    describing,
    flat_layer,
    head,
    making,
    shipped_graph,
    sources,
)
from hapticvlm_lab.training.crops import SIDE  # noqa: E402
from hapticvlm_lab.training.describing import NAMES, Described  # noqa: E402
from hapticvlm_lab.training.making import choose_references  # noqa: E402
from hapticvlm_lab.training.shipped_graph import FEATURES, Head  # noqa: E402

pytestmark = pytest.mark.nightly

NEVER_TAUGHT = ("choose_web", "report_web", "caltech101", "pb_renders", "weather", "sealed")
FEW = (8,) * 6  # channels of the stages of a small network
FEW_FEATURES = 2 * sum(FEW) + shipped_graph.LAST
GRAPH = (SHIPPED / "lite0" / "encoder.onnx").read_bytes()


@pytest.fixture
def small_head(monkeypatch):
    """A head of a small network that is fitted in a second."""
    for name, value in (("WIDTH", 16), ("BATCH", 32), ("STAGES", FEW)):
        monkeypatch.setattr(head, name, value)


def shown(seed, side=SIDE):
    """A smooth picture whose left half is the object."""
    rng = np.random.default_rng(seed)
    waves = np.sin(np.arange(side) * rng.uniform(0.05, 0.5) + rng.uniform(0, 6))
    image = 128 + 60 * np.outer(waves, waves[::-1])[..., None] * rng.uniform(0.4, 1.6, 3)
    crop = np.zeros((side, side, 4), np.uint8)
    crop[..., :3] = np.clip(image, 0, 255)
    crop[:, : side // 2, 3] = 255
    return crop


def clouds(count, seed, spread=0.6):
    """Features of all materials, which differ in their means."""
    rng = np.random.default_rng(seed)
    labels = np.tile(np.arange(len(NAMES)), count)
    middles = np.random.default_rng(9).normal(size=(len(NAMES), FEW_FEATURES))
    features = middles[labels] + rng.normal(0, spread, (len(labels), FEW_FEATURES))
    scores = rng.normal(size=(len(labels), 1000))
    named = np.array(["rooms", "clothing"])[np.arange(len(labels)) % 2]
    return Described(features.astype("f2"), scores.astype("f2"), labels, named)


def test_no_source_both_teaches_and_is_reported():
    groups = [sources.TEACHING, sources.HELD_BACK, sources.CALIBRATION]
    groups.append((sources.CHOICE, sources.REPORT))
    everything = [name for group in groups for name in group]
    assert len(everything) == len(set(everything))


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
    assert describing.photographs(tmp_path) == []


def test_classes_count_alike_whatever_their_sources_give():
    labels = np.array([0] * 90 + [1] * 10)
    named = np.array(["rooms"] * 60 + ["clothing"] * 30 + ["trashnet"] * 10)
    weights = head.weigh(labels, named)
    assert weights.sum() == pytest.approx(1.0)
    assert weights[labels == 0].sum() == pytest.approx(weights[labels == 1].sum())


@pytest.mark.usefixtures("small_head")
def test_a_head_learns_and_the_same_seed_gives_the_same_bytes():
    taught = clouds(40, 1)
    fitted, again = (head.fit([taught], 5) for _ in range(2))
    other = clouds(10, 2)
    logits = fitted.activation(other.features) @ fitted.layer.weights + fitted.layer.bias
    assert (logits.argmax(axis=1) == other.labels).mean() > 0.9
    assert again.head.weights.tobytes() == fitted.head.weights.tobytes()
    assert again.layer.weights.tobytes() == fitted.layer.weights.tobytes()


def test_features_lean_on_what_is_under_the_mask():
    session = open_session(shipped_graph.describing(GRAPH), 1)
    crop = shown(3)
    outside, inside = crop.copy(), crop.copy()
    outside[:, 140:, :3] = 255 - outside[:, 140:, :3]
    inside[:, :84, :3] = 255 - inside[:, :84, :3]
    plain, around, within = (
        session.run(["features"], {"crops": each[None]})[0][0, :24]  # means of the widest map
        for each in (crop, outside, inside)
    )
    assert np.abs(around - plain).sum() < 0.6 * np.abs(within - plain).sum()


def test_a_graph_with_another_head_embeds_as_its_fit_does():
    rng = np.random.default_rng(4)
    fitted = head.Fitted(
        Head(
            rng.normal(size=FEATURES).astype("f4"),
            rng.uniform(0.1, 1.0, FEATURES).astype("f4"),
            rng.integers(-127, 127, (FEATURES, 16)).astype("i1"),
            rng.uniform(0.01, 0.1, 16).astype("f4"),
            rng.normal(size=16).astype("f4"),
        ),
        LinearLayer(np.zeros((16, 1), np.float32), np.zeros(1, np.float32)),
    )
    session = open_session(shipped_graph.describing(GRAPH), 1)
    whole = open_session(shipped_graph.with_head(GRAPH, fitted.head), 1)
    for seed in range(30, 34):
        crop = {"crops": shown(seed)[None]}
        features, scores = session.run(["features", "_fc"], crop)
        named = np.array(["rooms"])
        wanted = fitted.embed(Described(features, scores, np.zeros(1, np.int64), named))
        found = whole.run(["embeddings"], crop)[0]
        assert found.shape == (1, 16 + joint_embedding.ADDED)
        assert np.linalg.norm(found) == pytest.approx(1.0, abs=1e-4)
        assert float((found * wanted).sum()) > 0.999


def test_the_head_that_ships_put_back_gives_the_file_that_ships():
    held = {
        each.name: onnx.numpy_helper.to_array(each)
        for each in onnx.load_model_from_string(GRAPH).graph.initializer
    }
    names = ("mean", "scale", "whole.stored", "steps", "bias")
    ships = Head(*(held[f"head.{name}"] for name in names))
    assert shipped_graph.with_head(GRAPH, ships) == GRAPH


def test_each_source_of_a_class_gives_references():
    rng = np.random.default_rng(5)
    rows = rng.normal(0, 0.05, (200, 8)) + np.repeat(np.eye(8)[:2], 100, axis=0)
    labels, cells = np.repeat([0, 1], 100), np.repeat([0, 1, 2, 3], 50)
    references, of = choose_references(rows.astype(np.float32), labels, cells, 1)
    assert np.allclose(np.linalg.norm(references, axis=1), 1.0, atol=1e-5)
    assert (np.diff(of) >= 0).all()
    assert (references[of == 0, 0] > 0.8).all()


@pytest.mark.usefixtures("small_head")
def test_a_gallery_is_as_sure_as_it_is_right_on_pictures_that_taught_nothing():
    fitted = head.fit([clouds(40, 1)], 5)
    judged = {name: clouds(40, seed, 8.0) for seed, name in ((2, "choose_web"), (3, "rooms"))}
    made, _ = making.make_gallery(fitted, [clouds(40, 1)], judged)
    known = judged["rooms"].labels < len(made.candidates)
    beliefs = made.beliefs(fitted.embed(judged["rooms"]))[known]
    right = beliefs.argmax(axis=1) == judged["rooms"].labels[known]
    assert 0.4 < right.mean() < 0.99
    assert beliefs.max(axis=1).mean() == pytest.approx(right.mean(), abs=0.15)


def test_the_layer_of_flat_pictures_learns_kits_and_keeps_what_the_other_knew(monkeypatch):
    monkeypatch.setattr(head, "BATCH", 32)
    rng = np.random.default_rng(3)
    looks = {name: rng.normal(size=(len(NAMES), 24)) for name in ("clothing", sources.KITS)}
    labels = np.tile(np.arange(len(NAMES)), 40)
    even = np.full((len(labels), joint_embedding.BELIEFS), 1 / joint_embedding.BELIEFS, "f4")

    def taught(name):
        rows = looks[name][labels] + rng.normal(0, 0.3, (len(labels), 24))
        embeddings = joint_embedding.join(rows.astype("f4"), even)
        return flat_layer.Embedded(embeddings, labels, np.full(len(labels), name))

    def right(layer, pictures):
        logits = pictures.embeddings @ layer.weights + layer.bias
        return (logits.argmax(axis=1) == pictures.labels).mean()

    photographs, kits = taught("clothing"), taught(sources.KITS)
    read = looks["clothing"].T.astype("f4")
    begin = LinearLayer(joint_embedding.layer_of(read, 0.5), np.zeros(len(NAMES), "f4"))
    both = flat_layer.Embedded(
        np.concatenate([photographs.embeddings, kits.embeddings]),
        np.concatenate([photographs.labels, kits.labels]),
        np.concatenate([photographs.sources, kits.sources]),
    )
    fitted, again = (flat_layer.fit(both, begin) for _ in range(2))
    assert right(begin, kits) < 0.4
    assert right(fitted, kits) > 0.8
    assert right(fitted, photographs) > right(begin, photographs) - 0.1
    assert again.weights.tobytes() == fitted.weights.tobytes()
    implied = slice(24, None)  # what the network's own classes imply keeps its exponent
    np.testing.assert_array_equal(fitted.weights[implied], begin.weights[implied])
