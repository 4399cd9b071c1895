"""What the 1,000 classes of ImageNet are usually made of: class scores read as materials.

imagenet.csv names the classes, by their place in the common order (tench = 0), whose things are
mostly made of one of our materials, or of two alike. Written from general knowledge: our choice.
"""

from __future__ import annotations

import csv
from functools import lru_cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from hapticvlm import materials

CLASSES = 1000
TABLE = Path(__file__).with_name("imagenet.csv")


@lru_cache(maxsize=1)
def material_weights() -> NDArray[np.float32]:
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
