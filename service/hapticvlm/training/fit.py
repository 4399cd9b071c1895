"""From descriptions to a projection, references and a calibration. Pure numpy; knows no files.

Every cell (one class of one source) weighs the same, however many pictures it has, so that the
largest source does not become the material.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hapticvlm.recognition.gallery import Calibration, believe, score
from hapticvlm.recognition.linear_encoder import LinearEncoder

Floats = NDArray[np.float32]
Doubles = NDArray[np.float64]

DIMENSION = 64
SHRINKAGE = 0.3  # of the noise scatter towards a multiple of the identity
SOURCE_SHIFT = 3.0  # weight of a class's spread between sources, against its spread within them
ACROSS = 0.1  # weight of the spread between classes over all sources, against within one source
PICTURES = 0.2  # how much telling pictures of one class apart counts: for enrolled objects
CENTRES = 12  # references per cell
SHARPNESSES = (4.0, 6.0, 8.0, 12.0, 16.0)
SLOPES = (0.0, 2.0, 4.0, 8.0, 16.0, 32.0)
THRESHOLDS = tuple(np.arange(-0.6, 1.01, 0.1).tolist())


@dataclass(frozen=True, slots=True)
class Table:
    """Descriptions (N, F) with material, source and picture of each row as (N,) arrays."""

    descriptions: Floats
    materials: NDArray[np.str_]
    sources: NDArray[np.str_]
    pictures: NDArray[np.str_]

    def rows(self, chosen: NDArray[np.bool_]) -> Table:
        """Keep the rows marked in a boolean (N,)."""
        return Table(
            self.descriptions[chosen],
            self.materials[chosen],
            self.sources[chosen],
            self.pictures[chosen],
        )

    def cells(self) -> dict[tuple[str, str], NDArray[np.bool_]]:
        """Rows of each (material, source), as boolean (N,)."""
        pairs = sorted(set(zip(self.materials.tolist(), self.sources.tolist(), strict=True)))
        return {(m, s): (self.materials == m) & (self.sources == s) for m, s in pairs}


def fit_projection(table: Table, name: str, side: int) -> LinearEncoder:
    """Find the linear map that tells materials apart in every source alike."""
    cells = table.cells()
    means = np.stack([table.descriptions[rows].mean(axis=0) for rows in cells.values()])
    centre = means.mean(axis=0)
    spread = [table.descriptions[rows].std(axis=0) ** 2 for rows in cells.values()]
    scale = np.sqrt(np.mean(spread, axis=0) + means.var(axis=0)) + 1e-4
    x = np.clip((table.descriptions - centre) / scale, -4, 4).astype(np.float64)
    signal, noise = _scatters(x, table, cells)
    width = noise.shape[0]
    noise = (1 - SHRINKAGE) * noise + SHRINKAGE * np.trace(noise) / width * np.eye(width)
    roots, axes = np.linalg.eigh(noise)
    whiten = axes / np.sqrt(roots)
    values, vectors = np.linalg.eigh(whiten.T @ signal @ whiten)
    best = np.argsort(-values)[:DIMENSION]
    projection = whiten @ vectors[:, best] * np.sqrt(np.maximum(values[best], 0.0)) ** 0.5
    signs = np.sign(projection[np.abs(projection).argmax(axis=0), np.arange(best.size)])
    arrays = (centre, scale, projection * signs)
    return LinearEncoder(name, side, *(array.astype(np.float32) for array in arrays))


def _scatters(
    x: Doubles, table: Table, cells: dict[tuple[str, str], NDArray[np.bool_]]
) -> tuple[Doubles, Doubles]:
    """Scatter to keep and to ignore, both (F, F).

    Kept is mostly what tells classes apart within one source: over all sources, a class that one
    source alone has would be told by that source's camera and light.
    """
    width = x.shape[1]
    within, pictures = np.zeros((width, width)), np.zeros((width, width))
    means = np.stack([x[rows].mean(axis=0) for rows in cells.values()])
    for rows, mean in zip(cells.values(), means, strict=True):
        part = x[rows]
        _, which = np.unique(table.pictures[rows], return_inverse=True)
        sizes = np.bincount(which)
        sums = np.zeros((sizes.size, width))
        np.add.at(sums, which, part)
        each = sums / sizes[:, None]
        inner, outer = part - each[which], each[which] - mean
        within += inner.T @ inner / len(part) / len(cells)
        pictures += outer.T @ outer / len(part) / len(cells)
    classes = np.array([material for material, _ in cells])
    sources = np.array([source for _, source in cells])
    between = np.cov(_group_means(means, classes).T, bias=True)
    shift = means - _group_means(means, classes)
    apart = means - _group_means(means, sources)
    signal = apart.T @ apart / len(means) + ACROSS * between + PICTURES * pictures
    return signal, within + pictures + SOURCE_SHIFT * shift.T @ shift / len(means)


def _group_means(values: Doubles, groups: NDArray[np.str_]) -> Doubles:
    """Replace every row by the mean of its group."""
    return np.stack([values[groups == group].mean(axis=0) for group in groups])


def choose_references(
    embeddings: Floats, table: Table, names: Sequence[str], seed: int
) -> tuple[Floats, NDArray[np.int64]]:
    """Take CENTRES k-means centres of every cell: (R, D) unit float32 and (R,) labels."""
    references, labels = [], []
    for (material, _), rows in table.cells().items():
        centres = _centres(embeddings[rows].astype(np.float64), seed)
        references.append(centres / np.linalg.norm(centres, axis=1, keepdims=True))
        labels += [names.index(material)] * len(centres)
    return np.concatenate(references).astype(np.float32), np.array(labels, np.int64)


def _centres(points: Doubles, seed: int) -> Doubles:
    rng = np.random.default_rng(seed)
    count = min(CENTRES, max(1, len(points) // 8))
    centres = points[rng.choice(len(points), count, replace=False)]
    for _ in range(25):
        nearest = (points @ centres.T - (centres**2).sum(axis=1) / 2).argmax(axis=1)
        groups = [points[nearest == k] for k in range(count)]
        centres = np.stack(
            [g.mean(axis=0) if len(g) else c for g, c in zip(groups, centres, strict=True)]
        )
    return centres


@dataclass(frozen=True, slots=True)
class Fold:
    """Embeddings of a source left out, what the others offer, and the truth (-1: not among it)."""

    embeddings: Floats
    references: Floats
    labels: NDArray[np.int64]
    truth: NDArray[np.int64]
    weights: Doubles


def fit_calibration(folds: Sequence[Fold], classes: int) -> Calibration:
    """Choose the parameters under which left-out sources are least surprising."""
    best, least = Calibration(SHARPNESSES[0], 0.0, 0.0), np.inf
    for sharpness in SHARPNESSES:
        scores = [score(f.embeddings, f.references, f.labels, sharpness) for f in folds]
        for slope in SLOPES:
            for threshold in THRESHOLDS:
                trial = Calibration(sharpness, slope, threshold)
                pairs = zip(folds, scores, strict=True)
                loss = sum(surprise(believe(s, trial), fold, classes) for fold, s in pairs)
                if loss < least:
                    best, least = trial, loss
    return best


def surprise(beliefs: Doubles, fold: Fold, classes: int) -> float:
    """Sum the weighted negative log probabilities; unknown mass counts evenly for every class."""
    unknown = np.clip(1.0 - beliefs.sum(axis=1), 1e-3, 1.0)
    named = beliefs[np.arange(len(beliefs)), np.maximum(fold.truth, 0)] + unknown / classes
    right = np.where(fold.truth >= 0, named, unknown)
    return float(-(fold.weights * np.log(np.maximum(right, 1e-4))).sum())
