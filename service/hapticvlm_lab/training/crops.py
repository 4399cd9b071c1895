"""Photographs and texture tiles to shards.

`python -m hapticvlm_lab.training.crops --data D --out O`.

Every picture becomes several crops with masks. Photographs are cut as they are, with the mask a
client would send (the object's outline on TrashNet's white board, else a shape or the central
disc); tiles and boards, which fill the picture, are lit, bent into shapes and put before other
pictures. Sources that are held back (sources.py) are not read.
"""

from __future__ import annotations

import argparse
import csv
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from zlib import crc32

import numpy as np
from numpy.typing import NDArray
from PIL import Image
from rich.progress import track
from scipy import ndimage

from hapticvlm import materials
from hapticvlm.recognition.pictures import central_mask
from hapticvlm_lab.training import shards, sources

SIDE = 128
PER_SHARD = 480
SEED = 20250502
# Crops of each picture of a source: rarer sources give more.
CROPS = {"ambientcg_tiles": 7, "trashnet": 6, "clothing": 8, "woodboards": 8, "weather": 5}
CROPS_UNLABELLED = 4
TEXTURES = frozenset({"ambientcg_tiles", "woodboards"})

Pixels = NDArray[np.uint8]


@dataclass(frozen=True, slots=True)
class Picture:
    """One file, what it shows ("" = nobody knows), its source, and how many crops to cut."""

    path: Path
    label: str
    source: str
    crops: int


def main() -> int:
    """Read the command line and write the shards that are not there yet."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--data", type=Path, required=True, help="folder with labels.csv")
    parser.add_argument("--out", type=Path, required=True, help="folder for the shards")
    parser.add_argument("--side", type=int, default=SIDE, help="px (%(default)s)")
    chosen = parser.parse_args()
    jobs = [(one, number) for one in pictures(chosen.data) for number in range(one.crops)]
    np.random.default_rng(SEED).shuffle(jobs)
    grounds = [one.path for one in pictures(chosen.data) if one.source not in TEXTURES]
    chunks = [jobs[start : start + PER_SHARD] for start in range(0, len(jobs), PER_SHARD)]
    for number, chunk in enumerate(track(chunks, description="cutting")):
        path = chosen.out / f"shard_{number:05d}.npz"
        if not path.exists():
            shards.write(_cut_all(chunk, grounds, chosen.side), path)
    return 0


def pictures(data: Path) -> list[Picture]:
    """List every picture that may teach."""
    with (data / "labels.csv").open(newline="", encoding="utf-8") as file:
        rows = [
            (row["path"], row["path"].split("/")[0], row["class"]) for row in csv.DictReader(file)
        ]
    found = []
    for path, source, label in rows:
        held_back = source == "ambientcg_tiles" and sources.is_tile_held_back(path)
        if source in CROPS and path.endswith(".jpg") and not held_back:
            known = materials.UNKNOWN if source == sources.SCENERY else sources.material_of(label)
            found.append(Picture(data / path, known, source, CROPS[source]))
    return found + list(_unlabelled(data))


def _unlabelled(data: Path) -> Iterator[Picture]:
    barred = sources.SAME_AS_HELD_BACK | sources.LIVING_HELD_BACK
    for folder in sorted((data / sources.UNLABELLED).iterdir()):
        if folder.is_dir() and folder.name not in barred:
            living = folder.name in sources.LIVING_TAUGHT
            label = materials.UNKNOWN if living else shards.UNLABELLED
            for path in sorted(folder.glob("*.jpg")):
                yield Picture(path, label, sources.UNLABELLED, CROPS_UNLABELLED)


def _cut_all(chunk: list[tuple[Picture, int]], grounds: list[Path], side: int) -> shards.Shard:
    images, masks = [], []
    for picture, number in chunk:
        rng = np.random.default_rng([SEED, crc32(picture.path.name.encode()), number])
        pixels = np.asarray(Image.open(picture.path).convert("RGB"))
        if picture.source in TEXTURES:
            behind = Image.open(grounds[int(rng.integers(len(grounds)))]).convert("RGB")
            image, mask = _dress(pixels, np.asarray(behind), side, rng)
        else:
            outline = _outline(pixels) if picture.source == "trashnet" else None
            image, mask = _photograph(pixels, outline, side, rng)
        images.append(image)
        masks.append(mask)
    return shards.Shard(
        np.stack(images),
        np.stack(masks),
        np.array([picture.label for picture, _ in chunk]),
        np.array([crc32(picture.path.name.encode()) for picture, _ in chunk], np.int64),
        np.array([picture.source for picture, _ in chunk]),
    )


def _photograph(
    pixels: Pixels, outline: Pixels | None, side: int, rng: np.random.Generator
) -> tuple[Pixels, Pixels]:
    """Cut a square out of a photograph, with an outline or a mask a client might send."""
    height, width = pixels.shape[:2]
    if outline is not None:
        rows, columns = np.flatnonzero(outline.any(axis=1)), np.flatnonzero(outline.any(axis=0))
        span = max(rows[-1] - rows[0], columns[-1] - columns[0]) * rng.uniform(0.6, 1.3)
        span = float(np.clip(span, 32, min(height, width)))
        middle = ((rows[0] + rows[-1]) / 2, (columns[0] + columns[-1]) / 2)
        top = np.clip(middle[0] - span / 2 + rng.normal(0, span / 12), 0, height - span)
        left = np.clip(middle[1] - span / 2 + rng.normal(0, span / 12), 0, width - span)
    else:
        span = min(height, width) * rng.uniform(0.45, 1.0)
        top, left = rng.uniform(0, height - span), rng.uniform(0, width - span)
    box = (left, top, left + span, top + span)
    image = _resize(pixels, box, side)
    if outline is not None:
        mask = _resize(outline, box, side)
        if (mask > 127).mean() > 0.05:
            return image, np.where(mask > 127, 255, 0).astype(np.uint8)
    mask = central_mask(side) if rng.random() < 0.5 else _shape(side, rng)
    return image, mask


def _outline(pixels: Pixels) -> Pixels:
    """Find the object on a plain board: what differs from the border's colour, filled."""
    border = np.concatenate([pixels[:6].reshape(-1, 3), pixels[-6:].reshape(-1, 3)])
    far = np.abs(pixels.astype(np.float32) - np.median(border, axis=0)).max(axis=2)
    near = ndimage.binary_closing(ndimage.gaussian_filter(far, 2) > 22, iterations=9)
    filled = ndimage.binary_fill_holes(near)
    regions, count = ndimage.label(filled)
    if not count:
        return np.full(pixels.shape[:2], 255, np.uint8)
    largest = 1 + int(np.argmax(np.bincount(regions.ravel())[1:]))
    return np.where(regions == largest, 255, 0).astype(np.uint8)


def _dress(
    texture: Pixels, behind: Pixels, side: int, rng: np.random.Generator
) -> tuple[Pixels, Pixels]:
    """Give a flat texture a shape, light and a picture behind it."""
    mask = _shape(side, rng) if rng.random() < 0.7 else np.full((side, side), 255, np.uint8)
    span = min(texture.shape[:2]) * rng.uniform(0.4, 1.0)
    top, left = rng.uniform(0, texture.shape[0] - span), rng.uniform(0, texture.shape[1] - span)
    surface = _resize(texture, (left, top, left + span, top + span), side)
    surface = np.rot90(surface, int(rng.integers(4)))
    axis = np.linspace(-1, 1, side)
    slope = rng.normal(0, 0.3, 2)
    ramp = 1 + slope[0] * axis[:, None] + slope[1] * axis[None, :]
    ramp = ramp - rng.uniform(0, 0.5) * (axis[:, None] ** 2 + axis[None, :] ** 2)
    lit = surface * np.clip(ramp, 0.15, 2.0)[..., None]
    edge = min(behind.shape[:2])
    ground = _resize(behind, (0, 0, edge, edge), side)
    image = np.where(mask[..., None] > 0, lit, ground)
    return np.clip(image, 0, 255).astype(np.uint8), mask


def _resize(pixels: Pixels, box: tuple[float, float, float, float], side: int) -> Pixels:
    image = Image.fromarray(pixels).resize((side, side), Image.Resampling.BICUBIC, box=box)
    return np.asarray(image)


def _shape(side: int, rng: np.random.Generator) -> Pixels:
    """Draw a turned ellipse or box covering much of the crop: (side, side) uint8, 0 or 255."""
    y, x = np.mgrid[0:side, 0:side] / side - 0.5
    angle = rng.uniform(0, np.pi)
    u, v = x * np.cos(angle) + y * np.sin(angle), y * np.cos(angle) - x * np.sin(angle)
    a, b = rng.uniform(0.25, 0.55, 2)
    power = float(rng.choice([2.0, 2.0, 6.0]))
    return np.where(np.abs(u / a) ** power + np.abs(v / b) ** power <= 1, 255, 0).astype(np.uint8)


if __name__ == "__main__":
    sys.exit(main())
