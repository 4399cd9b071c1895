"""The first encoder: unit embeddings of whatever it is shown, and honest doubt."""

import io
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from hapticvlm.recognition import linear_encoder as encoders
from hapticvlm.recognition.encoder import EncoderError
from hapticvlm.recognition.gallery import load_gallery
from hapticvlm.recognition.ladder import KNOWN, SURE, decide, is_sure
from hapticvlm.recognition.linear_encoder import SIDE, describe, load_linear_encoder
from hapticvlm.recognition.pictures import Crop, central_mask

Pixels = NDArray[np.uint8]


def seen(pixels: NDArray[np.float64] | Pixels, mask: Pixels | None = None) -> Crop:
    image = np.clip(pixels, 0, 255).astype(np.uint8)
    return Crop(image, central_mask(SIDE) if mask is None else mask)


def plain(red: float, green: float, blue: float) -> NDArray[np.float64]:
    return np.ones((SIDE, SIDE, 3)) * (red, green, blue)


def cloth(seed: int, period: float = 5.0) -> NDArray[np.float64]:
    y, x = np.mgrid[0:SIDE, 0:SIDE]
    noise = np.random.default_rng(seed).normal(0, 4, (SIDE, SIDE))
    relief = 35 * np.sign(np.sin(2 * np.pi * x / period) * np.sin(2 * np.pi * y / period)) + noise
    return np.asarray(plain(150, 60, 60) + relief[..., None])


def boards(seed: int) -> NDArray[np.float64]:
    y = np.mgrid[0:SIDE, 0:SIDE][0]
    noise = np.random.default_rng(seed).normal(0, 6, (SIDE, 1)).repeat(SIDE, 1)
    return np.asarray(plain(150, 105, 60) + (12 * np.sin(y / 6) + noise)[..., None])


def clutter(seed: int) -> NDArray[np.float64]:
    rng = np.random.default_rng(seed)
    coarse = np.kron(rng.uniform(0, 255, (14, 14, 3)), np.ones((8, 8, 1)))
    return coarse + rng.normal(0, 10, coarse.shape)


def glass_over(behind: NDArray[np.float64]) -> NDArray[np.float64]:
    """A thin pane: what is behind, slightly shifted and dimmed, with one highlight."""
    pane = np.roll(behind, 2, axis=1) * 0.92 + 8
    pane[30:34, 40:60] = 250
    inside = central_mask(SIDE)[..., None] > 0
    return np.where(inside, pane, behind)


BLANK = {
    "black": plain(0, 0, 0),
    "white": plain(255, 255, 255),
    "grey": plain(127, 127, 127),
    "noise": np.random.default_rng(3).uniform(0, 255, (SIDE, SIDE, 3)),
}


def test_embeddings_are_finite_and_of_unit_norm() -> None:
    encoder = load_linear_encoder()
    crops = [seen(picture) for picture in (*BLANK.values(), cloth(1), boards(1), clutter(1))]
    found = encoder.embed(crops)
    assert found.shape == (len(crops), encoder.dimension)
    assert found.dtype == np.float32
    assert np.allclose(np.linalg.norm(found, axis=1), 1.0, atol=1e-4)
    assert 64 <= encoder.dimension <= 128


def test_a_batch_gives_what_single_crops_give() -> None:
    encoder = load_linear_encoder()
    crops = [seen(cloth(1)), seen(boards(2)), seen(clutter(3))]
    singles = np.concatenate([encoder.embed([crop]) for crop in crops])
    assert np.allclose(encoder.embed(crops), singles, atol=1e-5)
    assert encoder.embed([]).shape == (0, encoder.dimension)


@pytest.mark.parametrize("fill", [0, 255])
def test_an_empty_and_a_full_mask_are_described(fill: int) -> None:
    mask = np.full((SIDE, SIDE), fill, np.uint8)
    assert np.isfinite(describe(seen(clutter(1), mask))).all()


def test_a_mask_of_one_pixel_is_described() -> None:
    mask = np.zeros((SIDE, SIDE), np.uint8)
    mask[50, 50] = 1
    assert np.isfinite(describe(seen(clutter(1), mask))).all()


def test_what_lies_outside_the_mask_changes_the_embedding_little() -> None:
    encoder = load_linear_encoder()
    inside = central_mask(SIDE)[..., None] > 0
    dark, light = (np.where(inside, cloth(1), plain(v, v, v)) for v in (40, 90))
    first, second, other = encoder.embed([seen(dark), seen(light), seen(boards(1))])
    assert first @ second > first @ other


def test_the_same_material_again_is_nearer_than_another() -> None:
    encoder = load_linear_encoder()
    first, again, other = encoder.embed([seen(cloth(1)), seen(cloth(2) * 0.9), seen(boards(1))])
    assert first @ again > 0.8
    assert first @ again > first @ other + 0.3


@pytest.mark.parametrize("picture", BLANK.values(), ids=BLANK.keys())
def test_a_blank_frame_is_unknown(picture: NDArray[np.float64]) -> None:
    encoder = load_linear_encoder()
    gallery = load_gallery(encoder=encoder)
    evidence = gallery.match(encoder.embed([seen(picture)])[0])
    assert evidence.confidence < KNOWN
    assert decide([evidence]).source == "unknown"


@pytest.mark.parametrize("seed", range(6))
def test_glass_over_clutter_is_not_sure(seed: int) -> None:
    encoder = load_linear_encoder()
    gallery = load_gallery(encoder=encoder)
    evidence = gallery.match(encoder.embed([seen(glass_over(clutter(seed)))])[0])
    assert evidence.confidence < SURE
    assert not is_sure([evidence])


def test_a_damaged_encoder_file_is_an_encoder_error(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    whole = encoders.SHIPPED.read_bytes()
    for data in (b"", b"no zip", whole[: len(whole) // 2], io.BytesIO(b"PK").getvalue()):
        broken = tmp_path / "broken.npz"
        broken.write_bytes(data)
        monkeypatch.setattr(encoders, "SHIPPED", broken)
        with pytest.raises(EncoderError, match="reinstall"):
            load_linear_encoder()
