"""From a run to what ships: `python -m hapticvlm_lab.training.finish --run R --pool P ...`.

Exports the network's average, chooses references among the labelled crops of the pool, calibrates
on pictures kept for that (sources.CHOICE, sources.CALIBRATION, and shards of renders that taught
nothing), writes encoder and gallery. Touches nothing that is held back or only reported.
"""

from __future__ import annotations

import argparse
import csv
import sys
from pathlib import Path

import numpy as np
import torch
from numpy.typing import NDArray
from PIL import Image

from hapticvlm import materials
from hapticvlm.recognition.encoders.encoder import Encoder
from hapticvlm.recognition.encoders.loading import load_encoder
from hapticvlm.recognition.galleries import gallery as galleries
from hapticvlm.recognition.galleries.gallery import Gallery
from hapticvlm.recognition.pictures import Crop, central_mask
from hapticvlm_lab.training import export, fit, sources
from hapticvlm_lab.training.distil import CHECKPOINT
from hapticvlm_lab.training.fit import Judged
from hapticvlm_lab.training.network import Network, Shape
from hapticvlm_lab.training.pool import ANSWERS, CROPS
from hapticvlm_lab.training.teacher import FILES

MOST_PER_CELL = 400
SEED = 20250502
BATCH = 16
BLANK_LEVELS = (0, 64, 127, 191, 255)

Floats = NDArray[np.float32]


def main() -> int:
    """Read the command line and write the files."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--run", type=Path, required=True)
    parser.add_argument("--pool", type=Path, required=True)
    parser.add_argument("--data", type=Path, required=True)
    parser.add_argument("--renders", type=Path, required=True, help="folder of shards of renders")
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--weights", type=Path, help="folder of the safetensors (--out)")
    parser.add_argument("--name", required=True, help="e.g. material-1")
    parser.add_argument("--side", type=int, default=128)
    chosen = parser.parse_args()
    torch.set_num_threads(1)
    export.write(load_run(chosen.run), chosen.name, chosen.side, chosen.out, chosen.weights)
    encoder = load_encoder(str(chosen.out))
    judged = [_judge_others(encoder, chosen.data), *_judge_renders(encoder, chosen.renders)]
    found = make_gallery(encoder, chosen.pool, judged)
    galleries.save_gallery(found, chosen.out / galleries.FILE_NAME)
    sys.stderr.write(f"{len(found.labels)} references; {found.calibration}\n")
    return 0


def load_run(run: Path) -> Network:
    """Load the average of a run; its embedding is both teachers' directions, side by side."""
    held = torch.load(run / CHECKPOINT, map_location="cpu", weights_only=True)["average"]
    heads = [(held[f"heads.{name}.weight"], held[f"heads.{name}.bias"]) for name in FILES]
    projection = [torch.cat(parts) for parts in zip(*heads, strict=True)]
    network = Network(Shape(dimension=len(projection[1])))
    weights = {
        key.removeprefix("network."): value
        for key, value in held.items()
        if key.startswith("network.")
    }
    network.load_state_dict(
        weights | {"project.weight": projection[0], "project.bias": projection[1]}
    )
    return network.eval()


def make_gallery(encoder: Encoder, pool: Path, judged: list[Judged]) -> Gallery:
    """Choose references of every material, and of none of them; calibrate."""
    names = (*materials.MATERIALS, materials.UNKNOWN)
    embeddings, labels, cells = _embed_cells(encoder, pool, names)
    references, of = fit.choose_references(embeddings, labels, cells, SEED)
    blanks = embed(encoder, _blanks(encoder.side))
    references = np.concatenate([references, blanks])
    of = np.concatenate([of, np.full(len(blanks), names.index(materials.UNKNOWN), np.int64)])
    calibration = fit.fit_calibration(judged, references, of, len(materials.MATERIALS))
    return Gallery(encoder.name, names, references, of, calibration)


def _blanks(side: int) -> list[Crop]:
    """Frames that show nothing (black, grey, white, noise), whole or under the central mask."""
    rng = np.random.default_rng(SEED)
    flat = [np.full((side, side, 3), level, np.uint8) for level in BLANK_LEVELS]
    noise = [rng.integers(0, 256, (side, side, 3), np.uint8) for _ in range(2)]
    masks = (central_mask(side), np.full((side, side), 255, np.uint8))
    return [Crop(image, mask) for image in (*flat, *noise) for mask in masks]


def _embed_cells(
    encoder: Encoder, pool: Path, names: tuple[str, ...]
) -> tuple[Floats, NDArray[np.int64], NDArray[np.int64]]:
    taken: dict[str, int] = {}
    crops: list[Crop] = []
    labels: list[int] = []
    keys: list[str] = []
    for path in sorted(pool.glob(f"*{ANSWERS}")):
        with np.load(path, allow_pickle=False) as file:
            known = list(zip(file["label"].tolist(), file["source"].tolist(), strict=True))
        pixels = np.load(path.with_name(path.name.replace(ANSWERS, CROPS)), mmap_mode="r")
        for row, (label, source) in enumerate(known):
            key = f"{source}/{label}"
            if label not in names or taken.get(key, 0) >= MOST_PER_CELL:
                continue
            taken[key] = taken.get(key, 0) + 1
            crops.append(_fitting(pixels[row, ..., :3], pixels[row, ..., 3], encoder.side))
            labels.append(names.index(label))
            keys.append(key)
    _, cells = np.unique(keys, return_inverse=True)
    return embed(encoder, crops), np.array(labels, np.int64), cells.astype(np.int64)


def _judge_renders(encoder: Encoder, folder: Path) -> tuple[Judged, Judged]:
    """Embed renders that taught nothing: as they are, and with every fourth one enrolled.

    The second way is what similarity means once a user has enrolled pictures of the scene.
    """
    index = {name: number for number, name in enumerate(materials.MATERIALS)}
    crops: list[Crop] = []
    truth: list[int] = []
    for path in sorted(folder.glob("shard_*.npz")):
        if sources.is_calibration_shard(path.stem):
            with np.load(path, allow_pickle=False) as file:
                pairs, named = file["big"], file["label"].tolist()
            crops += [_fitting(pair[..., :3], pair[..., 3], encoder.side) for pair in pairs]
            truth += [index.get(label, -1) for label in named]
    labels, embeddings = np.array(truth, np.int64), embed(encoder, crops)
    first = np.arange(len(labels)) % 4 == 0
    chosen, rest = first & (labels >= 0), ~first
    enrolled = (embeddings[chosen], labels[chosen])
    return (
        Judged(embeddings, labels, fit.weigh(labels)),
        Judged(embeddings[rest], labels[rest], fit.weigh(labels[rest]), enrolled),
    )


def _judge_others(encoder: Encoder, data: Path) -> Judged:
    """Embed the calibration sources: renders of others, and scenery that is none of ours."""
    index = {name: number for number, name in enumerate(materials.MATERIALS)}
    crops, truth = [], []
    with (data / "labels.csv").open(newline="", encoding="utf-8") as file:
        rows = [
            row
            for row in csv.DictReader(file)
            if row["path"].split("/")[0] in (*sources.CALIBRATION, sources.CHOICE)
        ]
    for row in rows:
        if row["path"].endswith(".jpg"):
            crops.append(_centre(data / row["path"], encoder.side))
            truth.append(index.get(sources.material_of(row["class"]), -1))
    labels = np.array(truth, np.int64)
    return Judged(embed(encoder, crops), labels, fit.weigh(labels))


def embed(encoder: Encoder, crops: list[Crop]) -> Floats:
    """Embed any number of crops in batches: (N, D)."""
    parts = [encoder.embed(crops[at : at + BATCH]) for at in range(0, len(crops), BATCH)]
    return np.concatenate(parts)


def _centre(path: Path, side: int) -> Crop:
    image = Image.open(path).convert("RGB")
    edge = min(image.size) // 2  # the service looks at the central half of a frame without region
    left, top = (image.width - edge) // 2, (image.height - edge) // 2
    cut = image.resize(
        (side, side), Image.Resampling.BILINEAR, (left, top, left + edge, top + edge)
    )
    return Crop(np.asarray(cut), central_mask(side))


def _fitting(image: NDArray[np.uint8], mask: NDArray[np.uint8], side: int) -> Crop:
    if image.shape[0] == side:
        return Crop(image, mask)
    size = (side, side)
    resized = Image.fromarray(image).resize(size, Image.Resampling.BILINEAR)
    inside = Image.fromarray(mask).resize(size, Image.Resampling.NEAREST)
    return Crop(np.asarray(resized), np.asarray(inside))


if __name__ == "__main__":
    sys.exit(main())
