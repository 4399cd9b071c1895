"""The photographs that may teach, and the cut of each. Pure but for the files it reads."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from zlib import crc32

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from hapticvlm.vision.pictures import Crop
from hapticvlm_lab.training import crops, sources
from hapticvlm_lab.training.shipped_graph import SIDE

SEED = 20261122

Pixels = NDArray[np.uint8]


@dataclass(frozen=True, slots=True)
class Picture:
    """One file of the data folder: its path there, its label, its source."""

    path: str
    label: str
    source: str


def pictures(data: Path) -> list[Picture]:
    """List every labelled photograph that may teach, and living things, which are unknown."""
    every = [
        Picture(path.relative_to(data).as_posix(), sources.material_of(label), source)
        for source in sources.TEACHING
        for path, label in sources.labelled(data, source)
    ]
    teaching = [picture for picture in every if _teaches(picture)]
    return teaching + _living(data)


def cut(data: Path, picture: Picture, turn: int, behind: Sequence[Picture]) -> Crop:
    """Cut a picture, each turn another part; `behind` are pictures to put behind a texture."""
    rng = np.random.default_rng([SEED, crc32(picture.path.encode()), turn])
    pixels = read(data / picture.path)
    if picture.source in sources.TEXTURES:
        backgrounds = [other for other in behind if other.source not in sources.TEXTURES]
        ground = read(data / backgrounds[int(rng.integers(len(backgrounds)))].path)
        return Crop(*crops.dress(pixels, ground, SIDE, rng))
    how = crops.on_board if picture.source == sources.ON_BOARD else crops.photograph
    return Crop(*how(pixels, SIDE, rng))


def read(path: Path) -> Pixels:
    """Read a picture: (H, W, 3) uint8 RGB."""
    with Image.open(path) as image:
        return np.asarray(image.convert("RGB"))


def _teaches(picture: Picture) -> bool:
    """Return whether a picture may teach: a material, or a tile that is not held back."""
    is_tile = picture.source == "ambientcg_tiles"
    if is_tile and sources.is_tile_held_back(picture.path):
        return False
    return is_tile or picture.label != sources.UNKNOWN


def _living(data: Path) -> list[Picture]:
    source = sources.UNLABELLED[0]
    return [
        Picture(path.relative_to(data).as_posix(), sources.UNKNOWN, source)
        for folder in sorted(sources.LIVING_TAUGHT)
        for path in sorted((data / source / folder).glob("*.jpg"))
    ]
