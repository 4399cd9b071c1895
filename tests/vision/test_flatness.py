"""Pictures of flat colours are told from photographs, by what the mask holds alone."""

from collections.abc import Callable

import numpy as np
import pytest
import simplejpeg

from hapticvlm.messages import WHOLE, Frame
from hapticvlm.vision.flatness import is_flat
from hapticvlm.vision.pictures import Crop, Pixels, central_mask, crop

SIDE = 224
DICE = np.random.default_rng(5)


def toy() -> Pixels:
    """Draw a thing of four faces, each of one colour, on a ground of another."""
    image = np.full((SIDE, SIDE, 3), (90, 130, 70), np.uint8)
    for number, colour in enumerate(((150, 90, 40), (120, 70, 30), (200, 60, 60), (60, 60, 180))):
        image[40 + 36 * number : 76 + 36 * number, 50:170] = colour
    return image


def grain(image: Pixels) -> Pixels:
    """Add what a camera or a texture adds: a few grey levels from pixel to pixel."""
    moved = image + DICE.normal(0.0, 4.0, image.shape)
    return np.asarray(np.clip(moved, 0, 255), np.uint8)


def cut_out(thing: Callable[[], Pixels]) -> Pixels:
    """Put a thing on the pure white of a product photograph; it covers a sixth of the picture."""
    image = np.full((SIDE, SIDE, 3), 255, np.uint8)
    image[70:160, 70:160] = thing()[70:160, 70:160]
    return image


def shown(image: Pixels, mask: Pixels | None = None) -> bool:
    return is_flat(Crop(image, central_mask(SIDE) if mask is None else mask))


def test_a_thing_of_flat_colours_is_flat_and_one_with_grain_is_not() -> None:
    assert shown(toy())
    assert not shown(grain(toy()))


def test_a_white_ground_does_not_make_a_photograph_flat_nor_hides_a_flat_thing() -> None:
    assert not shown(cut_out(lambda: grain(toy())))
    assert shown(cut_out(toy))


def test_only_the_inside_of_the_mask_counts() -> None:
    thing = np.zeros((SIDE, SIDE), np.uint8)
    thing[40:184, 50:170] = 255
    on_grain = np.where(thing[..., None] > 0, toy(), grain(toy()))
    on_flat = np.where(thing[..., None] > 0, grain(toy()), toy())
    assert shown(on_grain, thing)
    assert not shown(on_flat, thing)


@pytest.mark.parametrize("quality", [75, 90])
def test_a_flat_thing_is_flat_in_the_jpeg_that_a_client_sends(quality: int) -> None:
    for image, expected in ((toy(), True), (grain(toy()), False)):
        large = np.ascontiguousarray(image.repeat(2, axis=0).repeat(2, axis=1))
        frame = Frame(
            id=1,
            captured_at=0.0,
            format="jpeg",
            width=2 * SIDE,
            height=2 * SIDE,
            origin="top",
            image=simplejpeg.encode_jpeg(large, quality=quality),
            region=WHOLE,
        )
        assert is_flat(crop(frame, SIDE)) == expected


def test_nothing_but_white_or_too_few_pixels_are_not_flat() -> None:
    assert not shown(np.full((SIDE, SIDE, 3), 255, np.uint8))
    point = np.zeros((SIDE, SIDE), np.uint8)
    point[:4, :4] = 255
    assert not shown(toy(), point)
