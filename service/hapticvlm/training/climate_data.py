"""Pictures of places with a rough temperature: labels to climate classes, views, features.

No picture here comes with a measured temperature. A label stands for a range of air temperatures
set by hand (weather/priors.json), so what is learned is at best the label. The class of a label is
the one its range's middle lies in:
    snow -6.5 freezing; fog 7.5 cold; rain, cloudy 15, sunrise 18, clear 19 mild; shine 27 warm
and indoor 21.5 is a class of its own, as no weather reaches it. No label is hot: such an estimate
could never say so. Rain, cloudy, sunrise and clear span 20 to 22 K, so that they lie in their class
about half of the time; the narrow labels (LARGEST_HALF_WIDTH_C) do not.
"""

from __future__ import annotations

import csv
import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from hapticvlm.recognition.encoder import Encoder
from hapticvlm.recognition.pictures import Crop
from hapticvlm.training.render.radiance import read_radiance

Pixels = NDArray[np.uint8]
Floats = NDArray[np.float32]

CLASSES = ("freezing", "cold", "mild", "warm", "hot", "indoor")
EDGES_C = (0.0, 12.0, 22.0, 30.0)  # between the first five, degC: our choice
LARGEST_HALF_WIDTH_C = 8.5  # of a narrow label: about the paper's tolerance of 8 degC
EVERY = 8  # so many frames of a capture apart: three looks a second
VIEWS = 4  # of a panorama, a quarter turn apart, 90 degrees wide

# What the panoramas of hdri/ show, by eye; the starlit night (dikhololo) says no temperature.
PANORAMAS = {
    "adams_place_bridge": "indoor",
    "empty_warehouse_01": "indoor",
    "lebombo": "indoor",
    "st_fagans_interior": "indoor",
    "studio_small_03": "indoor",
    "forest_slope": "clear",
    "rooitou_park": "clear",
    "immenstadter_horn": "cloudy",
    "potsdamer_platz": "cloudy",
    "kiara_1_dawn": "sunrise",
    "venice_sunset": "sunrise",
}
_SOURCES = {"Multi-class": "web photos", "AlexandreSajus": "road photos", "robocasa": "kitchens"}


@dataclass(frozen=True, slots=True)
class Place:
    """A picture (H, W, 3) uint8, its label and source; `group` is shared by views of one place."""

    image: Pixels
    label: str
    source: str
    group: str


@dataclass(frozen=True, slots=True)
class Prior:
    """The range of air temperatures a label stands for, degC."""

    low_c: float
    high_c: float

    @property
    def middle_c(self) -> float:
        """Middle of the range, degC."""
        return (self.low_c + self.high_c) / 2

    @property
    def is_narrow(self) -> bool:
        """Whether the range is about as narrow as the tolerance."""
        return (self.high_c - self.low_c) / 2 <= LARGEST_HALF_WIDTH_C


def read_priors(data: Path) -> dict[str, Prior]:
    """Read the range of every label."""
    found = json.loads((data / "weather" / "priors.json").read_text(encoding="utf-8"))
    return {name: Prior(*map(float, at)) for name, at in found.items() if name != "note"}


def class_of(label: str, priors: Mapping[str, Prior]) -> int:
    """Return the index of a label's class in CLASSES."""
    if label == "indoor":
        return CLASSES.index("indoor")
    return int(np.searchsorted(EDGES_C, priors[label].middle_c, side="right"))


def read_places(data: Path) -> Iterator[Place]:
    """Read the pictures of weather/ and views of the panoramas of hdri/."""
    with (data / "labels.csv").open(newline="", encoding="utf-8") as file:
        rows = [row for row in csv.DictReader(file) if row["path"].startswith("weather/")]
    for row in rows:
        source = next(name for mark, name in _SOURCES.items() if row["source"].startswith(mark))
        with Image.open(data / row["path"]) as image:
            yield Place(np.asarray(image.convert("RGB")), row["class"], source, row["path"])
    if not (data / "hdri").is_dir():
        return
    for name, label in PANORAMAS.items():
        panorama = read_radiance(data / "hdri" / f"{name}_512.hdr")
        for turn in range(VIEWS):
            yield Place(view(panorama, turn / VIEWS), label, "panoramas", name)


def read_capture(folder: Path) -> Iterator[Place]:
    """Read every EVERYth frame of a capture of a room: rendered, and one place."""
    for path in sorted((folder / "frames").iterdir())[::EVERY]:
        with Image.open(path) as image:
            yield Place(np.asarray(image.convert("RGB")), "indoor", "headset", folder.name)


def view(panorama: Floats, turn: float, side: int = 224) -> Pixels:
    """Look into an equirectangular (H, W, 3) linear panorama at `turn` (0..1): (side, side, 3)."""
    height, width = panorama.shape[:2]
    axis = (np.arange(side) + 0.5) / side * 2.0 - 1.0
    x, y = np.meshgrid(axis, -axis)
    across = (np.arctan(x) / (2 * np.pi) + turn) % 1.0
    up = np.arctan2(y, np.hypot(x, 1.0))
    rows = np.clip(((0.5 - up / np.pi) * height).astype(int), 0, height - 1)
    seen = panorama[rows, np.minimum((across * width).astype(int), width - 1)]
    exposed = np.clip(0.8 * seen / max(float(np.percentile(seen, 80)), 1e-6), 0.0, 1.0)
    return np.asarray(np.round(255.0 * exposed ** (1 / 2.2)), np.uint8)


def colour_features(image: Pixels) -> Floats:
    """Describe colour, brightness and their layout: (48,) float32, about 0..1."""
    small = np.asarray(Image.fromarray(image).resize((64, 64), Image.Resampling.BOX), np.float32)
    small /= 255.0
    level, least = small.max(axis=2), small.min(axis=2)
    saturation = (level - least) / np.maximum(level, 1e-3)
    thirds = np.array_split(np.dstack([small, saturation, level]), 3, axis=0)
    red, green, blue = np.moveaxis(small, 2, 0)
    shares = [blue > red + 0.05, red > blue + 0.05, green > np.maximum(red, blue), level > 0.95]
    edges = [np.abs(np.diff(level, axis=axis)).mean() for axis in (0, 1)]
    parts = [
        *[third.mean(axis=(0, 1)) for third in thirds],
        *[third.std(axis=(0, 1)) for third in thirds],
        np.percentile(level, (5, 25, 50, 75, 95)),
        np.percentile(saturation, (5, 25, 50, 75, 95)),
        [share.mean() for share in shares],
        edges,
        [saturation.std(), level.std()],
    ]
    return np.concatenate([np.asarray(part, np.float32) for part in parts])


def squares(images: Sequence[Pixels], side: int) -> Pixels:
    """Resize whole pictures to squares: (N, side, side, 3) uint8."""
    resized = [
        Image.fromarray(one).resize((side, side), Image.Resampling.BILINEAR) for one in images
    ]
    return np.stack([np.asarray(one) for one in resized])


def embed(images: Sequence[Pixels], encoder: Encoder) -> Floats:
    """Embed whole pictures as one crop each, all of it under the mask: (N, D) float32."""
    mask = np.full((encoder.side, encoder.side), 255, np.uint8)
    return encoder.embed([Crop(image, mask) for image in squares(images, encoder.side)])
