"""From a run to what ships: `python -m hapticvlm_lab.training.finish --run R --pool P ...`.

Exports the network's average, makes its gallery (beliefs.py) and writes both. Touches nothing that
is held back or only reported.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import torch

from hapticvlm.recognition.encoders.loading import load_encoder
from hapticvlm.recognition.galleries.storage import FILE_NAME, save_gallery
from hapticvlm_lab.training import beliefs, export
from hapticvlm_lab.training.distil import CHECKPOINT
from hapticvlm_lab.training.network import Network, Shape
from hapticvlm_lab.training.teacher import FILES


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
    export.write(load_run(chosen.run), chosen.name, chosen.side, chosen.out, chosen.weights)
    encoder = load_encoder(str(chosen.out))
    found = beliefs.make_gallery(encoder, chosen.pool, chosen.data, chosen.renders)
    save_gallery(found, chosen.out / FILE_NAME)
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


if __name__ == "__main__":
    sys.exit(main())
