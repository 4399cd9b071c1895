"""From embeddings to references, a linear layer and a calibration. Pure; knows no files.

Every cell (one class of one source) gives equally many references, however many pictures it has, so
that the largest source does not become the material; for the same reason it counts alike in the
linear layer, and classes alike beside each other.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import product

import numpy as np
from numpy.typing import NDArray

from hapticvlm.materials import UNKNOWN
from hapticvlm.vision.galleries.gallery import (
    Calibration,
    Gallery,
    LinearLayer,
    Pictures,
    log_softmax,
)
from hapticvlm.vision.galleries.network_gallery import fit_layer

Floats = NDArray[np.float32]
Doubles = NDArray[np.float64]
Indices = NDArray[np.int64]

CENTRES = 10  # references per cell
ROUNDS = 25
SHARPNESS = 32.0  # of the shipped references; the fits of every encoder so far chose it
PENALTIES = (0.001, 0.003, 0.01, 0.03)  # of the squared weights of the linear layer
WEIGHTS = (0.0, 0.25, 0.5, 1.0)  # of the references beside the layer
FACTORS = (0.0, 0.3, 1.0)  # of that weight for photographs
_CHOICES: tuple[tuple[Pictures, str, tuple[float, ...]], ...] = (
    ("renders", "weight", WEIGHTS),
    ("photographs", "photographs_weight", FACTORS),
)
SCALES = tuple(np.geomspace(0.1, 4.0, 23).tolist())
FOUR = ("wood", "glass", "fabric", "metal")
ALL_KNOWN = Calibration(SHARPNESS, 1.0, -1000.0)  # unknown is a class of its own, so p(known) is 1


@dataclass(frozen=True, slots=True)
class Judged:
    """Pictures of one kind that taught nothing: embeddings (N, D), truth (N,) names.

    `source` names where they come from: what comes from there must not teach while they judge.
    """

    pictures: Pictures
    source: str
    embeddings: Floats
    truth: NDArray[np.str_]


@dataclass(frozen=True, slots=True)
class Taught:
    """What teaches: embeddings (N, D), labels and cells (N,), and the source (N,) of each."""

    embeddings: Floats
    labels: Indices
    cells: Indices
    sources: NDArray[np.str_]

    def without(self, source: str) -> Taught:
        """Leave out a source."""
        kept = self.sources != source
        return Taught(
            self.embeddings[kept], self.labels[kept], self.cells[kept], self.sources[kept]
        )


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


def weigh(labels: Indices, cells: Indices) -> Doubles:
    """Weights (N,), which sum to 1, by which classes count alike, and so do cells within one."""
    weights = np.zeros(len(labels))
    for cell in np.unique(cells):
        weights[cells == cell] = 1.0 / (cells == cell).sum()
    for label in np.unique(labels):
        weights[labels == label] /= weights[labels == label].sum()
    return np.asarray(weights / weights.sum())


def fit_gallery(plain: Gallery, taught: Taught, judged: Sequence[Judged]) -> Gallery:
    """Add a linear layer to references and calibrate both on pictures that taught nothing.

    Penalty, and weight and scale for each kind of picture, are chosen by the mean surprise with
    four candidates and with all. The source of the judged pictures is left out of the layer
    meanwhile, since a user's scene is of no source that taught either.
    """
    best, least = (PENALTIES[0], ALL_KNOWN), np.inf
    for penalty in PENALTIES:
        layers = {
            held_out.source: _layer(taught.without(held_out.source), penalty) for held_out in judged
        }
        calibration, total = ALL_KNOWN, 0.0
        for kind, name, choices in _CHOICES:
            of_kind = [
                (replace(plain, layer=layers[held_out.source], pictures=kind), held_out)
                for held_out in judged
                if held_out.pictures == kind
            ]
            if of_kind:
                trials = [replace(calibration, **{name: value}) for value in choices]
                found = [_scaled(trial, kind, of_kind) for trial in trials]
                calibration, surprised = min(found, key=lambda item: item[1])
                total += surprised
        if total < least:
            best, least = (penalty, calibration), total
    return replace(plain, layer=_layer(taught, best[0]), calibration=best[1])


def _layer(taught: Taught, penalty: float) -> LinearLayer:
    weights = weigh(taught.labels, taught.cells)
    return fit_layer(taught.embeddings, taught.labels, weights, penalty)


def surprise(gallery: Gallery, judged: Judged, scale: float, among: Sequence[str]) -> float:
    """Return the mean surprise over the classes of `among`, at this scale of the logits."""
    rows = np.isin(judged.truth, among)
    names = [name for name in gallery.materials if name in among]
    logits = gallery.shipped_logits(judged.embeddings[rows], names)
    logs = log_softmax(scale / gallery.calibration.scale(gallery.pictures) * logits)
    truth = np.array([names.index(name) for name in judged.truth[rows]])
    right = logs[np.arange(len(truth)), truth]
    return -float(np.mean([right[truth == value].mean() for value in np.unique(truth)]))


def _best_scale(gallery: Gallery, judged: Judged) -> tuple[float, float]:
    found = [
        (scale, surprise(gallery, judged, scale, FOUR) + surprise(gallery, judged, scale, names))
        for scale, names in product(SCALES, [(*gallery.candidates, UNKNOWN)])
    ]
    return min(found, key=lambda item: item[1])


def _scaled(
    trial: Calibration, kind: Pictures, judged: Sequence[tuple[Gallery, Judged]]
) -> tuple[Calibration, float]:
    """Return the geometric mean of the best scales of the sources of a kind; and their surprise."""
    found = [
        _best_scale(replace(gallery, calibration=trial), held_out) for gallery, held_out in judged
    ]
    scale = float(np.exp(np.mean([np.log(scale) for scale, _ in found])))
    scaled = replace(trial, photographs=scale)
    if kind == "renders":
        scaled = replace(scaled, renders=scale)
    return scaled, float(np.mean([surprised for _, surprised in found]))


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
