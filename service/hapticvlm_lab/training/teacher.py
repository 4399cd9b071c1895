"""The two general ImageNet networks of the data folder: teachers to distil from, marks to reach.

Read by OpenVINO from their TFLite files; never committed, never shipped. A feature is the last
spatial map (1280 x 7 x 7) averaged under the mask; the scores are those of the 1,000 classes in the
common order (a class "background" before them is left out).
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image

FOLDER = "teacher"  # in the data folder
FILES = {
    "v2": "mobilenet_v2_1.0_224_int8.tflite",
    "edge": "mobilenet_edgetpu_224_1.0_uint8.tflite",
}
SIDE = 224  # px
CELLS = 7  # a side of their last map
DIMENSION = 1280
CLASSES = 1000
AROUND = 0.1  # least weight of a cell outside the mask
DIM_OUTSIDE = 0.25  # contrast that is left outside the mask
GREY = (124, 116, 104)  # ImageNet's mean
BATCH = 16
_POOLING = ("ReduceMean", "AvgPool")

Floats = NDArray[np.float32]
Pixels = NDArray[np.uint8]


@dataclass(frozen=True, slots=True)
class Answers:
    """Features (N, 1280) and class scores (N, 1000) of N crops, float32."""

    features: Floats
    scores: Floats


class Teacher:
    """One of FILES; describes square crops under their masks."""

    def __init__(self, data: Path, name: str = "v2", threads: int = 1) -> None:
        import openvino

        core = openvino.Core()
        whole = core.read_model(data / FOLDER / FILES[name])
        nodes = whole.get_ordered_ops()
        pooling = [node for node in nodes if node.get_type_name() in _POOLING][-1]
        softmax = [node for node in nodes if node.get_type_name() == "Softmax"][-1]
        outputs = [pooling.input_value(0), softmax.input_value(0)]
        model = openvino.Model(outputs, whole.get_parameters(), name)
        settings = {"INFERENCE_NUM_THREADS": threads, "ENABLE_CPU_PINNING": False}
        self._run = core.compile_model(model, "CPU", settings)

    def describe(self, images: Pixels, masks: Pixels) -> Answers:
        """Describe (N, S, S, 3) uint8 RGB under (N, S, S) masks (nonzero = object)."""
        features, scores = [], []
        for start in range(0, len(images), BATCH):
            maps, logits = self._answer(images[start : start + BATCH])
            features.append(pool(maps, masks[start : start + BATCH]))
            scores.append(logits[:, -CLASSES:])
        return Answers(np.concatenate(features), np.concatenate(scores))

    def features(self, images: Pixels, masks: Pixels) -> Floats:
        """Features with the surroundings dimmed, as the student sees them: (N, 1280) float32."""
        return self.describe(dim(images, masks), masks).features

    def _answer(self, images: Pixels) -> tuple[Floats, Floats]:
        found = self._run(np.stack([_fit(image) for image in images]))
        maps, logits = (np.asarray(found[number], np.float32) for number in range(2))
        return maps if maps.shape[1] == DIMENSION else maps.transpose(0, 3, 1, 2), logits


def dim(images: Pixels, masks: Pixels) -> Pixels:
    """Take contrast out of what lies outside the masks: (N, S, S, 3) uint8."""
    inside = (masks > 0)[..., None]
    grey = np.array(GREY, np.float32)
    dimmed = grey + DIM_OUTSIDE * (images - grey)
    return np.where(inside, images, np.round(dimmed)).astype(np.uint8)


def pool(maps: Floats, masks: Pixels) -> Floats:
    """Average (N, C, 7, 7) maps under (N, S, S) masks: (N, C) float32."""
    cells = [
        Image.fromarray(np.where(mask > 0, 255, 0).astype(np.uint8)).resize(
            (CELLS, CELLS), Image.Resampling.BOX
        )
        for mask in masks
    ]
    weights = np.stack([np.asarray(cell, np.float32) / 255.0 for cell in cells]) + AROUND
    weights /= weights.sum(axis=(1, 2), keepdims=True)
    return np.asarray(np.einsum("nchw,nhw->nc", maps, weights), np.float32)


def _fit(image: Pixels) -> Pixels:
    if image.shape[0] == SIDE:
        return image
    return np.asarray(Image.fromarray(image).resize((SIDE, SIDE), Image.Resampling.BICUBIC))
