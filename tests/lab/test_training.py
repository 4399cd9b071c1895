"""Training: what may teach, that a head learns, is the same again, and ships as it was fitted."""

from typing import Any

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
    flat_layer,
    head,
    lite_graph,
    making,
    pool,
    sources,
    start_weights,
)
from hapticvlm_lab.training.describing import NAMES, Described  # noqa: E402
from hapticvlm_lab.training.graph_writer import filled  # noqa: E402
from hapticvlm_lab.training.lite_graph import Head, Network  # noqa: E402
from hapticvlm_lab.training.making import choose_references  # noqa: E402

pytestmark = pytest.mark.nightly

NEVER_TAUGHT = ("choose_web", "report_web", "caltech101", "pb_renders", "weather", "sealed")
TINY = Network(64, (8, 8, 8, 8, 8, 8, 8), (1, 1, 1, 1, 1, 1, 1))


def weights_of(graph):
    """Give a graph random weights, by the shapes it names."""
    rng = np.random.default_rng(1)
    layers = {}
    for tensor in graph:
        name = tensor.name.removesuffix(".weights")
        if name != tensor.name:
            shape = tuple(tensor.dims)
            spread = 1.4 / np.sqrt(np.prod(shape[1:]))
            drawn = rng.normal(0, spread, shape), rng.normal(0, 0.1, shape[0])
            layers[name] = start_weights.Layer(*drawn)
    return layers


def tiny_network():
    """The float graph of a tiny network, its layers, and the ranges that pictures give it."""
    model, graph = lite_graph.describing(TINY, None)
    layers = weights_of(model.graph.initializer)
    session = open_session(filled(model, start_weights.floats(layers)), 1)
    ranges: dict[str, tuple[float, float]] = {}
    for seed in range(8):
        seen = session.run(graph.watched, {"crops": shown(seed)[None]})
        for name, values in zip(graph.watched, seen, strict=True):
            low, high = ranges.get(name, (np.inf, -np.inf))
            ranges[name] = (min(low, float(values.min())), max(high, float(values.max())))
    return layers, session, ranges


def shown(seed, side=64):
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
    middles = np.random.default_rng(9).normal(size=(len(NAMES), TINY.features))
    features = middles[labels] + rng.normal(0, spread, (len(labels), TINY.features))
    scores = rng.normal(size=(len(labels), 1000))
    named = np.array(["rooms", "clothing"])[np.arange(len(labels)) % 2]
    return Described(features.astype("f2"), scores.astype("f2"), labels, named)


def test_no_source_both_teaches_and_is_reported():
    groups = [sources.TEACHING, sources.HELD_BACK, sources.CALIBRATION]
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


def test_classes_count_alike_whatever_their_sources_give():
    labels = np.array([0] * 90 + [1] * 10)
    named = np.array(["rooms"] * 60 + ["clothing"] * 30 + ["trashnet"] * 10)
    weights = head.weigh(labels, named)
    assert weights.sum() == pytest.approx(1.0)
    assert weights[labels == 0].sum() == pytest.approx(weights[labels == 1].sum())


def test_a_head_learns_and_the_same_seed_gives_the_same_bytes(monkeypatch):
    monkeypatch.setattr(head, "WIDTH", 16)
    monkeypatch.setattr(head, "BATCH", 32)
    taught = clouds(40, 1)
    fitted, again = (head.fit([taught], TINY, 5) for _ in range(2))
    other = clouds(10, 2)
    logits = fitted.activation(other.features) @ fitted.layer.weights + fitted.layer.bias
    assert (logits.argmax(axis=1) == other.labels).mean() > 0.9
    assert again.head.weights.tobytes() == fitted.head.weights.tobytes()
    assert again.layer.weights.tobytes() == fitted.layer.weights.tobytes()


def test_whole_numbers_give_nearly_what_floats_give():
    layers, floats, ranges = tiny_network()
    model, graph = lite_graph.describing(TINY, ranges)
    weights = start_weights.quantise(layers, graph.scales)
    session = open_session(filled(model, weights), 1)
    for seed in range(20, 26):
        crop = {"crops": shown(seed)[None]}
        wanted, found = (each.run(["features", "_fc"], crop) for each in (floats, session))
        for ours, theirs in zip(found, wanted, strict=True):
            assert np.corrcoef(ours.ravel(), theirs.ravel())[0, 1] > 0.97


def test_a_folded_convolution_gives_what_batch_norm_after_it_gave():
    rng = np.random.default_rng(1)
    weight, x = rng.normal(size=(5, 3, 1, 1)), rng.normal(size=3)
    gain, shift, mean, variance = rng.normal(size=(4, 5))
    norm = {"weight": gain, "bias": shift, "running_mean": mean, "running_var": variance**2}
    arrays = {"_conv_head.weight": weight, **{f"_bn1.{part}": norm[part] for part in norm}}
    arrays |= {"_fc.weight": np.zeros((2, 5)), "_fc.bias": np.zeros(2)}
    layer = start_weights.fold(arrays)["_conv_head"]
    plain = weight[..., 0, 0] @ x
    expected = gain * (plain - mean) / np.sqrt(variance**2 + start_weights.EPSILON) + shift
    assert np.allclose(layer.weights[..., 0, 0] @ x + layer.bias, expected)


def test_rounded_weights_stay_in_their_range_and_near_what_they_stand_for():
    rng = np.random.default_rng(2)
    layers = {
        "summed": start_weights.Layer(rng.normal(size=(7, 3, 1, 1)), rng.normal(size=7)),
        "depthwise": start_weights.Layer(rng.normal(size=(7, 1, 3, 3)), rng.normal(size=7)),
        "silent": start_weights.Layer(np.zeros((7, 3, 1, 1)), np.full(7, 4.0)),
    }
    found = start_weights.quantise(layers, dict.fromkeys(layers, 0.02))
    for name, most in (("summed", 63), ("depthwise", 127), ("silent", 0)):
        whole = found[f"{name}.weights"].astype(np.float64)
        assert np.abs(whole).max() == most
        steps = found[f"{name}.steps"].astype(np.float64)[:, None, None, None]
        assert np.abs(whole * steps - layers[name].weights).max() <= 0.51 * steps.max()
        bias = found[f"{name}.bias"] * found[f"{name}.unit"].astype(np.float64)
        assert np.allclose(bias, layers[name].bias, rtol=0.02, atol=0.002)


def test_the_shipped_file_holds_the_start_weights_rounded_here():
    graph = onnx.load(SHIPPED / "lite0" / "encoder.onnx").graph
    held: dict[str, Any] = {
        each.name: onnx.numpy_helper.to_array(each) for each in graph.initializer
    }
    layers = start_weights.fold(start_weights.read())
    scales = {name: held[f"{name}.unit"][0] / held[f"{name}.steps"][0] for name in layers}
    made: dict[str, Any] = dict(start_weights.quantise(layers, scales))
    for name in layers:
        np.testing.assert_array_equal(held[f"{name}.weights"], made[f"{name}.weights"])
        np.testing.assert_allclose(held[f"{name}.steps"], made[f"{name}.steps"], rtol=1e-6)


def test_features_lean_on_what_is_under_the_mask():
    _, floats, _ = tiny_network()
    crop = shown(3)
    outside, inside = crop.copy(), crop.copy()
    outside[:, 40:, :3] = 255 - outside[:, 40:, :3]
    inside[:, :24, :3] = 255 - inside[:, :24, :3]
    plain, around, within = (
        floats.run(["features"], {"crops": each[None]})[0][0, :8]  # means of the widest map
        for each in (crop, outside, inside)
    )
    assert np.abs(around - plain).sum() < 0.6 * np.abs(within - plain).sum()


def test_the_graph_that_ships_embeds_as_the_fit_does():
    layers, _, ranges = tiny_network()
    rng = np.random.default_rng(4)
    fitted = head.Fitted(
        Head(
            rng.normal(size=TINY.features).astype("f4"),
            rng.uniform(0.1, 1.0, TINY.features).astype("f4"),
            rng.integers(-127, 127, (TINY.features, 16)).astype("i1"),
            rng.uniform(0.01, 0.1, 16).astype("f4"),
            rng.normal(size=16).astype("f4"),
        ),
        LinearLayer(np.zeros((16, 1), np.float32), np.zeros(1, np.float32)),
    )
    described, graph = lite_graph.describing(TINY, ranges)
    weights = start_weights.quantise(layers, graph.scales)
    session = open_session(filled(described, weights), 1)
    shipped, _ = lite_graph.embedding(TINY, ranges, fitted.head)
    whole = open_session(filled(shipped, weights), 1)
    for seed in range(30, 34):
        crop = {"crops": shown(seed)[None]}
        features, scores = session.run(["features", "_fc"], crop)
        named = np.array(["rooms"])
        wanted = fitted.embed(Described(features, scores, np.zeros(1, np.int64), named))
        found = whole.run(["embeddings"], crop)[0]
        assert found.shape == (1, 16 + joint_embedding.ADDED)
        assert np.linalg.norm(found) == pytest.approx(1.0, abs=1e-4)
        assert float((found * wanted).sum()) > 0.999


def test_each_source_of_a_class_gives_references():
    rng = np.random.default_rng(5)
    rows = rng.normal(0, 0.05, (200, 8)) + np.repeat(np.eye(8)[:2], 100, axis=0)
    labels, cells = np.repeat([0, 1], 100), np.repeat([0, 1, 2, 3], 50)
    references, of = choose_references(rows.astype(np.float32), labels, cells, 1)
    assert np.allclose(np.linalg.norm(references, axis=1), 1.0, atol=1e-5)
    assert (np.diff(of) >= 0).all()
    assert (references[of == 0, 0] > 0.8).all()


def test_a_gallery_is_as_sure_as_it_is_right_on_pictures_that_taught_nothing(monkeypatch):
    monkeypatch.setattr(head, "WIDTH", 16)
    monkeypatch.setattr(head, "BATCH", 32)
    fitted = head.fit([clouds(40, 1)], TINY, 5)
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
        named = np.full(len(labels), name)
        return flat_layer.Embedded(embeddings, labels, named, np.zeros(len(labels), np.bool_))

    def right(layer, pictures):
        logits = pictures.embeddings @ layer.weights + layer.bias
        return (logits.argmax(axis=1) == pictures.labels).mean()

    photographs, kits = taught("clothing"), taught(sources.KITS)
    read = looks["clothing"].T.astype("f4")
    begin = LinearLayer(joint_embedding.layer_of(read, 0.5), np.zeros(len(NAMES), "f4"))
    fitted, again = (flat_layer.fit(flat_layer.join([photographs, kits]), begin) for _ in range(2))
    assert right(begin, kits) < 0.4
    assert right(fitted, kits) > 0.8
    assert right(fitted, photographs) > right(begin, photographs) - 0.1
    assert again.weights.tobytes() == fitted.weights.tobytes()
    implied = slice(24, None)  # what the network's own classes imply keeps its exponent
    np.testing.assert_array_equal(fitted.weights[implied], begin.weights[implied])
