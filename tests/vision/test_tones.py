"""Hazy and dark pictures are stretched to the whole scale, and others stay as they are."""

from __future__ import annotations

import numpy as np
import pytest
from drawn_textures import frame_of
from numpy.typing import NDArray

from hapticvlm.messages import WHOLE
from hapticvlm.vision import tones
from hapticvlm.vision.pictures import crop

SIDE = 64


def scene(lowest: int, highest: int) -> NDArray[np.uint8]:
    """A picture whose levels fill a range: (SIDE, SIDE, 3) uint8."""
    rng = np.random.default_rng(3)
    return rng.integers(lowest, highest, (SIDE, SIDE, 3), np.uint8, endpoint=True)


def seen(pixels: NDArray[np.uint8]) -> NDArray[np.uint8]:
    return crop(frame_of(pixels, WHOLE), SIDE).image


def test_a_picture_in_fog_is_seen_as_without_it() -> None:
    clear = scene(0, 255)
    fog = np.array([200, 205, 210])
    hazy = (0.35 * clear + 0.65 * fog).round().astype(np.uint8)

    assert np.abs(seen(hazy).astype(int) - clear).max() < 25
    assert np.abs(hazy.astype(int) - clear).max() > 100


def test_a_picture_three_stops_too_dark_is_seen_as_if_it_were_lit() -> None:
    clear = scene(0, 255)

    assert np.abs(seen(clear // 3).astype(int) - clear).max() < 8


@pytest.mark.parametrize(
    ("lowest", "highest"),
    [
        (0, 255),
        (100, 255),  # bright, with something white in it
        (0, 180),  # nothing white, but something black
        (127, 127),  # one colour
        (40, 43),
    ],
)
def test_other_pictures_stay_as_they_are(lowest: int, highest: int) -> None:
    pixels = scene(lowest, highest)

    assert np.array_equal(seen(pixels), pixels)


@pytest.mark.parametrize(("lowest", "highest"), [(80, 200), (0, 60), (0, 255)])
def test_the_brightness_is_that_of_the_picture_that_came(lowest: int, highest: int) -> None:
    pixels = scene(lowest, highest)
    image, levels = tones.stretched(pixels)

    assert tones.brightness(image, levels) == pytest.approx(pixels.mean() / 255.0, abs=0.01)


def test_a_lamp_that_is_switched_off_stays_a_change_of_the_scene() -> None:
    lit, dark = (tones.stretched(scene(0, highest)) for highest in (255, 60))

    assert tones.brightness(*lit) - tones.brightness(*dark) > 0.3
