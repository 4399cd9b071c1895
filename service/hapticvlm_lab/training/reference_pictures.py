"""Writes the reference pictures that ship.

They are crops of rendered rooms (CC0 materials, our own scenes), the same number of each material
and of none, at most TWO of a shard and a class. Shards that calibrate are left out.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from hapticvlm.vision.galleries.network_gallery import COLUMNS, NAMES, REFERENCES
from hapticvlm_lab.training import sources

EACH = 48  # pictures of a material
TWO = 2  # of one shard
# px, of JPEG: the limit is the size of the wheel
SIDE = 128
QUALITY = 75
SMALLEST_PX = 90  # of the object in its frame: less shows nothing of the material
SHARES = (0.15, 0.95)  # of the crop that the object covers

Pixels = NDArray[np.uint8]


def write(renders: Path, out: Path = REFERENCES) -> str:
    """Write a sheet and its masks of each material; return a line on them."""
    shards = [path for path in sorted(renders.glob("shard_*.npz")) if _may_teach(path)]
    out.mkdir(parents=True, exist_ok=True)
    for name, crops in choose(shards).items():
        write_sheet(crops, out / name)
    return f"{len(NAMES)} sheets of {EACH} reference pictures"


def choose(shards: Sequence[Path]) -> dict[str, list[Pixels]]:
    """Choose crops (S, S, 4) of every material, the first that fit."""
    chosen: dict[str, list[Pixels]] = {name: [] for name in NAMES}
    for shard in shards:
        with np.load(shard, allow_pickle=False) as file:
            crops = file["big"]
            labels = file["label"].tolist()
            sizes = file["size"]
        for name in NAMES:
            rows = [row for row, label in enumerate(labels) if label == name]
            fit = [row for row in rows if _fits(crops[row], sizes[row])]
            chosen[name] += [crops[row] for row in fit[: min(TWO, EACH - len(chosen[name]))]]
    return chosen


def write_sheet(crops: Sequence[Pixels], path: Path) -> None:
    """Write NAME.jpg and NAME.mask.png, squares in rows of COLUMNS."""
    rows = -(-len(crops) // COLUMNS)
    sheet = Image.new("RGB", (COLUMNS * SIDE, rows * SIDE))
    masks = Image.new("L", (1, 1))
    masks = masks.resize(sheet.size)
    for place, crop in enumerate(crops):
        corner = (place % COLUMNS * SIDE, place // COLUMNS * SIDE)
        image = Image.fromarray(crop[..., :3])
        mask = Image.fromarray(crop[..., 3])
        sheet.paste(image.resize((SIDE, SIDE), Image.Resampling.LANCZOS), corner)
        masks.paste(mask.resize((SIDE, SIDE), Image.Resampling.BILINEAR), corner)
    sheet.save(path.with_suffix(".jpg"), quality=QUALITY, optimize=True)
    masks.point(lambda level: 255 * (level > 127)).convert("1").save(
        path.with_suffix(".mask.png"), optimize=True
    )


def _may_teach(shard: Path) -> bool:
    return not sources.is_calibration_shard(shard.stem)


def _fits(crop: Pixels, size: NDArray[np.int16]) -> bool:
    share = float((crop[..., 3] > 0).mean())
    return bool(size.min() >= SMALLEST_PX) and SHARES[0] < share < SHARES[1]
