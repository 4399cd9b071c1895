"""The pool as training reads it: crops stay on disk, the teachers' answers become targets.

A target is what is left of a teacher's feature in a whitened basis of DIRECTIONS directions, fitted
once per run on the first shards; the names' belief is what the 1,000 class scores of both teachers
say of materials.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from hapticvlm import materials
from hapticvlm.vision.encoders.imagenet import material_weights
from hapticvlm_lab.training import sources
from hapticvlm_lab.training.pool import ANSWERS, CROPS
from hapticvlm_lab.training.teacher import FILES

DIRECTIONS = 256
WHITENING = 0.25  # power of the eigenvalues: between none (0) and full (0.5)
SHARDS_FOR_BASIS = 14
TEMPERATURE = (
    1.0  # of the teachers' class scores: at 2 the belief of the names is hardly any (LOG.md)
)
LEFT_OUT = 25  # one in so many rows of a shard is never learned from
LABELLED_OFTENER = 1.3
RENDERED, RENDERED_OFTENER = 0.4, 3.0  # most share of a batch; how much above the pool's own share
CLASSES = (*materials.MATERIALS, materials.UNKNOWN)
BASIS = "basis.npz"
NOBODY_KNOWS = -1

Floats = NDArray[np.float32]


@dataclass(frozen=True, slots=True)
class Targets:
    """What N crops should give: unit directions (N, D) of each teacher, beliefs, classes (N,)."""

    directions: dict[str, Floats]
    names: Floats
    classes: NDArray[np.int64]


class Pool:
    """Every shard there is; `refresh` reads the ones that have been added since."""

    def __init__(self, folder: Path, run: Path) -> None:
        self._folder, self._run = folder, run
        self._weights = with_rest(material_weights())
        self._seen: set[str] = set()
        self._crops: list[NDArray[np.uint8]] = []
        self._targets: list[Targets] = []
        self._places: list[NDArray[np.int64]] = []
        self._rendered: list[NDArray[np.bool_]] = []
        self.refresh()

    @property
    def names(self) -> int:
        """Columns of a belief of the names: the materials and all the rest."""
        return int(self._weights.shape[1])

    def refresh(self) -> int:
        """Read new shards; return how many crops there are."""
        paths = sorted(self._folder.glob(f"*{ANSWERS}"))
        new = [path for path in paths if path.name not in self._seen and ".part" not in path.name]
        if not self._seen and not new:
            raise FileNotFoundError(f"{self._folder} holds no shard: run the pool first")
        basis = self._basis(new)
        for path in new:
            self._read_shard(path, basis)
        if new:
            self._index()
        return len(self._place)

    def draw(self, count: int, rng: np.random.Generator) -> NDArray[np.int64]:
        """Draw rows to learn from."""
        found = np.searchsorted(self._cumulated, rng.random(count))
        return self._taught[np.minimum(found, len(self._taught) - 1)]

    @property
    def left_out(self) -> NDArray[np.int64]:
        """Rows that are never learned from."""
        return self._left_out

    def crops(self, rows: NDArray[np.int64]) -> NDArray[np.uint8]:
        """Read crops: (N, S, S, 4) uint8."""
        return np.stack([self._crops[shard][row] for shard, row in self._place[rows].tolist()])

    def targets(self, rows: NDArray[np.int64]) -> Targets:
        """Return the targets of rows."""
        every = self._every
        directions = {name: every.directions[name][rows] for name in every.directions}
        return Targets(directions, every.names[rows], every.classes[rows])

    def _basis(self, new: list[Path]) -> dict[str, tuple[Floats, Floats]]:
        path = self._run / BASIS
        if not path.exists():
            shards = [np.load(shard) for shard in new[:SHARDS_FOR_BASIS]]
            found = {}
            for name in FILES:
                features = np.concatenate([shard[f"features_{name}"] for shard in shards])
                found[f"{name}_mean"], found[f"{name}_axes"] = fit_basis(features)
            np.savez(path, **found)  # type: ignore[arg-type]
        with np.load(path) as file:
            return {name: (file[f"{name}_mean"], file[f"{name}_axes"]) for name in FILES}

    def _read_shard(self, path: Path, basis: dict[str, tuple[Floats, Floats]]) -> None:
        number = len(self._crops)
        with np.load(path, allow_pickle=False) as file:
            labels, named = file["label"].tolist(), file["source"].tolist()
            directions = {
                name: directions_of(file[f"features_{name}"], *basis[name]) for name in FILES
            }
            beliefs = np.mean([soften(file[f"scores_{name}"]) for name in FILES], axis=0)
        known = [CLASSES.index(label) if label in CLASSES else NOBODY_KNOWS for label in labels]
        rows = np.arange(len(labels))
        self._targets.append(
            Targets(directions, np.asarray(beliefs @ self._weights, np.float32), np.array(known))
        )
        self._places.append(np.stack([np.full(len(rows), number), rows], axis=1))
        self._rendered.append(np.array([source in sources.RENDERED for source in named]))
        crops = path.with_name(path.name.replace(ANSWERS, CROPS))
        self._crops.append(np.load(crops, mmap_mode="r"))
        self._seen.add(path.name)

    def _index(self) -> None:
        self._place = np.concatenate(self._places)
        rendered = np.concatenate(self._rendered)
        self._every = Targets(
            {name: np.concatenate([t.directions[name] for t in self._targets]) for name in FILES},
            np.concatenate([t.names for t in self._targets]),
            np.concatenate([t.classes for t in self._targets]),
        )
        is_left_out = self._place[:, 1] % LEFT_OUT == 0
        self._left_out, self._taught = np.flatnonzero(is_left_out), np.flatnonzero(~is_left_out)
        weights = np.where(self._every.classes >= 0, LABELLED_OFTENER, 1.0)[self._taught]
        self._cumulated = np.cumsum(share_out(weights, rendered[self._taught]))


def share_out(weights: NDArray[np.float64], rendered: NDArray[np.bool_]) -> NDArray[np.float64]:
    """Scale (N,) weights so that they sum to 1 and renders get their share of a batch."""
    weights = weights / weights.sum()
    if rendered.any() and not rendered.all():
        share = min(RENDERED, RENDERED_OFTENER * rendered.mean())
        weights[rendered] *= share / weights[rendered].sum()
        weights[~rendered] *= (1.0 - share) / weights[~rendered].sum()
    return weights


def fit_basis(features: NDArray[np.float16]) -> tuple[Floats, Floats]:
    """Fit the mean (F,) and the whitening axes (F, DIRECTIONS) of unit features (N, F)."""
    unit = to_unit(features)
    mean = unit.mean(axis=0)
    values, vectors = np.linalg.eigh(np.cov((unit - mean).T))
    order = np.argsort(-values)[:DIRECTIONS]
    scale = np.maximum(values[order], 1e-12) ** -WHITENING
    return mean, (vectors[:, order] * scale).astype(np.float32)


def directions_of(features: NDArray[np.float16], mean: Floats, axes: Floats) -> Floats:
    """Turn features (N, F) into unit directions (N, DIRECTIONS)."""
    return to_unit((to_unit(features) - mean) @ axes)


def soften(scores: NDArray[np.float16]) -> Floats:
    """Turn class scores (N, 1000) into probabilities at TEMPERATURE."""
    powers = scores.astype(np.float32) / TEMPERATURE
    powers = np.exp(powers - powers.max(axis=1, keepdims=True))
    return np.asarray(powers / powers.sum(axis=1, keepdims=True))


def with_rest(weights: Floats) -> Floats:
    """Add to (1000, C) weights a column of what no material claims: (1000, C + 1)."""
    return np.column_stack([weights, 1.0 - weights.sum(axis=1)]).astype(np.float32)


def to_unit(rows: NDArray[np.floating]) -> Floats:
    """Scale (N, D) rows to unit length."""
    long = rows.astype(np.float32)
    return np.asarray(long / np.maximum(np.linalg.norm(long, axis=1, keepdims=True), 1e-9))
