"""From embeddings to references and a calibration. Pure numpy; knows no files.

Every cell (one class of one source) gives equally many references, however many pictures it has, so
that the largest source does not become the material.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hapticvlm.recognition.galleries.calibration import least_surprising, surprise
from hapticvlm.recognition.galleries.gallery import Calibration, believe, score

Floats = NDArray[np.float32]
Doubles = NDArray[np.float64]
Indices = NDArray[np.int64]

CENTRES = 10  # references per cell
STRANGERS = 0.2  # share of what a hand touches that is none of our materials: our choice
ROUNDS = 25


@dataclass(frozen=True, slots=True)
class Judged:
    """Embeddings (N, D) with truth (N,), an index of the gallery's materials or -1: none of them.

    weights (N,) sum to 1 per source; `more` are references (R, D) with labels (R,) that count for
    these pictures beside the gallery's: what a user would have enrolled.
    """

    embeddings: Floats
    truth: Indices
    weights: Doubles
    more: tuple[Floats, Indices] | None = None

    def scores(self, references: Floats, labels: Indices, sharpness: float) -> Doubles:
        """Score these pictures against the gallery's references and their own: (N, C)."""
        if self.more is not None:
            references = np.concatenate([references, self.more[0]])
            labels = np.concatenate([labels, self.more[1]])
        return score(self.embeddings, references, labels, sharpness)


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
    """Weigh judged pictures: each class alike, and "none of ours" STRANGERS of the whole."""
    weights = np.zeros(len(truth))
    known = np.unique(truth[truth >= 0])
    for value in known:
        weights[truth == value] = (1.0 - STRANGERS) / len(known) / (truth == value).sum()
    if (truth < 0).any():
        weights[truth < 0] = STRANGERS / (truth < 0).sum()
    return np.asarray(weights / weights.sum())


def fit_calibration(
    judged: Sequence[Judged], references: Floats, labels: Indices, classes: int
) -> Calibration:
    """Choose the parameters under which the judged pictures are least surprising.

    `classes` of the labels are materials; labels from there on are references of none of them.
    """

    def surprise_at(sharpness: float) -> Callable[[Calibration], float]:
        scores = [one.scores(references, labels, sharpness) for one in judged]
        return lambda trial: sum(
            surprise(believe(s, trial)[:, :classes], one.truth, one.weights, classes)
            for one, s in zip(judged, scores, strict=True)
        )

    return least_surprising(surprise_at)


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
