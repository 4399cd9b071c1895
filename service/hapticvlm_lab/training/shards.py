"""Shards: the one form training pictures have on disk, whoever made them.

`shard_00012.npz` holds images (N, S, S, 3) uint8 RGB, masks (N, S, S) uint8 (255 = object), labels
(N,) names of the material table or "unknown" or "" (nobody knows), instances (N,) int64 and kinds
(N,) text; `shard_00012.teacher.npy` beside it the teacher's features of the same pictures.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from zlib import crc32

import numpy as np
from numpy.typing import NDArray
from PIL import Image

UNLABELLED = ""
MOST_MARGIN = 0.2  # of the object's box, on each side


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


def read_framed(path: Path) -> Shard:
    """Read a shard with each render cut to its object, about as the service cuts frames.

    The margin differs from picture to picture and is the same at every reading.
    """
    shard = read(path)
    rng = np.random.default_rng(crc32(path.name.encode()))
    images, masks = shard.images.copy(), shard.masks.copy()
    for row, kind in enumerate(shard.kinds.tolist()):
        margins = rng.uniform(0.0, MOST_MARGIN, 4)
        if "/" in kind:  # "wood/planks": a render, whose mask is exact
            images[row], masks[row] = _cut(shard.images[row], shard.masks[row], margins)
    return Shard(images, masks, shard.labels, shard.instances, shard.kinds)


def _cut(
    image: NDArray[np.uint8], mask: NDArray[np.uint8], margins: NDArray[np.float64]
) -> tuple[NDArray[np.uint8], NDArray[np.uint8]]:
    rows, columns = np.flatnonzero(mask.any(axis=1)), np.flatnonzero(mask.any(axis=0))
    side = mask.shape[0]
    if not rows.size:
        return image, mask
    height, width = rows[-1] + 1 - rows[0], columns[-1] + 1 - columns[0]
    left, right = columns[0] - margins[0] * width, columns[-1] + 1 + margins[1] * width
    top, bottom = rows[0] - margins[2] * height, rows[-1] + 1 + margins[3] * height
    box = (max(0.0, left), max(0.0, top), min(float(side), right), min(float(side), bottom))
    size = (side, side)
    resized = Image.fromarray(image).resize(size, Image.Resampling.BILINEAR, box)
    inside = np.asarray(Image.fromarray(mask).resize(size, Image.Resampling.BILINEAR, box))
    return np.asarray(resized), np.where(inside > 127, 255, 0).astype(np.uint8)


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
