"""The rooms that training renders, drawn by a real headless Chromium."""

import os
import shutil
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from room_data import HELD_BACK, SKY_HELD_BACK, TEACHES, write_data

pytest.importorskip("playwright.sync_api", reason="no playwright: pip install -e '.[dev]'")

from hapticvlm.materials import MATERIALS, UNKNOWN
from hapticvlm_lab.training import sources
from hapticvlm_lab.training.rooms import Picture, Rooms, RoomsError, opened, page, shards

pytestmark = [pytest.mark.nightly, pytest.mark.browser, pytest.mark.slow]


@pytest.fixture(scope="module")
def data(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_data(tmp_path_factory.mktemp("data"))


@pytest.fixture(scope="module")
def rooms(data: Path) -> Iterator[Rooms]:
    has_tools = shutil.which("chromium") and page.THREE.is_dir()
    if not has_tools and not os.environ.get("CI"):
        pytest.skip(f"no chromium, or no three.js: npm ci --prefix {page.HERE}")
    with opened(data) as rooms:
        yield rooms


@pytest.fixture(scope="module")
def crops(rooms: Rooms) -> list[Picture]:
    return [crop for seed in (5, 6) for crop in rooms.crops(seed, views=3)]


def contrast_at_borders(picture: Picture, mask: np.ndarray) -> float:
    """How much more the picture changes where the mask ends than elsewhere."""
    grey = picture.pixels.astype(float).mean(axis=2)
    change = np.abs(np.diff(grey, axis=0))[:, :-1] + np.abs(np.diff(grey, axis=1))[:-1]
    border = np.diff(mask, axis=0)[:, :-1] | np.diff(mask, axis=1)[:-1]
    return float(change[border].mean() / change[~border].mean())


def test_a_crop_shows_a_thing_of_a_material_or_of_none(crops: list[Picture]) -> None:
    for crop in crops:
        assert crop.pixels.shape == (*crop.mask.shape, 3)
        assert crop.label in {*MATERIALS, UNKNOWN}
        assert crop.mask.any()


def test_masks_end_where_the_picture_changes(crops: list[Picture]) -> None:
    seen = [picture for picture in crops if min(picture.mask.shape) > 60]
    straight = np.median([contrast_at_borders(one, one.mask) for one in seen])
    flipped = np.median([contrast_at_borders(one, one.mask[::-1]) for one in seen])
    assert straight > 2.0
    assert straight > 1.5 * flipped


def test_pictures_are_neither_black_nor_white(crops: list[Picture]) -> None:
    levels = [picture.pixels.mean() for picture in crops]
    assert min(levels) > 15
    assert max(levels) < 245
    assert np.median([picture.pixels.std() for picture in crops]) > 15


def test_a_crop_holds_its_thing_with_little_around_it(crops: list[Picture]) -> None:
    assert len(crops) > 6
    for crop in crops:
        rows, columns = np.nonzero(crop.mask)
        height, width = crop.mask.shape
        assert max((np.ptp(columns) + 1) / width, (np.ptp(rows) + 1) / height) > 0.6
        assert max(height, width) <= 224


def test_the_same_seed_draws_the_same_room_whatever_was_drawn_before(rooms: Rooms) -> None:
    first = rooms.crops(7, views=2)
    other = rooms.crops(77, views=2)  # of another set of painted maps
    again = rooms.crops(7, views=2)
    assert [(crop.id, crop.label) for crop in first] == [(crop.id, crop.label) for crop in again]
    for one, two in zip(first, again, strict=True):
        np.testing.assert_array_equal(one.pixels, two.pixels)
        np.testing.assert_array_equal(one.mask, two.mask)
    assert [crop.mask.shape for crop in first] != [crop.mask.shape for crop in other]


def test_what_is_held_back_is_neither_listed_nor_given_to_the_page(
    rooms: Rooms, data: Path
) -> None:
    found = page.teaching(data)
    assert sources.is_tile_held_back(f"ambientcg_tiles/wood/{HELD_BACK}.jpg")
    assert found["wood"] == [f"ambientcg_tiles/wood/{TEACHES}.jpg"]
    assert found["hdri"] == ["hdri/open_field_512.hdr"]
    ask = (
        "async names => (await Promise.all(names.map(n => fetch('/data/' + n)))).map(a => a.status)"
    )
    held_back = [f"ambientcg_tiles/wood/{HELD_BACK}.jpg", f"hdri/{SKY_HELD_BACK}_512.hdr"]
    assert rooms.page.evaluate(ask, [found["wood"][0], *held_back]) == [200, 404, 404]


def test_a_data_folder_without_tiles_is_named(tmp_path: Path) -> None:
    with pytest.raises(RoomsError, match=r"no teaching pictures in .*wood"), opened(tmp_path):
        pass


def test_a_shard_holds_crops_as_the_service_cuts_them(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, rooms: Rooms
) -> None:
    monkeypatch.setattr(shards, "PER_SHARD", 6)
    path = tmp_path / "shard_00003.npz"
    shards._shard(rooms, 3, path)
    with np.load(path, allow_pickle=False) as shard:
        big, labels = shard["big"], shard["label"]
    assert big.shape == (6, 224, 224, 4)
    assert big.dtype == np.uint8
    assert set(np.unique(big[..., 3]).tolist()) <= {0, 255}
    assert set(labels.tolist()) <= {*MATERIALS, UNKNOWN}
    for mask in big[..., 3] > 0:
        rows, columns = np.nonzero(mask)
        assert np.ptp(rows) > 0.85 * 224  # the box of the mask, with a margin of 5 %
        assert np.ptp(columns) > 0.85 * 224
    before = path.stat().st_mtime_ns
    shards.draw(tmp_path / "nowhere", tmp_path, range(3, 4))  # it is there: nothing is drawn
    assert path.stat().st_mtime_ns == before
