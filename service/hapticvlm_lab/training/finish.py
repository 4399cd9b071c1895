"""From a run to what ships: `python -m hapticvlm_lab.training.finish --run R --pool P ...`.

Fits the embedding to the network's average, exports it, makes its gallery (beliefs.py) and writes
both. Touches nothing that is held back or only reported.

The network's features and, beside them, what the heads for classes and names make of them (logits
without their mean) are cut to the directions in which pictures differ most (principal components).
It is all linear, so it ships as the network's last matrix. Chosen on rooms and choose_web: LOG.md.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import torch
from numpy.typing import NDArray

from hapticvlm.vision.encoders.loading import load_encoder
from hapticvlm.vision.galleries.storage import FILE_NAME, save_gallery
from hapticvlm.vision.pictures import Crop
from hapticvlm_lab.training import beliefs, export
from hapticvlm_lab.training.distil import CHECKPOINT
from hapticvlm_lab.training.network import Network, Shape, prepare

Floats = NDArray[np.float32]
Affine = tuple[Floats, Floats]  # weights (D, F) and bias (D,) of a linear layer

HEADS = ("classes", "names")  # whose logits the embedding holds beside the features
BATCH = 64


def fit_projection(features: Floats, heads: Sequence[Affine], dimension: int) -> Affine:
    """Fit weights (dimension, F) and bias to features (N, F) of pictures and to their heads."""
    width = features.shape[1]
    maps, shifts = [np.eye(width)], [np.zeros(width)]
    for weights, bias in heads:
        maps.append((weights - weights.mean(axis=0)).T.astype(np.float64))
        shifts.append((bias - bias.mean()).astype(np.float64))
    widen, shift = np.hstack(maps), np.concatenate(shifts)
    wide = features.astype(np.float64) @ widen + shift
    mean = wide.mean(axis=0)
    _, axes = np.linalg.eigh(np.cov((wide - mean).T))
    strongest = axes[:, ::-1][:, :dimension]
    found = (widen @ strongest).T, (shift - mean) @ strongest
    return found[0].astype(np.float32), found[1].astype(np.float32)


def main() -> int:
    """Read the command line and write the files."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--run", type=Path, required=True)
    parser.add_argument("--pool", type=Path, required=True)
    parser.add_argument("--data", type=Path, required=True)
    parser.add_argument("--renders", type=Path, nargs="+", required=True, help="folders of shards")
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--weights", type=Path, help="folder of the safetensors (--out)")
    parser.add_argument("--name", required=True, help="e.g. material-1")
    parser.add_argument("--side", type=int, default=128)
    chosen = parser.parse_args()
    torch.set_num_threads(1)
    crops = [crop for crop, _, _ in beliefs.labelled(chosen.pool, chosen.renders, chosen.side)]
    export.write(load_run(chosen.run, crops), chosen.name, chosen.side, chosen.out, chosen.weights)
    encoder = load_encoder(str(chosen.out))
    found = beliefs.make_gallery(encoder, chosen.pool, chosen.data, chosen.renders)
    save_gallery(found, chosen.out / FILE_NAME)
    sys.stderr.write(f"{len(found.labels)} references; {found.calibration}\n")
    return 0


def load_run(run: Path, crops: Sequence[Crop]) -> Network:
    """Load the average of a run and fit its embedding to crops."""
    held = torch.load(run / CHECKPOINT, map_location="cpu", weights_only=True)["average"]
    network = Network(Shape())
    weights = {
        name.removeprefix("network."): value
        for name, value in held.items()
        if name.startswith("network.") and not name.startswith("network.project.")
    }
    network.load_state_dict(weights, strict=False)
    pairs = [(held[f"heads.{name}.weight"], held[f"heads.{name}.bias"]) for name in HEADS]
    heads = [(rows.numpy(), bias.numpy()) for rows, bias in pairs]
    found = fit_projection(features_of(network, crops), heads, network.shape.dimension)
    network.project.weight.data, network.project.bias.data = map(torch.from_numpy, found)
    return network.eval()


@torch.no_grad()
def features_of(network: Network, crops: Sequence[Crop]) -> NDArray[np.float32]:
    """Features (N, F) of crops, without the projection."""
    network.eval()
    planes = [np.dstack([crop.image, crop.mask]) for crop in crops]
    parts = [
        network.features(prepare(torch.from_numpy(np.stack(planes[at : at + BATCH])))).numpy()
        for at in range(0, len(planes), BATCH)
    ]
    return np.concatenate(parts)


if __name__ == "__main__":
    sys.exit(main())
