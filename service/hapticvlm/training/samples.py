"""Labelled pictures to training crops: which source says what, and how crops are varied.

Sources are split by name, never by picture: pictures of one source look alike. FIT sources make
the encoder, its gallery and its calibration; REPORT sources are touched by `measure` alone.
"""

from __future__ import annotations

import csv
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path
from zlib import crc32

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from hapticvlm import materials
from hapticvlm.recognition.pictures import Crop, central_mask

FIT = ("ambientcg_tiles", "trashnet", "clothing", "woodboards", "pbr")
REPORT = ("caltech101", "pb_renders")
OPEN = "weather"  # pictures of no material, for the threshold below which nothing is known

CROPS_PER_CELL = 700  # crops of one class of one source
MOST_PER_PICTURE = 12
SEED = 20250502

_SAME = {"brick": "stone", "concrete": "stone"}


@dataclass(frozen=True, slots=True)
class Labelled:
    """One picture: its file, its material (UNKNOWN: none of ours) and the source it comes from."""

    path: Path
    material: str
    source: str


def read_labels(data: Path, sources: Sequence[str]) -> list[Labelled]:
    """List the pictures of some sources, in the order of labels.csv."""
    with (data / "labels.csv").open(newline="", encoding="utf-8") as file:
        rows = [row for row in csv.DictReader(file) if row["path"].split("/")[0] in sources]
    return [
        Labelled(data / row["path"], material_of(row["class"]), row["path"].split("/")[0])
        for row in rows
        if row["path"].endswith((".jpg", ".png"))
    ]


def material_of(label: str) -> str:
    """Map a class of labels.csv to one of the material table, UNKNOWN when it has none."""
    name = _SAME.get(label, label)
    return name if name in materials.MATERIALS else materials.UNKNOWN


def crops(pictures: Sequence[Labelled], side: int) -> Iterator[tuple[Labelled, Crop]]:
    """Vary every picture into crops, as many as bring the cells of source and class level."""
    sizes = Counter((picture.source, picture.material) for picture in pictures)
    for index, picture in enumerate(pictures):
        rng = np.random.default_rng([SEED, crc32(picture.path.name.encode()), index])
        wanted = CROPS_PER_CELL / sizes[picture.source, picture.material]
        image = Image.open(picture.path).convert("RGB")
        behind = Image.open(pictures[int(rng.integers(len(pictures)))].path).convert("RGB")
        for _ in range(int(np.clip(round(wanted), 1, MOST_PER_PICTURE))):
            yield picture, _vary(image, behind, side, rng)


def _vary(image: Image.Image, behind: Image.Image, side: int, rng: np.random.Generator) -> Crop:
    """Cut, turn, light, blur and compress; every other crop stands before another picture."""
    pixels = _light(_cut(image, side, rng), side, rng)
    mask = central_mask(side)
    if rng.random() < 0.5:
        mask = _shape(side, rng)
        ground = _light(_cut(behind, side, rng), side, rng)
        pixels = np.where(mask[..., None] > 0, pixels, ground)
    noisy = pixels + rng.normal(0, rng.uniform(0, 5), pixels.shape)
    small = Image.fromarray(np.clip(noisy, 0, 255).astype(np.uint8))
    store = BytesIO()
    small.save(store, "JPEG", quality=int(rng.integers(50, 95)))
    return Crop(np.asarray(Image.open(store)), mask)


def _cut(image: Image.Image, side: int, rng: np.random.Generator) -> NDArray[np.float64]:
    width, height = image.size
    size = min(image.size) * rng.uniform(0.4, 1.0)
    left, top = rng.uniform(0, width - size), rng.uniform(0, height - size)
    box = (left, top, left + size, top + size)
    smaller = int(side * rng.choice([0.5, 0.75, 1.0, 1.0]))
    pixels = image.resize((smaller, smaller), Image.Resampling.BILINEAR, box=box)
    pixels = pixels.resize((side, side), Image.Resampling.BILINEAR)
    turns = int(rng.choice([0, 0, 1, 3]))
    turned: NDArray[np.float64] = np.rot90(np.asarray(pixels, np.float64), turns)
    mirrored: NDArray[np.float64] = turned[:, ::-1]
    return mirrored if rng.random() < 0.5 else turned


def _light(pixels: NDArray[np.float64], side: int, rng: np.random.Generator) -> NDArray[np.float64]:
    """Exposure, white balance, contrast and a slope of brightness across the crop."""
    axis = np.linspace(-1, 1, side)
    slope = rng.normal(0, 0.25, 2)
    ramp = 1 + slope[0] * axis[:, None] + slope[1] * axis[None, :]
    tint = np.exp(rng.normal(0, 0.08, 3)) * np.exp(rng.normal(0, 0.25))
    shaped = 255 * (np.clip(pixels, 0, 255) / 255) ** np.exp(rng.normal(0, 0.2))
    lit: NDArray[np.float64] = np.clip(shaped * tint * np.clip(ramp, 0.2, 2.0)[..., None], 0, 255)
    return lit


def _shape(side: int, rng: np.random.Generator) -> NDArray[np.uint8]:
    """Draw a turned ellipse or box covering much of the crop: (side, side) uint8, 0 or 255."""
    y, x = np.mgrid[0:side, 0:side] / side - 0.5
    angle = rng.uniform(0, np.pi)
    u, v = x * np.cos(angle) + y * np.sin(angle), y * np.cos(angle) - x * np.sin(angle)
    a, b = rng.uniform(0.25, 0.5, 2)
    power = float(rng.choice([2.0, 2.0, 6.0]))
    return np.where(np.abs(u / a) ** power + np.abs(v / b) ** power <= 1, 255, 0).astype(np.uint8)
