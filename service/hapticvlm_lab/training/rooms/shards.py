"""Writes crops of rooms in files of some hundred, shards."""

from __future__ import annotations

import itertools
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from rich.progress import track

from hapticvlm.vision import pictures
from hapticvlm_lab.training import crops
from hapticvlm_lab.training.crops import SIDE
from hapticvlm_lab.training.rooms.page import Picture, Rooms, opened

PER_SHARD = 500
ROOMS_A_SHARD = 50  # seeds set aside for each shard, so that any may be drawn alone
SHARDS_A_PAGE = 10  # then the browser is restarted: it keeps some memory of every room
LEAST = 0.05  # share of its crop that a thing must fill

Pixels = NDArray[np.uint8]


def draw(data: Path, out: Path, numbers: range) -> None:
    """Write the shards that do not exist yet. Raises RoomsError."""
    out.mkdir(parents=True, exist_ok=True)
    missing = [number for number in numbers if not _path(out, number).exists()]
    for start in range(0, len(missing), SHARDS_A_PAGE):
        with opened(data) as rooms:
            for number in track(missing[start : start + SHARDS_A_PAGE], "shards of rooms"):
                _shard(rooms, number, _path(out, number))


def cut(picture: Picture) -> Pixels:
    """Cut the thing of a picture as the service does: (224, 224, 4), RGB and mask."""
    crop = pictures.crop(crops.frame(picture.pixels, picture.mask), SIDE)
    return np.dstack([crop.image, crop.mask])


def is_large(picture: Picture) -> bool:
    """Return whether the thing of a picture is large enough to be read."""
    return bool(picture.mask.mean() >= LEAST)


def store(path: Path, /, **arrays: Any) -> None:
    """Write arrays of N crops: big (N, 224, 224, 4), label and more; whole or not at all."""
    part = path.with_suffix(".part")
    with part.open("wb") as file:
        np.savez(file, **arrays)
    part.replace(path)


def _path(out: Path, number: int) -> Path:
    return out / f"shard_{number:05d}.npz"


def _shard(rooms: Rooms, number: int, path: Path) -> None:
    """Write a shard: big and label."""
    seeds = range(number * ROOMS_A_SHARD, (number + 1) * ROOMS_A_SHARD)
    drawn = (picture for seed in seeds for picture in rooms.crops(seed) if is_large(picture))
    shown = [(cut(picture), picture.label) for picture in itertools.islice(drawn, PER_SHARD)]
    order = np.random.default_rng(number).permutation(len(shown))
    big, labels = zip(*(shown[at] for at in order), strict=True)
    store(path, big=np.stack(big), label=labels)
