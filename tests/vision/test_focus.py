"""Pictures that are sharp in a few places and blurred in most are evened, and others are not."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from drawn_textures import frame_of
from numpy.typing import NDArray
from PIL import Image, ImageFilter

from hapticvlm.messages import WHOLE
from hapticvlm.vision.focus import evened, is_uneven
from hapticvlm.vision.pictures import central_mask, crop

SIDE = 224
EVERYWHERE = np.full((SIDE, SIDE), 255, np.uint8)
Y, X = np.mgrid[0:SIDE, 0:SIDE]
AWAY = np.hypot(X / SIDE - 0.5, Y / SIDE - 0.5)  # from the centre, over the side

Pixels = NDArray[np.uint8]


@cache
def leaves() -> Pixels:
    """Overlapping discs of plain colours, as sharp as pixels allow: (SIDE, SIDE, 3) uint8."""
    rng = np.random.default_rng(4)
    pixels = np.zeros((SIDE, SIDE, 3), np.uint8)
    for _ in range(300):
        x, y = rng.uniform(0, SIDE, 2)
        pixels[np.hypot(X - x, Y - y) < rng.uniform(4, 24)] = rng.integers(0, 256, 3)
    return pixels


def coarse(pixels: Pixels, factor: int) -> Pixels:
    """Rendered at a part of the size and shown at the whole."""
    small = Image.fromarray(pixels).resize((SIDE // factor,) * 2, Image.Resampling.BILINEAR)
    return np.asarray(small.resize((SIDE, SIDE), Image.Resampling.BILINEAR))


def foveated(pixels: Pixels) -> Pixels:
    return np.where((AWAY < 0.15)[..., None], pixels, coarse(pixels, 5))


def moved(pixels: Pixels, along: int) -> Pixels:
    turns = [np.roll(pixels, at, axis=along).astype(np.float32) for at in range(9)]
    return np.asarray(sum(turns) / 9).round().astype(np.uint8)


def tall(pixels: Pixels) -> Pixels:
    """Each row twice, so that more edges run down than across."""
    return np.repeat(pixels, 2, axis=0)[:SIDE]


def steps(pixels: Pixels) -> float:
    """Root mean square of the steps between neighbours in the middle, grey levels."""
    middle = pixels[96:128, 96:128].astype(np.float64)
    return float(np.sqrt((np.diff(middle, axis=1) ** 2).mean()))


def test_the_sharp_middle_of_a_foveated_picture_is_blurred_towards_the_rest() -> None:
    shown = foveated(leaves())
    seen = crop(frame_of(shown, WHOLE), SIDE).image

    assert steps(seen) < 0.7 * steps(shown)
    assert np.abs(seen.mean(axis=(0, 1)) - shown.mean(axis=(0, 1))).max() < 1.0


@pytest.mark.parametrize(
    "pixels",
    [
        pytest.param(leaves(), id="sharp everywhere, in flat colours"),
        pytest.param(coarse(leaves(), 5), id="out of focus everywhere"),
        pytest.param(moved(leaves(), 1), id="moved to the side"),
        pytest.param(moved(leaves(), 0), id="moved up"),
        pytest.param(moved(tall(leaves()), 1), id="moved across most of its edges"),
        pytest.param(np.dstack([(X + Y) // 2] * 3).astype(np.uint8), id="smooth"),
        pytest.param(np.full((SIDE, SIDE, 3), 127, np.uint8), id="one colour"),
        pytest.param(
            np.random.default_rng(1).integers(0, 256, (SIDE, SIDE, 3), np.uint8), id="noise"
        ),
        pytest.param(
            np.where((AWAY < 0.3)[..., None], leaves(), np.uint8(255)), id="sharp on white"
        ),
    ],
)
def test_other_pictures_stay_as_they_are(pixels: Pixels) -> None:
    assert np.array_equal(evened(pixels, EVERYWHERE), pixels)


def test_only_what_the_mask_marks_is_judged() -> None:
    shown = foveated(leaves())
    far, near = (np.where(place, 255, 0).astype(np.uint8) for place in (AWAY > 0.25, AWAY < 0.1))

    assert is_uneven(shown, central_mask(SIDE))
    assert not is_uneven(shown, far)
    assert not is_uneven(shown, near)
    assert not is_uneven(shown, np.zeros_like(far))


@pytest.mark.parametrize("share", [0.35, 1.0])
def test_haze_hides_no_foveation_and_makes_none(share: float) -> None:
    sharp, uneven = (
        (share * each + (1.0 - share) * 205).round().astype(np.uint8)
        for each in (leaves(), foveated(leaves()))
    )

    assert is_uneven(uneven, EVERYWHERE)
    assert not is_uneven(sharp, EVERYWHERE)


@pytest.mark.parametrize("side", [1, 7, 8, 30, 260])
def test_a_crop_of_any_side_is_judged(side: int) -> None:
    pixels = np.asarray(Image.fromarray(leaves()).resize((side, side)))
    mask = np.full((side, side), 255, np.uint8)

    assert np.array_equal(evened(pixels, mask), pixels)


def test_a_picture_that_was_evened_is_not_blurred_again() -> None:
    once = evened(foveated(leaves()), EVERYWHERE)

    assert np.array_equal(evened(once, EVERYWHERE), once)
    assert not is_uneven(
        np.asarray(Image.fromarray(leaves()).filter(ImageFilter.GaussianBlur(2))), EVERYWHERE
    )
