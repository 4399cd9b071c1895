"""The gallery: cosine matches, calibrated beliefs, and files that only fit their encoder."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from hapticvlm import materials
from hapticvlm.evidence.ladder import FLOOR, KNOWN, decide
from hapticvlm.vision.galleries.calibration import FEW, calibrate, is_enough
from hapticvlm.vision.galleries.gallery import Calibration, Gallery, LinearLayer, log_softmax
from hapticvlm.vision.galleries.storage import (
    GalleryError,
    load_gallery,
    save_gallery,
    with_user_materials,
)
from hapticvlm.vision.galleries.user_materials import (
    UserMaterial,
    write_material,
)
from hapticvlm.vision.loading import load_encoder

Floats = NDArray[np.float32]


def unit(seed: int, count: int, dimension: int = 64) -> Floats:
    raw = np.random.default_rng(seed).normal(size=(count, dimension)).astype(np.float32)
    return np.asarray(raw / np.linalg.norm(raw, axis=1, keepdims=True), np.float32)


def small(encoder: str = "test-1") -> Gallery:
    labels = np.repeat(np.arange(3), 2)
    calibration = Calibration(sharpness=12.0, slope=12.0, threshold=0.5)
    return Gallery(encoder, ("wood", "glass", "metal"), unit(1, 6), labels, calibration)


def large(count: int, seed: int = 3) -> Gallery:
    """Three materials around a direction each, in no order, with as many references as wanted."""
    rng = np.random.default_rng(seed)
    labels = rng.integers(0, 3, count)
    labels[:3] = np.arange(3)
    references = unit(1, 3, 128)[labels] + 0.5 * unit(seed, count, 128)
    references /= np.linalg.norm(references, axis=1, keepdims=True)
    calibration = Calibration(sharpness=12.0, slope=12.0, threshold=0.5)
    return Gallery("test-1", ("wood", "glass", "metal"), references, labels, calibration)


def plus(gallery: Gallery, name: str, references: Floats) -> Gallery:
    """Add references of one material to those of a gallery."""
    names = tuple(dict.fromkeys((*gallery.materials, name)))
    return replace(
        gallery,
        materials=names,
        references=np.concatenate([gallery.references, references]),
        labels=np.append(gallery.labels, [names.index(name)] * len(references)),
    )


def test_a_flat_picture_has_a_scale_of_its_own() -> None:
    humble = replace(small(), calibration=replace(small().calibration, scale=0.5, flat=0.2))
    asked = humble.references[[0, 2]] + 0.8 * humble.references[[2, 4]]  # between two
    asked /= np.linalg.norm(asked, axis=1, keepdims=True)
    for embedding in asked:
        plain = humble.match(embedding)
        flat = humble.match(embedding, is_flat=True)
        assert flat.material == plain.material
        assert flat.confidence < plain.confidence - 0.02
    mixed = humble.beliefs(asked, np.array([True, False]))
    assert np.allclose(mixed[0], humble.beliefs(asked, np.array([True, True]))[0])
    assert np.allclose(mixed[1], humble.beliefs(asked)[1])
    untold = replace(humble, calibration=replace(humble.calibration, flat=1.0))
    assert untold.match(asked[0], is_flat=True) == untold.match(asked[0])


def test_flat_pictures_are_read_by_a_layer_of_their_own() -> None:
    layers = [LinearLayer(np.zeros((64, 3), np.float32), np.eye(3, dtype="f4")[n]) for n in (0, 1)]
    plain = Calibration(12.0, 1.0, -1000.0, 0.0)
    gallery = replace(small(), calibration=plain, layer=layers[0], flat_layer=layers[1])
    references = gallery.references
    assert gallery.match(references[0]).material == gallery.materials[0]
    assert gallery.match(references[0], is_flat=True).material == gallery.materials[1]
    beliefs = gallery.beliefs(references[:2], np.array([False, True]))
    assert beliefs.argmax(axis=1).tolist() == [0, 1]
    one = replace(gallery, flat_layer=None)
    assert one.match(references[0], is_flat=True).material == gallery.materials[0]


def test_texture_maps_are_read_by_a_layer_of_their_own() -> None:
    layer = LinearLayer(np.zeros((64, 3), np.float32), np.array([0.0, 2.0, 0.0], np.float32))
    constants = Calibration(12.0, 1.0, -1000.0, 0.0, even_slope=20.0, even=0.5)
    gallery = replace(small(), calibration=constants, texture_layer=layer)
    sure = gallery.match_texture(np.repeat(unit(5, 1), 6, axis=0))
    assert (sure.rung, sure.material) == ("texture", gallery.materials[1])
    assert sure.confidence > 0.5
    assert gallery.match_texture(np.eye(6, 64, dtype=np.float32)).confidence < 0.01


def test_a_stranger_has_little_mass_and_is_unknown() -> None:
    gallery = small()
    for stranger in unit(99, 50):
        evidence = gallery.match(stranger)
        assert sum(belief for _, belief in evidence.beliefs) < KNOWN
        assert decide([evidence]).material == materials.UNKNOWN


@pytest.mark.parametrize("gallery", [small(), large(60), large(10_000)])
def test_beliefs_agree_with_the_formula_written_out(gallery: Gallery) -> None:
    many = unit(7, 40, gallery.references.shape[1])
    found = gallery.beliefs(many)
    k = gallery.calibration.sharpness
    for x, beliefs in zip(many, found, strict=True):
        powers = np.exp(k * gallery.references.astype(float) @ x)
        scores = np.log([powers[gallery.labels == c].mean() for c in range(3)]) / k
        known = 1 / (1 + np.exp(-12.0 * (scores.max() - 0.5)))
        expected = known * np.exp(k * scores) / np.exp(k * scores).sum()
        assert np.allclose(beliefs, expected, rtol=1e-4)


def test_a_match_equals_the_beliefs() -> None:
    gallery = small()
    for embedding in np.concatenate(
        [unit(5, 20), gallery.references, np.zeros((1, 64), np.float32)]
    ):
        beliefs = gallery.beliefs(embedding[None])[0]
        order = [place for place in np.argsort(-beliefs) if beliefs[place] >= FLOOR]
        said = gallery.match(embedding).beliefs
        assert [name for name, _ in said] == [gallery.materials[place] for place in order]
        assert np.allclose([belief for _, belief in said], beliefs[order], rtol=1e-4)


def test_an_empty_gallery_gives_no_beliefs() -> None:
    none = np.zeros((0, 64), np.float32)
    empty = Gallery("t", (), none, np.zeros(0, np.int64), Calibration(12.0, 12.0, 0.5))
    assert empty.match(unit(1, 1)[0]).material is None


@pytest.mark.parametrize("sharpness", [4.0, 32.0, 64.0])
@pytest.mark.parametrize("slope", [0.0, 32.0, 5000.0])
def test_no_calibration_overflows(sharpness: float, slope: float) -> None:
    gallery = replace(small(), calibration=Calibration(sharpness, slope, 0.9))
    for embedding in np.concatenate([unit(5, 5), gallery.references, -gallery.references]):
        beliefs = [belief for _, belief in gallery.match(embedding).beliefs]
        assert all(0.0 <= belief <= 1.0 for belief in beliefs)
        assert np.isfinite(gallery.scores(embedding[None])).all()


def test_a_picture_near_the_unknown_references_is_unknown() -> None:
    gallery = small()
    stranger = unit(50, 1)
    known = plus(gallery, "metal", stranger)
    barred = plus(gallery, materials.UNKNOWN, stranger)
    assert known.match(stranger[0]).confidence > 0.9
    assert materials.UNKNOWN not in dict(barred.match(stranger[0]).beliefs)
    assert decide([barred.match(stranger[0])]).material == materials.UNKNOWN


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_an_embedding_or_a_reference_that_is_not_finite_gives_no_beliefs(value: float) -> None:
    gallery = small()
    broken, rotten = unit(1, 1)[0].copy(), gallery.references.copy()
    broken[3], rotten[2, 5] = value, np.nan
    for evidence in (
        gallery.match(broken),
        replace(gallery, references=rotten).match(gallery.references[0]),
    ):
        assert evidence.material is None
        assert decide([evidence]).material == materials.UNKNOWN


def test_a_gallery_with_all_its_layers_and_own_references_comes_back_as_it_was(
    tmp_path: Path,
) -> None:
    encoder = load_encoder()
    layer, flat, texture = (
        LinearLayer(4.0 * unit(n, encoder.dimension, 3), np.zeros(3, np.float32)) for n in (3, 7, 8)
    )
    base = replace(
        small(encoder.name), references=unit(1, 6, encoder.dimension), layer=layer,
        calibration=replace(small().calibration, flat=0.25, even=-1.0),
    )  # fmt: skip
    own = replace(base, layer=None, places=np.arange(6))
    own = replace(own, calibration=calibrate(own, base))
    whole = replace(base, user=own, flat_layer=flat, texture_layer=texture)
    for name in ("one", "two"):
        save_gallery(whole, tmp_path / f"{name}.npz")
    assert (tmp_path / "one.npz").read_bytes() == (tmp_path / "two.npz").read_bytes()
    back = load_gallery(tmp_path / "one.npz", encoder=encoder)
    assert (back.materials, back.calibration) == (whole.materials, whole.calibration)
    assert np.allclose(np.linalg.norm(back.references, axis=1), 1.0, atol=1e-5)
    asked = unit(4, 5, encoder.dimension)
    for is_flat in (np.zeros(5, np.bool_), np.ones(5, np.bool_)):
        expected = whole.beliefs(asked, is_flat)
        assert np.allclose(back.beliefs(asked, is_flat), expected, atol=5e-3)
    assert np.ptp(whole.beliefs(asked) - whole.beliefs(asked, np.ones(5, np.bool_))) > 0.02
    shown, said = (dict(each.match_texture(asked).beliefs) for each in (back, whole))
    assert shown == pytest.approx(said, abs=5e-3)


def test_a_gallery_of_another_encoder_is_refused_naming_both(tmp_path: Path) -> None:
    save_gallery(small("other-7"), tmp_path / "other.npz")
    encoder = load_encoder()
    with pytest.raises(GalleryError) as caught:
        load_gallery(tmp_path / "other.npz", encoder=encoder)
    assert "other-7" in str(caught.value)
    assert encoder.name in str(caught.value)


def test_files_that_are_not_galleries_are_refused(tmp_path: Path) -> None:
    encoder = load_encoder()
    whole = replace(small(encoder.name), references=unit(1, 6, encoder.dimension))
    empty_class = replace(whole, materials=("wood", "glass", "metal", "paper"))
    short = replace(whole, references=unit(1, 6, 8))
    rotten = whole.references.copy()
    rotten[0, 0] = np.nan
    zero = whole.references.copy()
    zero[0] = 0.0
    endless = whole.references.copy()
    endless[0, 0] = np.inf
    for name, gallery in {
        "a": empty_class,
        "b": short,
        "c": replace(whole, references=rotten),
        "z": replace(whole, references=zero),
        "i": replace(whole, references=endless),
        "k": replace(whole, calibration=Calibration(0.0, 12.0, 0.5)),
        "n": replace(whole, calibration=Calibration(12.0, np.nan, 0.5)),
    }.items():
        save_gallery(gallery, tmp_path / f"{name}.npz")
        with pytest.raises(GalleryError):
            load_gallery(tmp_path / f"{name}.npz", encoder=encoder)
    (tmp_path / "d.npz").write_bytes(b"PK\x03\x04 nothing")
    for missing in ("d.npz", "not-there.npz"):
        with pytest.raises(GalleryError, match="not a gallery"):
            load_gallery(tmp_path / missing, encoder=encoder)


def test_a_folder_is_its_file_and_the_materials_of_its_own(tmp_path: Path) -> None:
    encoder = load_encoder()
    base = replace(small(encoder.name), references=unit(1, 6, encoder.dimension))
    obsidian = materials.derive("obsidian", "glass")
    seen = unit(31, 2, encoder.dimension)
    write_material(UserMaterial(obsidian, "glass", {}, encoder.name, seen), tmp_path)
    write_material(UserMaterial(materials.derive("felt-2", "fabric"), "fabric"), tmp_path)
    alone = load_gallery(tmp_path, encoder=encoder)
    assert alone.candidates == (*load_gallery(encoder=encoder).candidates, "obsidian")
    save_gallery(base, tmp_path / "gallery.npz")
    gallery = load_gallery(tmp_path, encoder=encoder)
    assert gallery.candidates == ("wood", "glass", "metal", "obsidian")
    assert gallery.calibration == base.calibration
    assert gallery.match(seen[1]).material == "obsidian"


def test_a_material_of_another_encoder_is_refused_naming_its_file(tmp_path: Path) -> None:
    encoder = load_encoder()
    slate = materials.derive("slate", "stone")
    write_material(
        UserMaterial(slate, "stone", {}, "other-7", unit(1, 2, encoder.dimension)), tmp_path
    )
    with pytest.raises(GalleryError, match=r"slate\.toml was made with encoder `other-7`"):
        load_gallery(tmp_path, encoder=encoder)
    write_material(UserMaterial(slate, "stone", {}, encoder.name, unit(1, 2, 9)), tmp_path)
    with pytest.raises(GalleryError, match=r"slate\.toml: references of 9 numbers"):
        load_gallery(tmp_path, encoder=encoder)


def test_references_of_a_material_nobody_knows_are_refused(tmp_path: Path) -> None:
    encoder = load_encoder()
    strange = replace(
        small(encoder.name),
        materials=("wood", "glass", "kryptonite"),
        references=unit(1, 6, encoder.dimension),
    )
    save_gallery(strange, tmp_path / "gallery.npz")
    for path in (tmp_path, tmp_path / "gallery.npz"):
        with pytest.raises(GalleryError, match=r"kryptonite.*kryptonite\.toml beside it"):
            load_gallery(path, encoder=encoder)
    write_material(UserMaterial(materials.derive("kryptonite", "stone"), "stone"), tmp_path)
    assert "kryptonite" in load_gallery(tmp_path, encoder=encoder).materials


def test_the_shipped_gallery_fits_the_shipped_encoder_and_the_material_table() -> None:
    encoder = load_encoder()
    gallery = load_gallery(encoder=encoder)
    assert set(gallery.materials) <= {*materials.MATERIALS, materials.UNKNOWN}
    assert {"wood", "glass", "fabric", "metal"} <= set(gallery.materials)
    assert gallery.references.shape[1] == encoder.dimension
    assert gallery.calibration.flat < 1.0  # of flat pictures it is less sure


def test_an_object_of_the_users_own_is_known_again_once_enrolled() -> None:
    encoder = load_encoder()
    gallery = load_gallery(encoder=encoder)
    own = unit(21, 1, encoder.dimension)[0]
    views = own + 0.3 * unit(22, 4, encoder.dimension)
    views = np.asarray(views / np.linalg.norm(views, axis=1, keepdims=True), np.float32)
    obsidian = materials.derive("obsidian", "glass")
    material = UserMaterial(obsidian, "glass", {}, encoder.name, views[:3], (1, 1, 1))
    grown = with_user_materials(gallery, [material])
    assert gallery.match(views[3]).confidence < KNOWN
    assert grown.match(views[3]).material == "obsidian"
    assert grown.match(views[3]).confidence > KNOWN


def test_a_child_in_a_built_gallery_takes_no_picture_from_its_parent() -> None:
    middles = unit(31, 4)  # the last one is the child's
    views = np.repeat(middles, 5, axis=0) + 1.5 * unit(32, 20)
    views = np.asarray(views / np.linalg.norm(views, axis=1, keepdims=True), np.float32)
    labels = np.repeat(np.arange(3), 5)
    built = Gallery("t", ("wood", "glass", "metal"), views[:15], labels, FEW, places=np.arange(15))
    built = replace(built, calibration=calibrate(built))
    walnut = materials.derive("walnut", "wood")
    grown = with_user_materials(
        built, [UserMaterial(walnut, "wood", {}, "t", views[15:], (1,) * 5)]
    )
    asked = np.concatenate([middles[:3].repeat(50, axis=0) + 1.2 * unit(33, 150), unit(34, 50)])
    asked = np.asarray(asked / np.linalg.norm(asked, axis=1, keepdims=True), np.float32)
    before, after = built.beliefs(asked), grown.beliefs(asked)
    assert (after[:, 0] + after[:, 3] >= before[:, 0] - 1e-6).all()  # scores are float32
    assert (after.sum(axis=1) <= 1.0).all()
    assert grown.match(middles[3]).material == "walnut"


def test_own_references_are_calibrated_by_leaving_each_picture_out() -> None:
    """Five views of each of three things, wide apart or all over the place."""
    rng = np.random.default_rng(3)
    for spread, sure in ((0.4, True), (12.0, False)):
        middles = unit(61, 3)
        views = np.repeat(middles, 5, axis=0) + spread * unit(62, 15) * rng.uniform(0.8, 1.2)
        views = np.asarray(views / np.linalg.norm(views, axis=1, keepdims=True), np.float32)
        labels = np.repeat(np.arange(3), 5)
        own = Gallery("t", ("wood", "glass", "metal"), views, labels, FEW, places=np.arange(15))
        own = replace(own, calibration=calibrate(own))
        asked = middles + 0.5 * spread * unit(63, 3)
        asked = np.asarray(asked / np.linalg.norm(asked, axis=1, keepdims=True), np.float32)
        beliefs = own.beliefs(asked)
        if sure:
            assert (beliefs.argmax(axis=1) == [0, 1, 2]).all()
            assert (beliefs.max(axis=1) > 0.8).all()
        else:
            assert (beliefs.max(axis=1) < 0.7).all()


def test_two_materials_of_two_pictures_are_calibrated_and_fewer_are_not() -> None:
    for labels in ([0, 0, 1, 1], [0, 0, 1], [0, 0, 0]):
        names, places = ("wood", "glass")[: max(labels) + 1], np.arange(len(labels))
        own = Gallery("t", names, unit(1, places.size), np.array(labels), FEW, places=places)
        assert is_enough(own) == (places.size == 4)
        assert is_enough(own) or calibrate(own).sharpness == FEW.sharpness


def test_a_linear_layer_adds_to_the_references_and_its_scale_sets_how_sure_it_is() -> None:
    weights = np.zeros((64, 3), np.float32)
    layer = LinearLayer(weights, np.array([0.0, 3.0, 0.0], np.float32))
    sure = Calibration(12.0, 1.0, -1000.0, 0.0, 1.0)
    gallery = replace(small(), calibration=sure, layer=layer)
    evidence = gallery.match(unit(5, 1)[0])
    assert evidence.material == "glass"
    assert evidence.confidence == pytest.approx(np.exp(3) / (np.exp(3) + 2), rel=1e-6)
    humble = replace(gallery, calibration=replace(sure, scale=0.2))
    shown = humble.match(unit(5, 1)[0])
    assert shown.confidence == pytest.approx(np.exp(0.6) / (np.exp(0.6) + 2), rel=1e-6)


def test_own_references_outweigh_the_shipped_ones_that_still_count() -> None:
    shipped = replace(small(), calibration=Calibration(12.0, 1.0, -1000.0))
    thing = unit(77, 1)
    labels = np.zeros(1, np.int64)
    glass = Gallery("test-1", ("glass",), thing, labels, FEW, places=labels)
    grown = replace(shipped, user=glass)
    assert grown.match(thing[0]).material == "glass"
    assert grown.match(thing[0]).confidence > 0.9 > shipped.match(thing[0]).confidence
    for reference, label in zip(shipped.references, shipped.labels, strict=True):
        assert grown.match(reference).material == shipped.materials[label]
    two = Gallery(
        "test-1", ("glass", "metal"), np.concatenate([thing, thing]), np.arange(2), FEW
    )  # fmt: skip
    certain = replace(two, calibration=replace(FEW, threshold=-1000.0))
    leaning = replace(shipped, user=certain).beliefs(thing)[0]
    wanted = log_softmax(shipped.shipped_logits(thing, ("glass", "metal")))[0]
    assert np.log(leaning[1] / leaning[2]) == pytest.approx(0.3 * (wanted[0] - wanted[1]), abs=1e-3)
