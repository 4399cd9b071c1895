"""References of a gallery: the centres of what teaches, as many of every class of every source."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

CENTRES = 5  # of a cell, one class of one source
ROUNDS = 25
FEW = 8  # pictures that a centre stands for at least

Floats = NDArray[np.float32]
Doubles = NDArray[np.float64]
Indices = NDArray[np.int64]


def choose_references(
    embeddings: Floats, labels: Indices, cells: Indices, seed: int
) -> tuple[Floats, Indices]:
    """Take CENTRES k-means centres of every cell: (R, D) unit float32 and (R,) labels."""
    references = []
    found = []
    for cell in np.unique(cells):
        rows = cells == cell
        centres = _centres(embeddings[rows].astype(np.float64), seed)
        references.append(centres / np.linalg.norm(centres, axis=1, keepdims=True))
        found += [int(labels[rows][0])] * len(centres)
    order = np.argsort(found, kind="stable")
    return np.concatenate(references)[order].astype(np.float32), np.array(found, np.int64)[order]


def _centres(points: Doubles, seed: int) -> Doubles:
    rng = np.random.default_rng(seed)
    count = min(CENTRES, max(1, len(points) // FEW))
    centres = points[rng.choice(len(points), count, replace=False)]
    for _ in range(ROUNDS):
        nearest = (points @ centres.T - (centres**2).sum(axis=1) / 2).argmax(axis=1)
        groups = [points[nearest == k] for k in range(count)]
        centres = np.stack(
            [g.mean(axis=0) if len(g) else c for g, c in zip(groups, centres, strict=True)]
        )
    return centres
