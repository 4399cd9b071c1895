"""The scale of flat pictures follows from how often the encoder is right about them."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from hapticvlm.materials import UNKNOWN
from hapticvlm.vision.encoders.loading import load_encoder
from hapticvlm.vision.galleries.gallery import Gallery
from hapticvlm.vision.galleries.storage import load_gallery
from hapticvlm_lab.training import flat_scale
from hapticvlm_lab.training.flat_scale import Kits


@pytest.fixture(scope="module")
def gallery() -> Gallery:
    return load_gallery(encoder=load_encoder())


def shown(gallery: Gallery, right: float) -> Kits:
    """Return the gallery's own references as crops of a kit, this share of them truly labelled."""
    names = np.array(gallery.materials)[gallery.labels]
    kept = (names != UNKNOWN) & (np.arange(len(names)) % 9 == 0)
    dice = np.random.default_rng(4)
    truth = np.where(dice.random(kept.sum()) < right, names[kept], dice.permutation(names[kept]))
    paths = np.array([f"kits/toys/thing {row}.glb" for row in range(len(truth))])
    return Kits(gallery.references[kept], np.ones(len(truth), np.bool_), truth, paths)


def test_an_encoder_that_is_often_wrong_about_flat_pictures_is_believed_less(
    gallery: Gallery,
) -> None:
    often, seldom = (flat_scale.fit([shown(gallery, right)], gallery) for right in (0.95, 0.2))
    assert seldom < often
    assert seldom < 0.6


def test_the_report_has_a_line_for_each_kit_and_way(
    gallery: Gallery, capsys: pytest.CaptureFixture[str]
) -> None:
    kits = shown(gallery, 0.6)
    rows = np.arange(len(kits.truth)) % 2 == 0
    flat_scale.report(kits.keep(rows), replace(gallery, parents={}))
    printed = capsys.readouterr().out
    assert printed.count("pictures alone") == printed.count("beside named objects, with both") == 2
    assert f"all: {rows.sum()} crops, 100% flat" in printed


@pytest.mark.nightly
def test_crops_are_read_with_their_kit_and_at_the_side_of_the_encoder(tmp_path: Path) -> None:
    toy = np.full((224, 224, 4), (150, 90, 40, 255), np.uint8)
    photograph = np.random.default_rng(2).integers(0, 255, (224, 224, 4), np.uint8)
    np.savez(
        tmp_path / "toys.npz",
        big=np.stack([toy, photograph]),
        label=["wood", "metal"],
        path=["kits/toys/chair.glb", "kits/toys/pan.glb"],
    )
    for name in ("lite0", "lite2"):
        encoder = load_encoder(name)
        kits = flat_scale.read(tmp_path, encoder)
        assert kits.embeddings.shape == (2, encoder.dimension)
        assert kits.flat.tolist() == [True, False]
        assert kits.kits.tolist() == ["toys", "toys"]
