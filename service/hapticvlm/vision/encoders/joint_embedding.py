"""Joins a network's features with the beliefs in materials that its classes or words imply.

A classifier, or a network of pictures and text, knows more about a picture than a linear layer can
read off its features. Let p be the beliefs in the materials that its class scores or words imply,
one more for everything else, which together sum to 1. The joint embedding is

    sqrt(1 - s) f,  sqrt(s / n) (1 + log(p + e) / |log e|),  r

with unit features f, the share s, the n = BELIEFS levels, each 0 to 1, and r >= 0 chosen such that
the whole has unit norm. A linear layer can read log p off it, and a cosine of two embeddings
compares both parts.

imagenet.csv assigns materials to those of ImageNet's 1,000 classes (by their place in the common
order, tench = 0) whose objects are mostly made of one of our materials, or equally of two. It was
written from general knowledge: our choice.
"""

from __future__ import annotations

import csv
import math
from collections.abc import Mapping
from functools import lru_cache
from pathlib import Path

import numpy as np

from hapticvlm import materials
from hapticvlm.vision.encoders.encoder import Floats

CLASSES = 1000
WITH_BACKGROUND = 1001  # some networks have a class "background" before the others
TABLE = Path(__file__).with_name("imagenet.csv")
_KNOWN_PLACE = 398
_KNOWN_NAME = "abacus"
BELIEFS = len(materials.MATERIALS) + 1  # the materials in the order of their table, then the rest
ADDED = BELIEFS + 1  # further numbers of an embedding beside its features: the levels, and r
SHARE = 0.5  # s: both parts count equally, our choice
FLOOR = 1e-3  # e: less belief than this is no evidence, our choice
_SHORTEST = 1e-12
SCALE = math.sqrt(SHARE / BELIEFS) / -math.log(FLOOR)  # of log p in the embedding


@lru_cache(maxsize=1)
def material_weights() -> Floats:
    """Return the share of each material in each class: (1000, C), rows that sum to 1 or to 0."""
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
    """Whether `count` class scores are ImageNet's; `names` of the classes, if known, must agree."""
    if count not in (CLASSES, WITH_BACKGROUND):
        return False
    name = (names or {}).get(_KNOWN_PLACE + count - CLASSES, "")
    return not name or name.startswith("LABEL_") or _KNOWN_NAME in name.lower()


def material_beliefs(scores: Floats) -> Floats:
    """Turn class scores (N, 1000 or 1001), before softmax, into beliefs (N, BELIEFS).

    The last column is the belief in classes that have no material. A leading background class is
    left out.
    """
    logits = scores[:, -CLASSES:].astype(np.float64)
    powers = np.exp(logits - logits.max(axis=1, keepdims=True))
    beliefs = (powers / powers.sum(axis=1, keepdims=True)) @ material_weights()
    return np.column_stack([beliefs, np.clip(1.0 - beliefs.sum(axis=1), 0.0, 1.0)]).astype("f4")


def join(features: Floats, beliefs: Floats | None) -> Floats:
    """Join features (N, F) and beliefs (N, BELIEFS) to embeddings of unit norm.

    Without beliefs the features alone are the embedding: (N, F), else (N, F + ADDED). Features that
    are not finite give embeddings that are not, which embed_all refuses.
    """
    nowhere = 1.0 / math.sqrt(features.shape[1])  # for features that are all 0: no direction
    norms = np.linalg.norm(features, axis=1, keepdims=True)
    with np.errstate(invalid="ignore"):  # infinity over infinity
        unit = np.where(norms <= _SHORTEST, nowhere, features / np.maximum(norms, _SHORTEST))
    if beliefs is None:
        return np.asarray(unit, np.float32)
    # Beliefs enter as logarithms, because a linear layer that adds logarithms multiplies its own
    # beliefs by them. They are shifted to be positive. The last number completes the part to the
    # length sqrt(SHARE), so that every embedding has unit norm and cosines keep their meaning.
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
    """Return weights of joined embeddings that give f @ weights + exponent log(p + e) + constant.

    weights: (F, BELIEFS), of the unit features f; returns (F + ADDED, BELIEFS).
    """
    reading = np.eye(BELIEFS, dtype=np.float32) * np.float32(exponent / SCALE)
    nothing = np.zeros((1, BELIEFS), np.float32)
    return np.vstack([weights / np.float32(math.sqrt(1.0 - SHARE)), reading, nothing])
