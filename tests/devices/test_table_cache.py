"""Tests that the engine caches its tables for the next start, and ignores a damaged cache."""

import functools
import os
from pathlib import Path

import numpy as np
import pytest

from hapticvlm.devices.speaker import table_cache
from hapticvlm.rendering.vibration.cache import ArrayCache

MAX_ARRAYS = 192


def _computed(cache: ArrayCache, names: int = 3) -> None:
    for number in range(names):
        cache.get(f"array {number}", functools.partial(np.add, np.arange(4.0), number))


@pytest.fixture
def kept(tmp_path: Path) -> Path:
    cache = ArrayCache()
    _computed(cache)
    table_cache.save(cache, tmp_path)
    return tmp_path


def test_the_next_start_computes_nothing(kept: Path) -> None:
    cache = ArrayCache()
    table_cache.load(cache, kept)
    _computed(cache)
    assert cache.computed == 0
    assert cache.get("array 2", lambda: np.zeros(4)).tolist() == [2.0, 3.0, 4.0, 5.0]


def test_the_file_is_its_user_s_alone_and_an_older_version_s_goes(kept: Path) -> None:
    (only,) = kept.iterdir()
    assert os.name == "nt" or only.stat().st_mode & 0o077 == 0
    only.rename(kept / "vibration-0000000000000000.bin")
    cache = ArrayCache()
    table_cache.load(cache, kept)
    assert cache.arrays() == {}
    _computed(cache)
    table_cache.save(cache, kept)
    assert [path.name for path in kept.iterdir()] == [only.name]


@pytest.mark.parametrize("damage", ["cut", "empty", "a bit turned"])
def test_a_damaged_file_is_computed_anew(kept: Path, damage: str) -> None:
    (only,) = kept.iterdir()
    data = bytearray(only.read_bytes())
    if damage == "a bit turned":
        data[40] ^= 1
    only.write_bytes(data[: {"cut": -9, "empty": 0}.get(damage)])
    cache = ArrayCache()
    table_cache.load(cache, kept)
    _computed(cache)
    assert cache.computed == 3


def test_a_folder_that_cannot_be_written_keeps_nobody_from_starting(tmp_path: Path) -> None:
    taken = tmp_path / "file"
    taken.write_text("no folder")
    cache = ArrayCache()
    _computed(cache)
    table_cache.load(ArrayCache(), taken)
    table_cache.save(cache, taken)
    assert taken.read_text() == "no folder"


def test_a_memo_forgets_the_oldest() -> None:
    cache = ArrayCache()
    _computed(cache, MAX_ARRAYS + 5)
    assert len(cache.arrays()) == MAX_ARRAYS
    _computed(cache, 1)
    assert cache.computed == MAX_ARRAYS + 6
