"""Features of the network for the pictures that teach, choose and calibrate.

Crops are described by the int8 graph that ships, so that a head learns from exactly the features
that it will get. `sources` alone decides which picture may do what.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from zlib import crc32

import numpy as np
from numpy.typing import NDArray
from PIL import Image
from rich.progress import track

from hapticvlm import materials
from hapticvlm.materials import UNKNOWN
from hapticvlm.vision import files, pictures
from hapticvlm.vision.encoders.onnx_encoder import open_session
from hapticvlm.vision.galleries.network_gallery import read_references
from hapticvlm.vision.pictures import Crop
from hapticvlm_lab.training import crops, sources
from hapticvlm_lab.training.crops import SIDE

NAMES = (*materials.MATERIALS, UNKNOWN)
ROOMS = "rooms"
SEED = 20261122
# Crops of one source and class, by round: the second round adds to the sources that show most.
MOST = ({"imagenet_small": 150}, {"imagenet_small": 500})
OTHERS = (60, 150)

Pixels = NDArray[np.uint8]
Labelled = tuple[Crop, str, str]  # crop, label, source


@dataclass(frozen=True, slots=True)
class Described:
    """features (N, F) and scores (N, 1000) float16; labels (N,) places in NAMES; sources (N,)."""

    features: NDArray[np.float16]
    scores: NDArray[np.float16]
    labels: NDArray[np.int64]
    sources: NDArray[np.str_]


@dataclass(frozen=True, slots=True)
class Picture:
    """One file of the data folder: its path there, its label, its source."""

    path: str
    label: str
    source: str


def describe_all(graph: bytes, sets: Mapping[str, Iterable[Labelled]]) -> dict[str, Described]:
    """Describe every set of crops by a graph of shipped_graph.describing."""
    session = open_session(graph, 1)
    return {name: _described(session, track(shown, name)) for name, shown in sets.items()}


def _described(session: Any, shown: Iterable[Labelled]) -> Described:  # noqa: ANN401
    rows = []
    for crop, label, source in shown:
        pixels = np.dstack([crop.image, np.where(crop.mask > 0, 255, 0).astype(np.uint8)])
        features, scores = session.run(["features", "_fc"], {"crops": pixels[None]})
        halves = features[0].astype(np.float16), scores[0].astype(np.float16)
        rows.append((*halves, NAMES.index(label), source))
    columns = zip(*rows, strict=True) if rows else ((), (), (), ())
    kinds = (np.float16, np.float16, np.int64, np.str_)
    return Described(*(np.array(each, kind) for each, kind in zip(columns, kinds, strict=True)))


def teaching(data: Path, renders: Path) -> dict[str, Iterable[Labelled]]:
    """Return every set of crops that may teach: references, photographs, renders."""
    sets: dict[str, Iterable[Labelled]] = {"references": _references()}
    sets |= {f"photographs_{turn}": _photographs(data, turn) for turn in range(len(MOST))}
    return sets | {ROOMS: _rooms(renders / ROOMS, calibrates=False)}


def judging(data: Path, renders: Path) -> dict[str, Iterable[Labelled]]:
    """Return the sets that choose and calibrate: renders of other rooms, and sources.CHOICE."""
    left_out = _rooms(renders / ROOMS, calibrates=True)
    return {sources.CHOICE: _chosen(data), f"{ROOMS}_left_out": left_out}


def photographs(data: Path) -> list[Picture]:
    """List every labelled photograph that may teach, and living things, which are unknown."""
    every = [
        Picture(path.relative_to(data).as_posix(), sources.material_of(label), source)
        for source in sources.TEACHING
        for path, label in sources.labelled(data, source)
        if source != sources.TILES or not sources.is_tile_held_back(path.name)
    ]
    kept = [each for each in every if each.source == sources.TILES or each.label != UNKNOWN]
    folders = [data / sources.LIVING / name for name in sorted(sources.LIVING_TAUGHT)]
    living = [path for folder in folders for path in sorted(folder.glob("*.jpg"))]
    return kept + [
        Picture(path.relative_to(data).as_posix(), UNKNOWN, sources.LIVING) for path in living
    ]


def drawn(paths: Iterable[Path]) -> Iterator[Labelled]:
    """Yield the drawn crops of files; the source of each is the name of its file."""
    for path in paths:
        with np.load(path) as file:
            for big, label in zip(file["big"], file["label"].tolist(), strict=True):
                yield Crop(big[..., :3].copy(), big[..., 3].copy()), label, path.stem


def _references() -> Iterator[Labelled]:
    shown, labels = read_references(SIDE)
    for crop, label in zip(shown, labels.tolist(), strict=True):
        yield crop, NAMES[label], "references"


def _photographs(data: Path, turn: int) -> Iterator[Labelled]:
    """Cut photographs that teach, at most MOST of each source and class, another part each turn."""
    every = photographs(data)
    behind = [picture for picture in every if picture.source not in sources.TEXTURES]
    order = np.random.default_rng(SEED + turn).permutation(len(every))
    taken: Counter[tuple[str, str]] = Counter()
    for place in order:
        picture = every[place]
        cell = (picture.source, picture.label)
        if taken[cell] < MOST[turn].get(picture.source, OTHERS[turn]):
            taken[cell] += 1
            yield _cut(data, picture, turn, behind), picture.label, picture.source


def _cut(data: Path, picture: Picture, turn: int, behind: Sequence[Picture]) -> Crop:
    """Cut a picture, each turn another part; `behind` are pictures to put behind a texture."""
    rng = np.random.default_rng([SEED, crc32(picture.path.encode()), turn])
    pixels = _read_rgb(data / picture.path)
    if picture.source in sources.TEXTURES:
        ground = _read_rgb(data / behind[int(rng.integers(len(behind)))].path)
        return Crop(*crops.dress(pixels, ground, rng))
    how = crops.on_board if picture.source == sources.ON_BOARD else crops.photograph
    return Crop(*how(pixels, rng))


def _read_rgb(path: Path) -> Pixels:
    with Image.open(path) as image:
        return np.asarray(image.convert("RGB"))


def _rooms(folder: Path, *, calibrates: bool) -> Iterator[Labelled]:
    shards = sorted(folder.glob("*.npz"))
    chosen = [path for path in shards if sources.is_calibration_shard(path.stem) == calibrates]
    return ((crop, label, ROOMS) for crop, label, _ in drawn(chosen))


def _chosen(data: Path) -> Iterator[Labelled]:
    """Cut sources.CHOICE as `recognise` cuts pictures without a mask: whole."""
    for path, label in sources.labelled(data, sources.CHOICE):
        crop = pictures.crop(files.read_frame(path), SIDE)
        yield crop, sources.material_of(label), sources.CHOICE
