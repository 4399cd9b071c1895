"""Things on a plain ground: drawn ones are outlined, and what is not one is left as it is."""

import numpy as np
import pytest
import simplejpeg
from drawn_textures import frame_of
from each_case import each
from grounds import GROUNDS, HEIGHT, WIDTH, drawn
from numpy.typing import NDArray
from PIL import Image
from scipy import ndimage

from hapticvlm.messages import WHOLE, Frame
from hapticvlm.vision import pictures
from hapticvlm.vision.plain_ground import _pieces, outline, outlined

Grid = NDArray[np.bool_]


def overlap(mask: Grid, truth: Grid) -> float:
    """Intersection over union, with the mask brought to the size of the truth."""
    size = (truth.shape[1], truth.shape[0])
    large = np.asarray(Image.fromarray(mask).resize(size, Image.Resampling.NEAREST))
    return float((large & truth).sum() / (large | truth).sum())


@each(name=[name for name, ground in GROUNDS.items() if ground.is_outlined])
def test_a_thing_on_a_plain_ground_is_outlined(name: str) -> None:
    pixels, truth = drawn(name)
    mask = outline(pixels)
    assert mask is not None
    assert overlap(mask, truth) > 0.9


@each(name=[name for name, ground in GROUNDS.items() if not ground.is_outlined])
def test_what_is_not_one_thing_on_a_plain_ground_is_not_outlined(name: str) -> None:
    assert outline(drawn(name)[0]) is None


@pytest.mark.parametrize("size", [(1, 1), (3, 200), (200, 3), (15, 15), (16, 16), (40, 1200)])
def test_a_picture_of_any_size_is_searched(size: tuple[int, int]) -> None:
    assert outline(np.full((*size, 3), 200, np.uint8)) is None


def test_a_thing_is_found_at_any_size_of_the_picture() -> None:
    pixels, truth = drawn("thing")
    for factor in (0.25, 4):
        size = (round(WIDTH * factor), round(HEIGHT * factor))
        resized = np.asarray(Image.fromarray(pixels).resize(size, Image.Resampling.BILINEAR))
        mask = outline(resized)
        assert mask is not None
        assert overlap(mask, truth) > 0.9


@pytest.mark.parametrize("origin", ["top", "bottom"])
def test_a_frame_gets_the_outline_as_its_mask_the_right_way_up(origin: str) -> None:
    pixels, truth = drawn("to one side")
    stored = pixels if origin == "top" else pixels[::-1]
    frame = Frame(
        id=1,
        captured_at=0.0,
        format="jpeg",
        width=WIDTH,
        height=HEIGHT,
        image=simplejpeg.encode_jpeg(np.ascontiguousarray(stored), quality=90),
        origin=origin,  # type: ignore[arg-type]
        region=WHOLE,
    )
    masked = outlined(frame)
    assert masked is not None
    assert masked.region is None
    assert masked.image == frame.image
    assert overlap(np.asarray(pictures.decode_mask(masked)) > 0, truth) > 0.9


def test_a_frame_without_a_thing_has_no_outline() -> None:
    assert outlined(frame_of(drawn("empty")[0])) is None


@each(grain=(0.5, 1.0, 2.0, 8.0))
def test_cells_that_touch_by_a_side_are_one_piece(grain: float) -> None:
    waves = ndimage.gaussian_filter(np.random.default_rng(3).normal(size=(60, 90)), grain)
    grid = waves > np.median(waves)
    pieces, expected = _pieces(grid), ndimage.label(grid)[0]
    pairs = set(zip(pieces.ravel().tolist(), expected.ravel().tolist(), strict=True))
    assert len(pairs) == pieces.max() + 1 == expected.max() + 1
