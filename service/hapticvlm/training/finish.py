"""From a finished run to what ships: `python -m hapticvlm.training.finish --run R --data D ...`.

Exports the network, chooses references among the training pictures, calibrates on sources kept for
that (sources.CALIBRATION), writes encoder and gallery. Touches nothing that is held back.
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
from hapticvlm.recognition import gallery as galleries
from hapticvlm.recognition.encoder import Encoder, load_encoder
from hapticvlm.recognition.gallery import Gallery
from hapticvlm.recognition.pictures import Crop, central_mask
from hapticvlm.training import export, fit, shards, sources
from hapticvlm.training.fit import Judged
from hapticvlm.training.network import Network, Shape

MOST_PER_CELL = 400
SEED = 20250502
BATCH = 16

Floats = NDArray[np.float32]


def main() -> int:
    """Read the command line and write the files."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--run", type=Path, required=True)
    parser.add_argument("--data", type=Path, required=True)
    parser.add_argument("--shards", type=Path, nargs="+", required=True)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--name", required=True, help="e.g. material-1")
    parser.add_argument("--side", type=int, default=128)
    parser.add_argument("--precision", choices=export.PRECISIONS, default="int8")
    chosen = parser.parse_args()
    torch.set_num_threads(1)
    network = load_run(chosen.run)
    export.write(network, chosen.name, chosen.side, chosen.out, chosen.precision)
    encoder = load_encoder(str(chosen.out))
    found = make_gallery(encoder, chosen.shards, chosen.data)
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


def make_gallery(encoder: Encoder, folders: list[Path], data: Path) -> Gallery:
    """Choose references of every material, and of none of them; calibrate."""
    names = (*materials.MATERIALS, materials.UNKNOWN)
    embeddings, labels, cells = _embed_cells(encoder, folders, names)
    references, of = fit.choose_references(embeddings, labels, cells, SEED)
    judged = [_judge(encoder, data)]
    calibration = fit.fit_calibration(judged, references, of, len(materials.MATERIALS))
    return Gallery(encoder.name, names, references, of, calibration)


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


def _judge(encoder: Encoder, data: Path) -> Judged:
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
