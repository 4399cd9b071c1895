"""Writes crops of rooms in files of some hundred, shards."""

from __future__ import annotations

import io
import itertools
from collections.abc import Iterable, Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image
from rich.progress import track

from hapticvlm import messages
from hapticvlm.vision import pictures
from hapticvlm_lab.training.rooms.page import Picture, Rooms, opened

SIDE = 224
PER_SHARD = 500
ROOMS_A_SHARD = 50  # seeds set aside for each shard, so that any may be drawn alone
SHARDS_A_PAGE = 10  # then the browser is restarted: it keeps some memory of every room
LEAST = 0.05  # share of its crop that a thing must fill

# (224, 224, 4) RGB and mask, label, and height and width in px before it was scaled to SIDE
Crop = tuple[NDArray[np.uint8], str, tuple[int, ...]]


def draw(data: Path, out: Path, numbers: range) -> None:
    """Write the shards that do not exist yet. Raises RoomsError."""
    out.mkdir(parents=True, exist_ok=True)
    missing = [number for number in numbers if not _path(out, number).exists()]
    for start in range(0, len(missing), SHARDS_A_PAGE):
        with opened(data) as rooms:
            for number in track(missing[start : start + SHARDS_A_PAGE], "shards of rooms"):
                _shard(rooms, number, _path(out, number))


def cut(picture: Picture) -> NDArray[np.uint8]:
    """Cut the first thing of a picture as the service does: (224, 224, 4), RGB and mask."""
    inside = picture.ids == picture.things[0].id
    mask = io.BytesIO()
    Image.fromarray(np.where(inside, 255, 0).astype(np.uint8)).save(mask, "PNG", compress_level=0)
    frame = messages.Frame(
        id=1, captured_at=0.0, format="rgb8", width=inside.shape[1], height=inside.shape[0],
        origin="top", image=picture.pixels.tobytes(), mask=mask.getvalue(),
    )  # fmt: skip
    crop = pictures.crop(frame, SIDE)
    return np.dstack([crop.image, crop.mask])


def _path(out: Path, number: int) -> Path:
    return out / f"shard_{number:05d}.npz"


def _crops(rooms: Rooms, seeds: Iterable[int], most: int) -> Iterator[Crop]:
    pictures = (picture for seed in seeds for picture in rooms.crops(seed))
    large = (p for p in pictures if p.things and (p.ids == p.things[0].id).mean() >= LEAST)
    for picture in itertools.islice(large, most):
        yield cut(picture), picture.things[0].label, picture.ids.shape


def _shard(rooms: Rooms, number: int, path: Path) -> None:
    """Write a shard: big (N, 224, 224, 4) RGB and mask, label, source, size (N, 2) in px."""
    seeds = range(number * ROOMS_A_SHARD, (number + 1) * ROOMS_A_SHARD)
    crops = list(_crops(rooms, seeds, PER_SHARD))
    order = np.random.default_rng(number).permutation(len(crops))
    big, labels, sizes = zip(*(crops[index] for index in order), strict=True)
    part = path.with_suffix(".part")
    with part.open("wb") as file:
        np.savez(
            file, big=np.stack(big), label=labels, source=["rooms"] * len(crops), size=sizes
        )  # fmt: skip
    part.replace(path)
