"""The joint embedding: features of a network, and the materials that its classes or words show.

A network that was trained to name things knows more than its features show a linear layer. Its
beliefs in the materials are p, which sum to 1 with the rest. The joint embedding is

    sqrt(1 - s) f,  sqrt(s / n) (1 + log(p + e) / |log e|),  r

with unit features f, the share s, the n = BELIEFS levels, each 0 to 1, and r >= 0 such that the
whole has unit norm. A linear layer can read log p off it, and whatever compares embeddings
compares both parts. numpy only.

The beliefs of the 1,000 classes of ImageNet are read from imagenet.csv: the classes, by their place
in the common order (tench = 0), whose things are mostly made of one of our materials, or of two
alike. Written from general knowledge: our choice.
"""

from __future__ import annotations

import csv
import math
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
BELIEFS = len(materials.MATERIALS) + 1  # the materials in the order of their table, and the rest
ADDED = BELIEFS + 1  # numbers that an embedding has beyond its features: the levels, and r
SHARE = 0.5  # s: both parts alike, our choice
FLOOR = 1e-3  # e: less belief than this is no evidence, our choice
_SHORTEST = 1e-12
SCALE = math.sqrt(SHARE / BELIEFS) / -math.log(FLOOR)  # of log p in the embedding


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


def join(features: Floats, beliefs: Floats | None) -> Floats:
    """Join features (N, F) and beliefs (N, BELIEFS) to embeddings of unit norm.

    Without beliefs the features alone are the embedding: (N, F), else (N, F + ADDED).
    """
    nowhere = 1.0 / math.sqrt(features.shape[1])  # features of 0 (nothing found) point nowhere
    norms = np.linalg.norm(features, axis=1, keepdims=True)
    unit = np.where(norms > _SHORTEST, features / np.maximum(norms, _SHORTEST), nowhere)
    if beliefs is None:
        return np.asarray(unit, np.float32)
    # Beliefs enter as logarithms, so that a linear layer behind can multiply them by its own (a
    # product of probabilities), and shifted to be positive. The last number fills up what is
    # missing to the length of SHARE: with it every embedding is of unit norm and cosines keep their
    # meaning.
    logs = np.log(np.clip(beliefs.astype(np.float64), 0.0, 1.0 - FLOOR) + FLOOR)
    levels = SCALE * (logs - math.log(FLOOR))
    rest = np.sqrt(np.maximum(SHARE - (levels**2).sum(axis=1, keepdims=True), 0.0))
    parts = [math.sqrt(1.0 - SHARE) * unit, levels, rest]
    return np.concatenate(parts, axis=1).astype(np.float32)


def features_of(embeddings: Floats) -> Floats:
    """Return the unit features (N, F) of joined embeddings."""
    return np.asarray(embeddings[:, :-ADDED] / math.sqrt(1.0 - SHARE), np.float32)


def log_beliefs(embeddings: Floats) -> Floats:
    """Return log(p + e) of joined embeddings: (N, BELIEFS)."""
    return np.asarray(embeddings[:, -ADDED:-1] / SCALE + math.log(FLOOR), np.float32)


def layer_of(weights: Floats, exponent: float) -> Floats:
    """Return weights that give features @ weights + exponent log(p + e), but for a constant.

    weights (F, BELIEFS) of unit features; returns (F + ADDED, BELIEFS).
    """
    reading = np.eye(BELIEFS, dtype=np.float32) * np.float32(exponent / SCALE)
    nothing = np.zeros((1, BELIEFS), np.float32)
    return np.vstack([weights / np.float32(math.sqrt(1.0 - SHARE)), reading, nothing])
