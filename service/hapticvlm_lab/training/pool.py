"""Crops with the answers of both teachers: `python -m hapticvlm_lab.training.pool --data D`.

Computed once: round after round, every picture that may teach gives one more crop, in shuffled
order; shards of renders go first as they appear. The student later sees exactly what its teachers
saw. Shard `p` is p.crops.npy (N, 128, 128, 4) uint8, RGB and mask, and p.answers.npz: label,
source, features_v2, features_edge (N, 1280) and scores_v2, scores_edge (N, 1000), float16.
"""

from __future__ import annotations

import argparse
import csv
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from zlib import crc32

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from hapticvlm_lab.training import crops, sources
from hapticvlm_lab.training.teacher import FILES, SIDE, Teacher

STUDENT_SIDE = 128  # px
PER_SHARD = 1000
SEED = 20261122
CROPS, ANSWERS = ".crops.npy", ".answers.npz"
NOBODY_KNOWS = ""  # label of a picture without one

Pixels = NDArray[np.uint8]


@dataclass(frozen=True, slots=True)
class Picture:
    """One file of the data folder: its path there, what it shows (or NOBODY_KNOWS), its source."""

    path: str
    label: str
    source: str


@dataclass(frozen=True, slots=True)
class Batch:
    """Crops (N, 224, 224, 4) uint8, RGB and mask, with label and source of each."""

    crops: Pixels
    labels: Sequence[str]
    sources: Sequence[str]


def main() -> int:
    """Read the command line and describe what is not described yet, for ever or to the end."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--data", type=Path, required=True, help="folder with labels.csv")
    parser.add_argument("--out", type=Path, required=True, help="folder of the pool")
    parser.add_argument("--renders", type=Path, nargs="*", default=[], help="folders of shards")
    parser.add_argument("--part", type=int, default=0, help="this process of --parts")
    parser.add_argument("--parts", type=int, default=1)
    parser.add_argument("--wait", action="store_true", help="wait for more renders at the end")
    chosen = parser.parse_args()
    chosen.out.mkdir(parents=True, exist_ok=True)
    teachers = {name: Teacher(chosen.data, name) for name in FILES}

    def is_mine(number: int) -> bool:
        return bool(number % chosen.parts == chosen.part)

    for name, batch in _photographs(chosen.data, chosen.out, is_mine):
        _describe_renders(chosen.renders, chosen.out, teachers, is_mine)
        started = time.monotonic()
        write(batch, chosen.out / name, teachers)
        rate = len(batch.labels) / (time.monotonic() - started)
        sys.stderr.write(f"{name}: {rate:.0f} crops/s\n")
    while True:
        _describe_renders(chosen.renders, chosen.out, teachers, is_mine)
        if not chosen.wait:
            return 0
        time.sleep(30.0)


def pictures(data: Path) -> list[Picture]:
    """List every picture that may teach."""
    found = []
    with (data / "labels.csv").open(newline="", encoding="utf-8") as file:
        for row in csv.DictReader(file):
            path, source = row["path"], row["path"].split("/")[0]
            held_back = source == "ambientcg_tiles" and sources.is_tile_held_back(path)
            if source in sources.ROUNDS and path.endswith(".jpg") and not held_back:
                found.append(Picture(path, sources.material_of(row["class"]), source))
    return found + list(_unlabelled(data))


def write(batch: Batch, path: Path, teachers: dict[str, Teacher]) -> None:
    """Describe a batch and write its shard; `path` without suffix. The answers come last."""
    images, masks = batch.crops[..., :3], batch.crops[..., 3]
    answers: dict[str, Any] = {}
    for name, teacher in teachers.items():
        found = teacher.describe(images, masks)
        answers[f"features_{name}"] = found.features.astype(np.float16)
        answers[f"scores_{name}"] = found.scores.astype(np.float16)
    small = np.stack([_shrink(crop) for crop in batch.crops])
    parts = [path.with_name(f"{path.name}.part{suffix}") for suffix in (CROPS, ANSWERS)]
    np.save(parts[0], small)
    answers |= {"label": np.array(batch.labels), "source": np.array(batch.sources)}
    np.savez(parts[1], **answers)
    for part, suffix in zip(parts, (CROPS, ANSWERS), strict=True):
        part.replace(path.with_name(path.name + suffix))


def _unlabelled(data: Path) -> Iterator[Picture]:
    barred = sources.SAME_AS_HELD_BACK | sources.LIVING_HELD_BACK
    for source in sources.UNLABELLED:
        for path in sorted((data / source).rglob("*.jpg")):
            folder = path.parent.name
            if folder not in barred:
                label = sources.UNKNOWN if folder in sources.LIVING_TAUGHT else NOBODY_KNOWS
                yield Picture(str(path.relative_to(data)), label, source)


def _photographs(
    data: Path, out: Path, is_mine: Callable[[int], bool]
) -> Iterator[tuple[str, Batch]]:
    every = pictures(data)
    behind = [picture.path for picture in every if picture.source not in sources.TEXTURES]
    jobs: list[tuple[Picture, int]] = []
    for number in range(max(sources.ROUNDS.values())):
        now = [(picture, number) for picture in every if number < sources.ROUNDS[picture.source]]
        order = np.random.default_rng([SEED, number]).permutation(len(now))
        jobs += [now[index] for index in order]
    chunks = [jobs[start : start + PER_SHARD] for start in range(0, len(jobs), PER_SHARD)]
    for number, chunk in enumerate(chunks):
        name = f"pictures_{number:05d}"
        if is_mine(number) and not (out / f"{name}{ANSWERS}").exists():
            cut = np.stack([_cut(data, *job, behind) for job in chunk])
            labels, named = zip(*((job[0].label, job[0].source) for job in chunk), strict=True)
            yield name, Batch(cut, labels, named)


def _cut(data: Path, picture: Picture, number: int, behind: Sequence[str]) -> Pixels:
    rng = np.random.default_rng([SEED, crc32(picture.path.encode()), number])
    pixels = _read(data / picture.path)
    if picture.source in sources.TEXTURES:
        ground = _read(data / behind[int(rng.integers(len(behind)))])
        cut = crops.dress(pixels, ground, SIDE, rng)
    elif picture.source == sources.ON_BOARD:
        cut = crops.on_board(pixels, SIDE, rng)
    else:
        cut = crops.photograph(pixels, SIDE, rng)
    return np.dstack(cut)


def _describe_renders(
    folders: Sequence[Path], out: Path, teachers: dict[str, Teacher], is_mine: Callable[[int], bool]
) -> None:
    for folder in folders:
        for path in sorted(folder.glob("shard_*.npz")):
            name = f"{folder.name}_{path.stem}"
            done = (out / f"{name}{ANSWERS}").exists() or sources.is_calibration_shard(path.stem)
            if not done and is_mine(crc32(name.encode())):
                with np.load(path, allow_pickle=False) as file:
                    batch = Batch(file["big"], file["label"].tolist(), file["source"].tolist())
                write(batch, out / name, teachers)


def _shrink(crop: Pixels) -> Pixels:
    """Make (S, S, 4) RGB and mask the student's size, the mask 0 or 255 again."""
    size = (STUDENT_SIDE, STUDENT_SIDE)
    image = Image.fromarray(crop[..., :3]).resize(size, Image.Resampling.BILINEAR)
    mask = np.asarray(Image.fromarray(crop[..., 3]).resize(size, Image.Resampling.BILINEAR))
    return np.dstack([np.asarray(image), np.where(mask > 127, 255, 0).astype(np.uint8)])


def _read(path: Path) -> Pixels:
    return np.asarray(Image.open(path).convert("RGB"))


if __name__ == "__main__":
    sys.exit(main())
