"""Shards: the one form training pictures have on disk, whoever made them.

`shard_00012.npz` holds images (N, S, S, 3) uint8 RGB, masks (N, S, S) uint8 (255 = object), labels
(N,) names of the material table or "unknown" or "" (nobody knows), instances (N,) int64 and kinds
(N,) text; `shard_00012.teacher.npy` beside it the teacher's features of the same pictures.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

UNLABELLED = ""


@dataclass(frozen=True, slots=True)
class Shard:
    """Pictures with what is known of each; see the head of this file for shapes."""

    images: NDArray[np.uint8]
    masks: NDArray[np.uint8]
    labels: NDArray[np.str_]
    instances: NDArray[np.int64]
    kinds: NDArray[np.str_]


def write(shard: Shard, path: Path) -> None:
    """Write a shard; it is there whole or not at all."""
    path.parent.mkdir(parents=True, exist_ok=True)
    part = path.with_suffix(".part.npz")
    np.savez(
        part,
        images=shard.images,
        masks=shard.masks,
        labels=shard.labels,
        instances=shard.instances,
        kinds=shard.kinds,
    )
    part.replace(path)


def read(path: Path) -> Shard:
    """Read a shard."""
    with np.load(path, allow_pickle=False) as file:
        names = ("images", "masks", "labels", "instances", "kinds")
        return Shard(*(file[name] for name in names))


def paths(folders: Sequence[Path]) -> list[Path]:
    """List the shards of some folders, in order."""
    return [path for folder in folders for path in sorted(folder.glob("shard_?????.npz"))]


def features_path(path: Path) -> Path:
    """Where the teacher's features of a shard lie."""
    return path.with_suffix(".teacher.npy")


def batches(shard: Shard, size: int) -> Iterator[slice]:
    """Cut a shard into slices of at most `size` pictures."""
    for start in range(0, len(shard.labels), size):
        yield slice(start, start + size)
