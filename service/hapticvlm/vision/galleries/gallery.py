"""The gallery: an embedding's beliefs from references and a linear layer. Pure; reads no file.

A material's score is the soft maximum of the cosine similarities to its references,
s_c = log(mean_r exp(k x.r)) / k with sharpness k. Its logit adds a strongly regularised linear
layer, l_c = weight k s_c + W_c x + b_c, and its belief is

    p(known) softmax(scale l)_c,   p(known) = 1 / (1 + exp(-slope (max s - threshold))).

Renders and photographs have one scale. Own
references, a user's, are a gallery of their own with a calibration of their own; beside them the
shipped beliefs in the same materials count with the exponent `share`, and what they do not know is
left to the shipped gallery and all its materials. All numbers were fitted for one encoder.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from hapticvlm.evidence.ladder import FLOOR, Evidence
from hapticvlm.materials import UNKNOWN

Floats = NDArray[np.float32]
Doubles = NDArray[np.float64]
Indices = NDArray[np.int64]

SHIPPED_SHARE = 0.3  # exponent of the shipped beliefs beside own references, unless fitted
MAX_SHARPNESS = 64.0  # exp(64) still leaves room for the sum of any gallery in float32
_LEAST = 1e-30  # of the best reference's power: less counts as this much, so that logs stay finite


@dataclass(frozen=True, slots=True)
class Calibration:
    """What turns similarities into beliefs; see the head of this file."""

    sharpness: float
    slope: float
    threshold: float
    weight: float = 1.0
    scale: float = 1.0
    share: float = SHIPPED_SHARE


@dataclass(frozen=True, slots=True, eq=False)
class LinearLayer:
    """weights (D, C) float32 and bias (C,) of the materials of a gallery."""

    weights: Floats
    bias: Floats


@dataclass(frozen=True, slots=True, eq=False)
class Gallery:
    """References of several materials, made with one encoder; `own` are the user's beside them.

    references (R, D) float32 of unit norm, labels (R,) indices into `materials`, each of which has
    a reference. UNKNOWN may be one of them: its references show none of the others. `parents` name
    the class of each material that the shipped gallery does not have; `places` (R,) number the
    picture of a reference among those of its material, None where nobody knows.
    """

    encoder: str
    materials: tuple[str, ...]
    references: Floats
    labels: Indices
    calibration: Calibration
    layer: LinearLayer | None = None
    own: Gallery | None = None
    parents: Mapping[str, str] = field(default_factory=dict)
    places: Indices | None = None

    @property
    def candidates(self) -> tuple[str, ...]:
        """Every material that can be recognised, UNKNOWN left out, as `beliefs` has them."""
        user_materials = () if self.own is None else self.own.materials
        names = dict.fromkeys((*self.materials, *user_materials))
        return tuple(name for name in names if name != UNKNOWN)

    def match(self, embedding: Floats) -> Evidence:
        """Compare one (D,) embedding; what the beliefs lack to 1 is unknown."""
        if not self.materials or not np.isfinite(embedding @ embedding):
            return Evidence("encoder", ())
        beliefs = self.beliefs(embedding[None])[0]
        if not np.isfinite(beliefs).all():  # references that are not finite
            return Evidence("encoder", ())
        found = zip(self.candidates, beliefs.tolist(), strict=True)
        ranked = sorted(found, key=lambda item: -item[1])
        return Evidence("encoder", tuple(item for item in ranked if item[1] >= FLOOR))

    def beliefs(self, embeddings: Floats) -> Doubles:
        """Beliefs in the candidates, of (N, D) embeddings: (N, C); a row lacks unknown to 1."""
        scores = self.scores(embeddings)
        logits = self.calibration.scale * self._logits(embeddings, scores)
        if self.own is not None:
            return self._with_own(embeddings, logits)
        believed = known(scores, self.calibration)[:, None] * softmax(logits)
        return believed[:, [self.materials.index(name) for name in self.candidates]]

    def scores(self, embeddings: Floats) -> Doubles:
        """Soft-maximum similarities of (N, D) embeddings to `materials`: (N, C)."""
        blocks = _blocks(self)
        sharpness = self.calibration.sharpness
        # One product with all references in order of their material, then a sum for each stretch: a
        # gallery of thousands costs the same two calls of numpy as one of ten. The references are
        # put in order once for each gallery, which never changes (`_blocks`): user materials make a
        # new one.
        powers = np.exp(np.float32(sharpness) * (embeddings @ blocks.references.T))
        means = np.add.reduceat(powers, blocks.starts, axis=1) / blocks.counts
        return np.asarray(np.log(np.maximum(means.astype(np.float64), _LEAST)) / sharpness)

    def _logits(self, embeddings: Floats, scores: Doubles) -> Doubles:
        logits = self.calibration.weight * self.calibration.sharpness * scores
        if self.layer is not None:
            logits = logits + (embeddings @ self.layer.weights + self.layer.bias)
        return np.asarray(logits)

    def _with_own(self, embeddings: Floats, shipped: Doubles) -> Doubles:
        user_gallery = self.own
        assert user_gallery is not None
        scores = user_gallery.scores(embeddings)
        beside = log_softmax(self._columns(shipped, user_gallery.materials))
        logits = user_gallery._logits(embeddings, scores) + user_gallery.calibration.share * beside
        share = known(scores, user_gallery.calibration)[:, None]
        found = dict(zip(user_gallery.materials, (share * softmax(logits)).T, strict=True))
        for name, belief in zip(self.materials, ((1.0 - share) * softmax(shipped)).T, strict=True):
            # The own references answer with what they know (`share`), and the shipped gallery gets
            # what is left. So a user's three pictures of walnut can say walnut, and of a tin can
            # they say nothing: the shipped belief in metal stands.
            found[name] = found.get(name, 0.0) + belief
        return np.stack([found[name] for name in self.candidates], axis=1)

    def shipped_logits(self, embeddings: Floats, names: Sequence[str]) -> Doubles:
        """Logits (N, C) of these materials without the own references."""
        logits = self._logits(embeddings, self.scores(embeddings))
        return self._columns(self.calibration.scale * logits, names)

    def parent(self, name: str) -> str | None:
        """Return the material that represents this one: itself, its class, or None."""
        found = name if name in self.materials else self.parents.get(name)
        return found if found in self.materials else None

    def _columns(self, logits: Doubles, names: Sequence[str]) -> Doubles:
        """Pick the columns (N, C) of these materials; the mean of all where none represents it."""
        parents = [self.parent(name) for name in names]
        columns = [
            logits.mean(axis=1) if parent is None else logits[:, self.materials.index(parent)]
            for parent in parents
        ]
        return np.stack(columns, axis=1)


def known(scores: Doubles, calibration: Calibration) -> Doubles:
    """Belief that (N, C) scores belong to any of the materials: (N,)."""
    power = -calibration.slope * (scores.max(axis=1) - calibration.threshold)
    return np.asarray(1.0 / (1.0 + np.exp(np.minimum(power, 700.0))))


def softmax(logits: Doubles) -> Doubles:
    """Turn (N, C) logits into probabilities."""
    return np.asarray(np.exp(log_softmax(logits)))


def log_softmax(logits: Doubles) -> Doubles:
    """Turn (N, C) logits into log probabilities."""
    if not logits.shape[1]:
        return logits
    shifted = logits - logits.max(axis=1, keepdims=True)
    return np.asarray(shifted - np.log(np.exp(shifted).sum(axis=1, keepdims=True)))


@dataclass(frozen=True, slots=True)
class _Blocks:
    """References in order of material: where each material's begin, and how many there are."""

    references: Floats
    starts: Indices
    counts: Floats


@lru_cache(maxsize=4)
def _blocks(gallery: Gallery) -> _Blocks:
    order = np.argsort(gallery.labels, kind="stable")
    counts = np.bincount(gallery.labels, minlength=len(gallery.materials))
    starts = np.cumsum(counts) - counts
    references = np.ascontiguousarray(gallery.references[order], np.float32)
    return _Blocks(references, starts, counts.astype(np.float32))


def join(parts: Sequence[Gallery]) -> Gallery:
    """Join the references of galleries, as if enrolled together; the first one's calibration."""
    names = tuple(dict.fromkeys(name for part in parts for name in part.materials))
    labels = []
    places = []
    for number, part in enumerate(parts):
        labels.append(np.array([names.index(name) for name in part.materials])[part.labels])
        known = part.places if part.places is not None else np.arange(len(part.labels))
        places.append(known + number * 1_000_000)
    return Gallery(
        parts[0].encoder,
        names,
        np.concatenate([part.references for part in parts]),
        np.concatenate(labels).astype(np.int64),
        parts[0].calibration,
        places=np.concatenate(places).astype(np.int64),
    )
