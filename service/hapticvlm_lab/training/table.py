"""All training pictures in memory, and balanced draws from them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from hapticvlm import materials
from hapticvlm_lab.training import shards, sources

CLASSES = (*materials.MATERIALS, materials.UNKNOWN)
NOBODY_KNOWS = -1
TARGET = 256  # directions of the teacher's feature that the student is to reproduce
WHITENING = 0.25  # exponent: 0 keeps the teacher's spread over its directions, 0.5 evens it out


@dataclass(frozen=True, slots=True)
class Table:
    """crops (N, S, S, 4) uint8 RGB and mask, labels (N,) index into CLASSES or NOBODY_KNOWS.

    cells (N,) number the groups "one class of one source", which are drawn equally often; targets
    (N, TARGET) float32 unit rows from the teacher, instances (N,) the picture or material sample.
    """

    crops: NDArray[np.uint8]
    labels: NDArray[np.int64]
    cells: NDArray[np.int64]
    targets: NDArray[np.float32]
    instances: NDArray[np.int64]
    names: tuple[str, ...]


def load(folders: Sequence[Path], basis_file: Path) -> Table:
    """Read all shards of some folders that the teacher has described.

    The teacher's directions are read from `basis_file`, or found and written there.
    """
    found = [path for path in shards.paths(folders) if shards.features_path(path).exists()]
    parts = [shards.read_framed(path) for path in found]
    features = np.concatenate([np.load(shards.features_path(path)) for path in found])
    labels = np.concatenate([part.labels for part in parts])
    kinds = np.concatenate(
        [
            part.kinds
            if path.parent.name == "crops"
            else np.full(len(part.labels), path.parent.name)
            for path, part in zip(found, parts, strict=True)
        ]
    )
    kept = ~np.isin(kinds, sources.CALIBRATION)
    keys = np.char.add(np.char.add(kinds, "/"), labels)[kept]
    names, cells = np.unique(keys, return_inverse=True)
    index = {name: number for number, name in enumerate(CLASSES)}
    crops = np.empty((len(labels), *parts[0].images.shape[1:3], 4), np.uint8)
    at = 0
    while parts:
        part = parts.pop(0)
        crops[at : at + len(part.labels), ..., :3] = part.images
        crops[at : at + len(part.labels), ..., 3] = part.masks
        at += len(part.labels)
    instances = np.concatenate([_instances(path) for path in found])
    return Table(
        crops[kept],
        np.array([index.get(label, NOBODY_KNOWS) for label in labels[kept].tolist()], np.int64),
        cells.astype(np.int64),
        _basis(basis_file, features).targets(features[kept]),
        instances[kept],
        tuple(names.tolist()),
    )


def _instances(path: Path) -> NDArray[np.int64]:
    with np.load(path) as file:
        return np.asarray(file["instances"], np.int64)


def _basis(path: Path, features: NDArray[np.float16]) -> Basis:
    if not path.exists():
        found = Basis.of(features)
        np.savez(path, mean=found.mean, axes=found.axes)
    with np.load(path) as file:
        return Basis(file["mean"], file["axes"])


@dataclass(frozen=True, slots=True)
class Basis:
    """The teacher's principal directions: mean (1280,), axes (1280, TARGET)."""

    mean: NDArray[np.float32]
    axes: NDArray[np.float32]

    @classmethod
    def of(cls, features: NDArray[np.float16]) -> Basis:
        """Find the directions of (N, 1280) features."""
        unit = _unit(features[:: max(1, len(features) // 20000)].astype(np.float32))
        mean = unit.mean(axis=0)
        roots, axes = np.linalg.eigh(np.cov((unit - mean).T))
        best = np.argsort(-roots)[:TARGET]
        scaled = axes[:, best] * np.maximum(roots[best], 1e-12) ** -WHITENING
        return cls(mean.astype(np.float32), scaled.astype(np.float32))

    def targets(self, features: NDArray[np.float16]) -> NDArray[np.float32]:
        """Map (N, 1280) features to (N, TARGET) unit rows."""
        return _unit((_unit(features.astype(np.float32)) - self.mean) @ self.axes)


class Draws:
    """Draws batches: a share of pictures nobody labelled, the rest evenly over the cells."""

    def __init__(self, table: Table, unlabelled: float, seed: int) -> None:
        self._rng = np.random.default_rng(seed)
        self._share = unlabelled
        known = np.unique(table.cells[table.labels != NOBODY_KNOWS])
        self._cells = [np.flatnonzero(table.cells == cell) for cell in known]
        self._weights = _weights([table.names[cell] for cell in known])
        self._open = np.flatnonzero(table.labels == NOBODY_KNOWS)

    def batch(self, size: int) -> NDArray[np.int64]:
        """Draw `size` rows of the table."""
        unlabelled = int(size * self._share) if self._open.size else 0
        cells = self._rng.choice(len(self._cells), size - unlabelled, p=self._weights)
        rows = [int(self._rng.choice(self._cells[cell])) for cell in cells]
        return np.concatenate([self._rng.choice(self._open, unlabelled), rows]).astype(np.int64)


# wood, glass, fabric and metal come first in what the service promises.
_FOUR = ("wood", "glass", "fabric", "metal")


def _weights(names: Sequence[str]) -> NDArray[np.float64]:
    """Weigh cells: renders of a class as much as three photographed sources of it."""
    weights = np.array(
        [
            (2.0 if name.split("/")[1] in _FOUR else 1.0)
            * (3.0 if name.startswith("render") else 1.0)
            for name in names
        ]
    )
    return np.asarray(weights / weights.sum())


def _unit(rows: NDArray[np.floating]) -> NDArray[np.float32]:
    norms = np.linalg.norm(rows, axis=1, keepdims=True)
    return np.asarray(rows / np.maximum(norms, 1e-6), np.float32)
