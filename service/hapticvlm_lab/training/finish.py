"""From a finished run to what ships.

`python -m hapticvlm_lab.training.finish --run R --data D ...`.

Exports the network, chooses references among the training pictures, calibrates on sources kept for
that (sources.CALIBRATION, and renders of seeds that were not trained on), writes encoder and
gallery. Touches nothing that is held back.
"""

from __future__ import annotations

import argparse
import csv
import json
import sys
from pathlib import Path

import numpy as np
import torch
from numpy.typing import NDArray
from PIL import Image

from hapticvlm import materials
from hapticvlm.recognition.encoders.encoder import Encoder, load_encoder
from hapticvlm.recognition.galleries import gallery as galleries
from hapticvlm.recognition.galleries.gallery import Gallery
from hapticvlm.recognition.pictures import Crop, central_mask
from hapticvlm_lab.training import export, fit, shards, sources
from hapticvlm_lab.training.fit import Judged
from hapticvlm_lab.training.network import Network, Shape

MOST_PER_CELL = 400
SEED = 20250502
BATCH = 16
BLANK_LEVELS = (0, 64, 127, 191, 255)

Floats = NDArray[np.float32]


def main() -> int:
    """Read the command line and write the files."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--run", type=Path, required=True)
    parser.add_argument("--data", type=Path, required=True)
    parser.add_argument("--shards", type=Path, nargs="+", required=True)
    parser.add_argument("--calibration", type=Path, required=True, help="folder of shards")
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--name", required=True, help="e.g. material-1")
    parser.add_argument("--side", type=int, default=128)
    parser.add_argument("--precision", choices=export.PRECISIONS, default="int8")
    chosen = parser.parse_args()
    torch.set_num_threads(1)
    network = load_run(chosen.run)
    export.write(network, chosen.name, chosen.side, chosen.out, chosen.precision)
    encoder = load_encoder(str(chosen.out))
    judged = [
        _judge_others(encoder, chosen.data),
        *_judge_renders(encoder, chosen.calibration),
    ]
    found = make_gallery(encoder, chosen.shards, judged)
    galleries.save_gallery(found, chosen.out / galleries.FILE_NAME)
    _say(f"{len(found.labels)} references; {found.calibration}")
    return 0


def load_run(run: Path) -> Network:
    """Load the averaged network of a run."""
    fields = json.loads((run / "plan.json").read_text())["shape"]
    shape = Shape(tuple(fields["depths"]), tuple(fields["widths"]), fields["dimension"])
    network = Network(shape)
    held = torch.load(run / "checkpoint.pt", map_location="cpu", weights_only=True)
    network.load_state_dict(held["average"])
    return network.eval()


def make_gallery(encoder: Encoder, folders: list[Path], judged: list[Judged]) -> Gallery:
    """Choose references of every material, and of none of them; calibrate."""
    names = (*materials.MATERIALS, materials.UNKNOWN)
    embeddings, labels, cells = _embed_cells(encoder, folders, names)
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
    encoder: Encoder, folders: list[Path], names: tuple[str, ...]
) -> tuple[Floats, NDArray[np.int64], NDArray[np.int64]]:
    taken: dict[str, int] = {}
    crops: list[Crop] = []
    labels: list[int] = []
    keys: list[str] = []
    for path in shards.paths(folders):
        shard = shards.read_framed(path)
        for row, label in enumerate(shard.labels.tolist()):
            kind = str(shard.kinds[row]) if path.parent.name == "crops" else path.parent.name
            key = f"{kind}/{label}"
            barred = label not in names or kind in sources.CALIBRATION
            if barred or taken.get(key, 0) >= MOST_PER_CELL:
                continue
            taken[key] = taken.get(key, 0) + 1
            crops.append(_fitting(shard.images[row], shard.masks[row], encoder.side))
            labels.append(names.index(label))
            keys.append(key)
    _, cells = np.unique(keys, return_inverse=True)
    return embed(encoder, crops), np.array(labels, np.int64), cells.astype(np.int64)


def _judge_renders(encoder: Encoder, folder: Path) -> tuple[Judged, Judged]:
    """Embed our own renders that nothing was trained on: as they are, and with one view enrolled.

    The second way is what similarity means once a user has enrolled pictures of the scene.
    """
    index = {name: number for number, name in enumerate(materials.MATERIALS)}
    crops: list[Crop] = []
    truth: list[int] = []
    samples: list[str] = []
    for path in shards.paths([folder]):
        shard = shards.read_framed(path)
        pairs = zip(shard.images, shard.masks, strict=True)
        crops += [_fitting(image, mask, encoder.side) for image, mask in pairs]
        truth += [index.get(label, -1) for label in shard.labels.tolist()]
        samples += [f"{path.name}/{number}" for number in shard.instances.tolist()]
    labels, embeddings = np.array(truth, np.int64), embed(encoder, crops)
    first = np.zeros(len(labels), np.bool_)
    first[np.unique(samples, return_index=True)[1]] = True
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
            row for row in csv.DictReader(file) if row["path"].split("/")[0] in sources.CALIBRATION
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


def _say(text: str) -> None:
    sys.stderr.write(text + "\n")


if __name__ == "__main__":
    sys.exit(main())
