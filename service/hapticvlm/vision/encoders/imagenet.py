"""What the 1,000 classes of ImageNet are usually made of: class scores read as materials.

imagenet.csv has the classes, by their place in the common order (tench = 0), whose things are
mostly made of one of our materials, or of two alike. Written from general knowledge: our choice.
"""

from __future__ import annotations

import csv
from collections.abc import Mapping
from functools import lru_cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from hapticvlm import materials

Floats = NDArray[np.float32]

CLASSES = 1000
WITH_BACKGROUND = 1001  # some networks have a class "background" before the others
TABLE = Path(__file__).with_name("imagenet.csv")
_KNOWN_PLACE = 398
_KNOWN_NAME = "abacus"


@lru_cache(maxsize=1)
def material_weights() -> Floats:
    """Share of each material in each class: (1000, C), rows that sum to 1 or, unnamed, to 0."""
    weights = np.zeros((CLASSES, len(materials.MATERIALS)), np.float32)
    names = list(materials.MATERIALS)
    with TABLE.open(newline="", encoding="utf-8") as file:
        for row in csv.DictReader(file):
            made_of = row["materials"].split("/")
            for name in made_of:
                weights[int(row["class"]), names.index(name)] = 1.0 / len(made_of)
    weights.setflags(write=False)
    return weights


def is_imagenet(count: int, names: Mapping[int, str] | None = None) -> bool:
    """Whether so many class scores are ImageNet's; `names` of the classes, if known, must fit."""
    if count not in (CLASSES, WITH_BACKGROUND):
        return False
    name = (names or {}).get(_KNOWN_PLACE + count - CLASSES, "")
    return not name or name.startswith("LABEL_") or _KNOWN_NAME in name.lower()


def material_beliefs(scores: Floats) -> Floats:
    """Turn class scores (N, 1000 or 1001), before softmax, into beliefs (N, C + 1).

    The last column is the belief in classes that have no material.
    """
    logits = scores[:, -CLASSES:].astype(np.float64)
    powers = np.exp(logits - logits.max(axis=1, keepdims=True))
    beliefs = (powers / powers.sum(axis=1, keepdims=True)) @ material_weights()
    return np.column_stack([beliefs, np.clip(1.0 - beliefs.sum(axis=1), 0.0, 1.0)]).astype("f4")
