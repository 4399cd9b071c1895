"""Shards of training pictures on disk: balanced over the classes, made in order, resumable."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from hapticvlm import materials
from hapticvlm_lab.training.render.batch import Batch, render
from hapticvlm_lab.training.render.light import Lights
from hapticvlm_lab.training.render.tiles import Tiles

PER_SHARD = 240
VIEWS = 4  # pictures of a sample
_OFTEN = ("wood", "glass", "fabric", "metal")
_UNKNOWN = 2  # samples of a shard that are none of our materials
_MOST = 1000  # shards of one seed
_STRIDE = 100_003  # between the seeds of runs, so that their shards never share one


@dataclass(frozen=True, slots=True)
class Order:
    """What to make: a folder, how many pictures, from which seed, of which side, on what."""

    folder: Path
    count: int
    seed: int
    side: int = 144
    device: str = "cpu"


def mixture(samples: int) -> list[str]:
    """Materials of a shard: the first four twice as often as the others, a few unknown."""
    known = [name for name in materials.MATERIALS if name not in _OFTEN]
    turn = [*_OFTEN, *known, *_OFTEN]
    unknown = min(_UNKNOWN, samples // 10)
    names = [turn[number % len(turn)] for number in range(samples - unknown)]
    return [*names, *[materials.UNKNOWN] * unknown]


def shards(order: Order) -> list[tuple[Path, int]]:
    """Files of an order and the seed of each; the last one is filled up to a whole shard.

    Raises ValueError for more shards than one seed has numbers for.
    """
    count = -(-order.count // PER_SHARD)
    if count > _MOST:
        raise ValueError(f"one seed makes at most {_MOST * PER_SHARD} pictures; use several")
    return [
        (
            order.folder / f"shard_{order.seed * _MOST + number:05d}.npz",
            order.seed * _STRIDE + number,
        )
        for number in range(count)
    ]


def make(order: Order, tiles: Tiles | None, lights: Lights | None) -> Iterator[Path]:
    """Render the shards that are missing, and name each file once it is there."""
    order.folder.mkdir(parents=True, exist_ok=True)
    names = mixture(PER_SHARD // VIEWS)
    for path, seed in shards(order):
        if not path.exists():
            batch = render(
                seed, names, views=VIEWS, side=order.side, tiles=tiles, lights=lights,
                device=order.device,
            )  # fmt: skip
            save(batch, path)
        yield path


def save(batch: Batch, path: Path) -> None:
    """Write a batch so that a file of this name is always whole."""
    partial = path.with_suffix(".partial")
    with partial.open("wb") as file:
        np.savez(
            file,
            images=batch.images,
            masks=batch.masks,
            labels=np.array(batch.labels),
            instances=batch.instances,
            kinds=np.array(batch.kinds),
        )
    partial.replace(path)


def load(path: Path) -> Batch:
    """Read a shard back."""
    with np.load(path) as stored:
        return Batch(
            stored["images"],
            stored["masks"],
            tuple(stored["labels"].tolist()),
            stored["instances"],
            tuple(stored["kinds"].tolist()),
        )
