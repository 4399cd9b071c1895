"""The gallery that a named network gets on first use, from the shipped reference pictures."""

import json
import re
from pathlib import Path

import numpy as np
import pytest
from tiny_encoders import crop, write_classifier, write_graph

from hapticvlm import materials
from hapticvlm.vision.encoders import joint_embedding
from hapticvlm.vision.encoders.encoder import NetworkEncoder
from hapticvlm.vision.encoders.file_encoder import USUAL, FileEncoder, load_file_encoder
from hapticvlm.vision.galleries import network_gallery
from hapticvlm.vision.galleries.gallery import log_softmax
from hapticvlm.vision.galleries.network_gallery import NAMES, read_references
from hapticvlm.vision.galleries.storage import GalleryError, load_gallery
from hapticvlm.vision.loading import load_encoder


@pytest.fixture
def encoder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> NetworkEncoder:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    found = load_file_encoder(write_classifier(tmp_path / "tiny.onnx"))
    assert isinstance(found, NetworkEncoder)
    return found


def test_the_reference_pictures_show_every_material_alike() -> None:
    crops, labels = read_references(64)
    counts = np.bincount(labels)
    assert len(counts) == len(NAMES)
    assert set(counts[:-1].tolist()) == {48}
    assert all(found.image.shape == (64, 64, 3) for found in crops)
    assert all(0.05 < (found.mask > 0).mean() < 1.0 for found in crops)


@pytest.mark.slow
def test_a_named_network_is_fitted_once_and_kept(
    encoder: NetworkEncoder, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(network_gallery, "LEAST", 0.0)  # this one has random weights
    first = load_gallery(encoder=encoder)
    assert first.encoder == encoder.name
    assert set(first.candidates) == set(materials.MATERIALS)
    assert len(list((tmp_path / "cache" / "hapticvlm").glob("gallery-*.npz"))) == 1
    monkeypatch.setattr(network_gallery, "REFERENCES", tmp_path / "gone")
    again = load_gallery(encoder=encoder)
    shown = encoder.embed([crop(1, encoder.side)])
    assert np.allclose(again.beliefs(shown), first.beliefs(shown), atol=1e-3)


def test_other_weights_or_other_colours_beside_the_same_file_are_fitted_again(
    encoder: NetworkEncoder, tmp_path: Path
) -> None:
    (tmp_path / "other").mkdir()
    weights = load_file_encoder(write_classifier(tmp_path / "other" / "tiny.onnx", seed=5))
    stated = {"size": encoder.side, "image_mean": [0.4] * 3, "image_std": [0.3] * 3}
    (tmp_path / "preprocessor_config.json").write_text(json.dumps(stated))
    colours = load_encoder(str(tmp_path / "tiny.onnx"))
    assert colours.name == encoder.name
    for other in (weights, colours):
        assert isinstance(other, NetworkEncoder)
        assert network_gallery.cached_gallery(other) != network_gallery.cached_gallery(encoder)


def test_of_the_usual_preparations_the_one_that_the_network_sees_by_is_kept_and_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    """This one takes levels 0 to 255 and rounds, so it sees nothing of smaller ones."""
    from onnx import helper

    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    monkeypatch.setattr(network_gallery, "LEAST", 0.0)  # it has random weights
    monkeypatch.setattr(network_gallery, "STEPS", 30)
    nodes = [
        helper.make_node("Constant", [], ["step"], value_float=20.0),
        helper.make_node("Div", ["pixels", "step"], ["steps"]),
        helper.make_node("Round", ["steps"], ["levels"]),
        helper.make_node("Conv", ["levels", "kernel"], ["map"], strides=[4, 4]),
        helper.make_node("GlobalAveragePool", ["map"], ["mean"]),
    ]
    path = write_graph(tmp_path / "net.onnx", [1, 3, 32, 32], nodes, ["mean"])
    first, again = (load_encoder(str(path)) for _ in range(2))
    assert isinstance(first, FileEncoder)
    assert isinstance(again, FileEncoder)
    assert (
        first.preprocessing == load_file_encoder(path).preparations[list(USUAL).index("0 to 255")]
    )
    assert again.revision == first.revision
    assert caplog.text.count("prepared as 0 to 255") == 1  # it is tried once


def test_a_gallery_that_was_named_is_not_replaced(encoder: NetworkEncoder, tmp_path: Path) -> None:
    with pytest.raises(GalleryError):
        load_gallery(tmp_path / "absent.npz", encoder=encoder)


def fitted(beliefs: np.ndarray, features: np.ndarray, labels: np.ndarray) -> np.ndarray:
    embeddings = joint_embedding.join(features.astype(np.float32), beliefs.astype(np.float32))
    fit = network_gallery.fit("tiny", embeddings, labels, has_beliefs=True)
    return np.asarray(fit.gallery.shipped_logits(embeddings, NAMES).argmax(axis=1))


def test_classes_decide_where_features_do_not_and_the_other_way_round() -> None:
    rng = np.random.default_rng(1)
    labels = np.repeat(np.arange(len(NAMES)), 12)
    noise = np.abs(rng.normal(size=(len(labels), 20)))
    nothing = np.full((len(labels), len(NAMES)), 1.0 / len(NAMES))
    telling = 0.7 * np.eye(len(NAMES))[labels] + 0.3 / len(NAMES)
    shown = np.eye(20)[labels] + 0.1 * noise
    assert (fitted(telling, noise, labels) == labels).mean() > 0.9
    assert (fitted(nothing, shown, labels) == labels).mean() > 0.9


def test_the_share_told_rightly_is_of_pictures_that_were_left_out() -> None:
    rng = np.random.default_rng(2)
    labels = np.repeat(np.arange(len(NAMES)), 12)
    telling = joint_embedding.join(np.eye(20, dtype=np.float32)[labels], None)
    # As many features as pictures: a layer tells all those it was fitted to, and no other.
    own = joint_embedding.join(np.eye(len(labels), dtype=np.float32), None)
    noise = joint_embedding.join(rng.normal(size=(len(labels), 20)).astype(np.float32), None)
    for embeddings, is_telling in ((telling, True), (own, False), (noise, False)):
        fit = network_gallery.fit("tiny", embeddings, labels, has_beliefs=False)
        assert fit.tells_materials == is_telling
    assert network_gallery.fit("tiny", telling, labels, has_beliefs=False).share == 1.0


@pytest.mark.slow
def test_a_network_that_hardly_tells_materials_apart_is_warned_of_at_each_start(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    caplog: pytest.LogCaptureFixture,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    encoder = load_file_encoder(write_classifier(tmp_path / "random.onnx"))
    for _ in range(2):
        caplog.clear()
        load_gallery(encoder=encoder)
        assert "hardly tells materials apart" in caplog.text
        printed = capsys.readouterr().err
        assert re.search("right about [0-9]+% of .* left out; chance is 8%", printed)


def test_no_layer_near_the_fitted_one_is_less_surprised() -> None:
    rng = np.random.default_rng(4)
    labels = np.tile(np.arange(4), 30)
    rows = (np.eye(4, 12)[labels] + rng.normal(0.0, 0.4, (120, 12))).astype(np.float32)
    weights = np.full(120, 1 / 120)

    def surprise(weight: np.ndarray, bias: np.ndarray) -> float:
        logs = log_softmax(rows @ weight + bias)[np.arange(120), labels]
        return float(-logs.mean() + 0.01 / 2 * (weight.astype(float) ** 2).sum())

    fitted = network_gallery.fit_layer(rows, labels, weights, 0.01)
    least = surprise(fitted.weights, fitted.bias)
    assert least < 0.8 * np.log(4)
    for _ in range(50):
        step, shift = rng.normal(0.0, 0.02, (12, 4)), rng.normal(0.0, 0.02, 4)
        assert surprise(fitted.weights + step, fitted.bias + shift) > least
