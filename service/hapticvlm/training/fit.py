"""From embeddings to references and a calibration. Pure numpy; knows no files.

Every cell (one class of one source) gives equally many references, however many pictures it has, so
that the largest source does not become the material.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hapticvlm.recognition.gallery import Calibration, believe, score

Floats = NDArray[np.float32]
Doubles = NDArray[np.float64]
Indices = NDArray[np.int64]

CENTRES = 10  # references per cell
SHARPNESSES = (4.0, 6.0, 8.0, 11.0, 14.0, 18.0, 24.0, 32.0)
SLOPES = (0.0, 2.0, 4.0, 8.0, 16.0, 32.0)
THRESHOLDS = tuple(np.arange(-0.6, 1.01, 0.1).tolist())
ROUNDS = 25


@dataclass(frozen=True, slots=True)
class Judged:
    """Embeddings (N, D) with truth (N,), an index of the gallery's materials or -1: none of them.

    weights (N,) sum to 1 per source.
    """

    embeddings: Floats
    truth: Indices
    weights: Doubles


def choose_references(
    embeddings: Floats, labels: Indices, cells: Indices, seed: int
) -> tuple[Floats, Indices]:
    """Take CENTRES k-means centres of every cell: (R, D) unit float32 and (R,) labels."""
    references, found = [], []
    for cell in np.unique(cells):
        rows = cells == cell
        centres = _centres(embeddings[rows].astype(np.float64), seed)
        references.append(centres / np.linalg.norm(centres, axis=1, keepdims=True))
        found += [int(labels[rows][0])] * len(centres)
    order = np.argsort(found, kind="stable")
    return np.concatenate(references)[order].astype(np.float32), np.array(found, np.int64)[order]


def weigh(truth: Indices) -> Doubles:
    """Weigh judged pictures: each class alike, and "none of ours" as much as all classes."""
    weights = np.zeros(len(truth))
    known = np.unique(truth[truth >= 0])
    for value in known:
        weights[truth == value] = 1.0 / len(known) / (truth == value).sum()
    if (truth < 0).any():
        weights[truth < 0] = 1.0 / (truth < 0).sum()
    return np.asarray(weights / weights.sum())


def fit_calibration(
    judged: Sequence[Judged], references: Floats, labels: Indices, classes: int
) -> Calibration:
    """Choose the parameters under which the judged pictures are least surprising.

    `classes` of the labels are materials; labels from there on are references of none of them.
    """
    best, least = Calibration(SHARPNESSES[0], 0.0, 0.0), np.inf
    for sharpness in SHARPNESSES:
        scores = [score(one.embeddings, references, labels, sharpness) for one in judged]
        for slope in SLOPES:
            for threshold in THRESHOLDS:
                trial = Calibration(sharpness, slope, threshold)
                loss = sum(
                    surprise(believe(s, trial)[:, :classes], one)
                    for one, s in zip(judged, scores, strict=True)
                )
                if loss < least:
                    best, least = trial, loss
    return best


def surprise(beliefs: Doubles, judged: Judged) -> float:
    """Weighted mean of the negative log probabilities; open mass counts evenly for every class."""
    open_mass = np.clip(1.0 - beliefs.sum(axis=1), 1e-3, 1.0)
    classes = beliefs.shape[1]
    named = beliefs[np.arange(len(beliefs)), np.maximum(judged.truth, 0)] + open_mass / classes
    right = np.where(judged.truth >= 0, named, open_mass)
    return float(-(judged.weights * np.log(np.maximum(right, 1e-4))).sum())


def _centres(points: Doubles, seed: int) -> Doubles:
    rng = np.random.default_rng(seed)
    count = min(CENTRES, max(1, len(points) // 8))
    centres = points[rng.choice(len(points), count, replace=False)]
    for _ in range(ROUNDS):
        nearest = (points @ centres.T - (centres**2).sum(axis=1) / 2).argmax(axis=1)
        groups = [points[nearest == k] for k in range(count)]
        centres = np.stack(
            [g.mean(axis=0) if len(g) else c for g, c in zip(groups, centres, strict=True)]
        )
    return centres
