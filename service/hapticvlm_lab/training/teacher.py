"""The general ImageNet network of the data folder: a teacher to distil from, and a mark to reach.

Read by OpenVINO from its TFLite file; never committed, never shipped. Its feature here is that of
the crop with its surroundings dimmed as the student sees them, the last spatial map (7 x 7 x 1280)
averaged under the mask. Shards are described by
`python -m hapticvlm_lab.training.teacher --data D FOLDER...`.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image
from rich.progress import track

from hapticvlm_lab.training import shards

FILE = Path("teacher") / "mobilenet_v2_1.0_224_int8.tflite"
SIDE = 224  # px
CELLS = 7  # a side of its last map
DIMENSION = 1280
AROUND = 0.1  # least weight of a cell outside the mask
DIM_OUTSIDE = 0.25  # contrast that is left outside the mask
GREY = (124, 116, 104)  # ImageNet's mean
BATCH = 32


class Teacher:
    """Gives (N, 1280) float32 features of square crops under their masks."""

    def __init__(self, data: Path, threads: int = 1) -> None:
        import openvino

        core = openvino.Core()
        whole = core.read_model(data / FILE)
        means = [node for node in whole.get_ordered_ops() if node.get_type_name() == "ReduceMean"]
        last_map = means[-1].input_value(0)
        model = openvino.Model([last_map], whole.get_parameters(), "last map")
        self._run = core.compile_model(model, "CPU", {"INFERENCE_NUM_THREADS": threads})

    def maps(self, images: NDArray[np.uint8]) -> NDArray[np.float32]:
        """Last spatial maps of (N, S, S, 3) uint8 RGB: (N, 1280, 7, 7) float32."""
        resized = [
            Image.fromarray(one).resize((SIDE, SIDE), Image.Resampling.BICUBIC) for one in images
        ]
        return np.asarray(self._run(np.stack([np.asarray(one) for one in resized]))[0], np.float32)

    def features(self, images: NDArray[np.uint8], masks: NDArray[np.uint8]) -> NDArray[np.float32]:
        """Features under (N, S, S) masks (nonzero = object): (N, 1280) float32."""
        return pool(self.maps(dim(images, masks)), masks)


def dim(images: NDArray[np.uint8], masks: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Take contrast out of what lies outside the masks: (N, S, S, 3) uint8."""
    inside = (masks > 0)[..., None]
    grey = np.array(GREY, np.float32)
    dimmed = grey + DIM_OUTSIDE * (images - grey)
    return np.where(inside, images, np.round(dimmed)).astype(np.uint8)


def pool(maps: NDArray[np.float32], masks: NDArray[np.uint8]) -> NDArray[np.float32]:
    """Average (N, C, 7, 7) maps under (N, S, S) masks: (N, C) float32."""
    cells = [
        Image.fromarray(np.where(mask > 0, 255, 0).astype(np.uint8)).resize(
            (CELLS, CELLS), Image.Resampling.BOX
        )
        for mask in masks
    ]
    weights = np.stack([np.asarray(one, np.float32) / 255.0 for one in cells]) + AROUND
    weights /= weights.sum(axis=(1, 2), keepdims=True)
    return np.asarray(np.einsum("nchw,nhw->nc", maps, weights), np.float32)


def main() -> int:
    """Read the command line and describe the shards that are not described yet."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--data", type=Path, required=True, help="folder with the teacher")
    parser.add_argument("folders", type=Path, nargs="+", help="folders of shards")
    chosen = parser.parse_args()
    teacher = Teacher(chosen.data)
    for path in track(shards.paths(chosen.folders), description="teacher"):
        if not shards.features_path(path).exists():
            shard = shards.read_framed(path)
            parts = [
                teacher.features(shard.images[rows], shard.masks[rows])
                for rows in shards.batches(shard, BATCH)
            ]
            np.save(shards.features_path(path), np.concatenate(parts).astype(np.float16))
    return 0


if __name__ == "__main__":
    sys.exit(main())
