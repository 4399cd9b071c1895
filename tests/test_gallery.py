"""The gallery: cosine matches, calibrated beliefs, and files that only fit their encoder."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from hapticvlm import materials
from hapticvlm.recognition.encoder import load_encoder
from hapticvlm.recognition.gallery import (
    Calibration,
    Gallery,
    GalleryError,
    load_gallery,
    save_gallery,
)
from hapticvlm.recognition.ladder import KNOWN, decide

Floats = NDArray[np.float32]


def unit(seed: int, count: int, dimension: int = 64) -> Floats:
    raw = np.random.default_rng(seed).normal(size=(count, dimension)).astype(np.float32)
    return np.asarray(raw / np.linalg.norm(raw, axis=1, keepdims=True), np.float32)


def small(encoder: str = "test-1") -> Gallery:
    labels = np.repeat(np.arange(3), 2)
    calibration = Calibration(sharpness=12.0, slope=12.0, threshold=0.5)
    return Gallery(encoder, ("wood", "glass", "metal"), unit(1, 6), labels, calibration)


def test_a_reference_matches_its_own_material() -> None:
    gallery = small()
    for reference, label in zip(gallery.references, gallery.labels, strict=True):
        evidence = gallery.match(reference)
        assert evidence.rung == "encoder"
        assert evidence.material == gallery.materials[label]
        assert evidence.confidence > 0.9


def test_a_stranger_has_little_mass_and_is_unknown() -> None:
    gallery = small()
    for stranger in unit(99, 50):
        evidence = gallery.match(stranger)
        assert sum(belief for _, belief in evidence.beliefs) < KNOWN
        assert decide([evidence]).material == materials.UNKNOWN


def test_beliefs_are_best_first_and_sum_to_at_most_one() -> None:
    gallery = small()
    for embedding in np.concatenate([unit(5, 50), gallery.references]):
        beliefs = [belief for _, belief in gallery.match(embedding).beliefs]
        assert beliefs == sorted(beliefs, reverse=True)
        assert sum(beliefs) <= 1.0 + 1e-9


def test_beliefs_agree_with_the_formula_written_out() -> None:
    gallery, x = small(), unit(7, 1)[0]
    k = gallery.calibration.sharpness
    powers = np.exp(k * gallery.references.astype(float) @ x)
    scores = np.log([powers[gallery.labels == c].mean() for c in range(3)]) / k
    known = 1 / (1 + np.exp(-12.0 * (scores.max() - 0.5)))
    expected = known * np.exp(k * scores) / np.exp(k * scores).sum()
    assert np.allclose(gallery.beliefs(x[None])[0], expected, rtol=1e-5)


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_an_embedding_that_is_not_finite_says_nothing(value: float) -> None:
    broken = unit(1, 1)[0].copy()
    broken[3] = value
    evidence = small().match(broken)
    assert evidence.material is None
    assert decide([evidence]).material == materials.UNKNOWN


def test_a_zero_embedding_is_not_known() -> None:
    assert small().match(np.zeros(64, np.float32)).confidence < KNOWN


def test_a_gallery_comes_back_as_it_was_saved(tmp_path: Path) -> None:
    encoder = load_encoder()
    gallery = replace(small(encoder.name), references=unit(1, 6, encoder.dimension))
    save_gallery(gallery, tmp_path / "one.npz")
    save_gallery(gallery, tmp_path / "two.npz")
    back = load_gallery(tmp_path / "one.npz", encoder=encoder)
    assert (back.materials, back.calibration) == (gallery.materials, gallery.calibration)
    assert np.allclose(back.references, gallery.references, atol=1e-3)
    assert np.allclose(np.linalg.norm(back.references, axis=1), 1.0, atol=1e-5)
    assert (tmp_path / "one.npz").read_bytes() == (tmp_path / "two.npz").read_bytes()


def test_a_gallery_of_another_encoder_is_refused_naming_both(tmp_path: Path) -> None:
    save_gallery(small("other-7"), tmp_path / "other.npz")
    encoder = load_encoder()
    with pytest.raises(GalleryError) as caught:
        load_gallery(tmp_path / "other.npz", encoder=encoder)
    assert "other-7" in str(caught.value)
    assert encoder.name in str(caught.value)


def test_files_that_are_no_gallery_are_refused(tmp_path: Path) -> None:
    encoder = load_encoder()
    whole = replace(small(encoder.name), references=unit(1, 6, encoder.dimension))
    empty_class = replace(whole, materials=("wood", "glass", "metal", "paper"))
    short = replace(whole, references=unit(1, 6, 8))
    rotten = whole.references.copy()
    rotten[0, 0] = np.nan
    for name, gallery in {
        "a": empty_class,
        "b": short,
        "c": replace(whole, references=rotten),
    }.items():
        save_gallery(gallery, tmp_path / f"{name}.npz")
        with pytest.raises(GalleryError):
            load_gallery(tmp_path / f"{name}.npz", encoder=encoder)
    (tmp_path / "d.npz").write_bytes(b"PK\x03\x04 nothing")
    for missing in ("d.npz", "not-there.npz"):
        with pytest.raises(GalleryError, match="no gallery"):
            load_gallery(tmp_path / missing, encoder=encoder)


def test_the_shipped_gallery_fits_the_shipped_encoder_and_the_material_table() -> None:
    encoder = load_encoder()
    gallery = load_gallery(encoder=encoder)
    assert set(gallery.materials) <= set(materials.MATERIALS)
    assert {"wood", "glass", "fabric", "metal"} <= set(gallery.materials)
    assert gallery.references.shape[1] == encoder.dimension


def test_an_object_of_the_users_own_is_known_again_once_enrolled() -> None:
    encoder = load_encoder()
    gallery = load_gallery(encoder=encoder)
    own = unit(21, 1, encoder.dimension)[0]
    views = own + 0.3 * unit(22, 4, encoder.dimension)
    views = np.asarray(views / np.linalg.norm(views, axis=1, keepdims=True), np.float32)
    grown = replace(
        gallery,
        materials=(*gallery.materials, "obsidian"),
        references=np.concatenate([gallery.references, views[:3]]),
        labels=np.append(gallery.labels, [len(gallery.materials)] * 3),
    )
    assert gallery.match(views[3]).confidence < KNOWN
    assert grown.match(views[3]).material == "obsidian"
    assert grown.match(views[3]).confidence > KNOWN
