"""Turns an embedding into beliefs in materials, by references and a linear layer. Pure.

Embeddings have unit norm, so the product x.r of an embedding and a reference is their cosine
similarity: 1 for the same direction, about 0 for unrelated pictures. A material's score is the soft
maximum of the similarities to its references,

    s_c = log(mean_r exp(k x.r)) / k,

which lies between their mean (sharpness k near 0) and the nearest reference (large k). The logit
adds a strongly regularised linear layer, l_c = weight k s_c + W_c x + b_c. The belief is

    p(known) softmax(scale l)_c,   p(known) = 1 / (1 + exp(-slope (max s - threshold))),

because a softmax alone would name a material for anything, however far from every reference; what
p(known) lacks to 1 is unknown. All constants were fitted for one encoder; renders and photographs
share them. Only pictures of flat colours (vision/flatness.py) have a layer and a scale of their
own, because the encoder is out of its depth there: `flat_layer` takes the place of the layer, and
the logits are multiplied by `flat` as well.

Texture maps (vision/textures.py) have a layer of their own too, without references: their belief is

    p(one) mean_w softmax(texture (W e_w + b))_c,   p(one) = 1 / (1 + exp(-even_slope (a - even))),

over the windows w of a map, with a the mean cosine of their embeddings: windows that differ show
more than one material.

User references are a second gallery with its own calibration (`Gallery.user`). Within the user's
materials the shipped beliefs count too, with the exponent `share`; the part of the belief that the
user references do not claim goes to the shipped gallery with all its materials.

In a gallery that a user built, a material whose parent has references there is its child and is not
a rival: the score of the family is the mean of its members' as powers, but at least the parent's,
and the softmax of the members divides what is believed of the family among them. So a family is
believed at least as much as its parent is without the child. Reads no file.
"""

from __future__ import annotations

import math
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

SHIPPED_SHARE = 0.3  # exponent of the shipped beliefs beside user references, unless fitted
MAX_SHARPNESS = 64.0  # exp(64) still leaves room for the sum of any gallery in float32
_LEAST = 1e-30  # least mean of powers, so that its logarithm stays finite


@dataclass(frozen=True, slots=True)
class Calibration:
    """The constants that turn similarities into beliefs; see the head of this file."""

    sharpness: float
    slope: float
    threshold: float
    weight: float = 1.0
    scale: float = 1.0
    share: float = SHIPPED_SHARE
    flat: float = 1.0
    texture: float = 1.0
    even_slope: float = 1.0
    even: float = -1000.0


@dataclass(frozen=True, slots=True, eq=False)
class LinearLayer:
    """weights (D, C) float32 and bias (C,) of the materials of a gallery."""

    weights: Floats
    bias: Floats


@dataclass(frozen=True, slots=True, eq=False)
class Gallery:
    """References of several materials, made with one encoder; `user` holds the user's.

    references: (R, D) float32 of unit norm. labels: (R,) indices into `materials`, each of which
    has a reference. UNKNOWN may be one of them: its references show none of the others. parents:
    the class of each material that the shipped gallery lacks. places: (R,), the number of the
    picture that a reference was made from, among those of its material; None if unknown.
    flat_layer: the layer for pictures of flat colours; None if `layer` serves them too.
    texture_layer: the layer for texture maps; None if none was taught, and maps are not read.
    """

    encoder: str
    materials: tuple[str, ...]
    references: Floats
    labels: Indices
    calibration: Calibration
    layer: LinearLayer | None = None
    user: Gallery | None = None
    parents: Mapping[str, str] = field(default_factory=dict)
    places: Indices | None = None
    flat_layer: LinearLayer | None = None
    texture_layer: LinearLayer | None = None

    @property
    def candidates(self) -> tuple[str, ...]:
        """Every material that can be recognised, without UNKNOWN, in the order of `beliefs`."""
        user_materials = () if self.user is None else self.user.materials
        names = dict.fromkeys((*self.materials, *user_materials))
        return tuple(name for name in names if name != UNKNOWN)

    def match(self, embedding: Floats, *, is_flat: bool = False) -> Evidence:
        """Match one (D,) embedding; the part that the beliefs lack to 1 is unknown.

        `is_flat`: it is the embedding of a picture of flat colours.
        """
        if not self.materials or not np.isfinite(embedding @ embedding):
            return Evidence("encoder", ())
        beliefs = self.beliefs(embedding[None], np.array([is_flat]))[0]
        if not np.isfinite(beliefs).all():  # references that are not finite
            return Evidence("encoder", ())
        return Evidence("encoder", _ranked(self.candidates, beliefs))

    def match_texture(self, windows: Floats) -> Evidence:
        """Read windows of one texture map, embeddings (N, D); N is at least 2.

        The part that the beliefs lack to 1 is unknown; without a layer for maps that is all of it.
        """
        layer = self.texture_layer
        if layer is None:
            return Evidence("texture", ())
        logits = windows.astype(np.float64) @ layer.weights + layer.bias
        means = softmax(self.calibration.texture * logits).mean(axis=0)
        believed = _are_even(windows, self.calibration) * means
        return Evidence("texture", _ranked(self.materials, believed))

    def beliefs(self, embeddings: Floats, flat: NDArray[np.bool_] | None = None) -> Doubles:
        """Return beliefs in the candidates, of (N, D) embeddings: (N, C); the rest is unknown.

        `flat` (N,) says which are of pictures of flat colours; None: none of them.
        """
        scores = self.scores(embeddings)
        scale = np.full(len(embeddings), self.calibration.scale)
        if flat is not None:
            scale[flat] *= self.calibration.flat
        logits = scale[:, None] * self._logits(embeddings, scores, flat)
        if self.user is not None:
            return self._with_user(embeddings, logits)
        believed = self._believed(scores, logits)
        return believed[:, [self.materials.index(name) for name in self.candidates]]

    @property
    def families(self) -> Indices:
        """The index in `materials` of each one's parent, or its own if that is not among them."""
        names = self.materials
        parents = [self.parents.get(name, name) for name in names]
        pairs = zip(names, parents, strict=True)
        return np.array([names.index(up if up in names else name) for name, up in pairs], np.int64)

    def _believed(self, scores: Doubles, logits: Doubles) -> Doubles:
        """Return beliefs (N, C) of scores and logits (N, C): in families, then within each."""
        heads, places = np.unique(self.families, return_inverse=True)
        if len(heads) == len(places):
            return np.asarray(known(scores, self.calibration)[:, None] * softmax(logits))
        own, of_family = scores[:, heads], logits[:, heads]
        gain = self.calibration.sharpness
        members = np.eye(len(heads))[places]
        mean = np.log(np.exp(gain * scores) @ members / members.sum(axis=0)) / gain
        best = np.maximum(own, mean)
        of_family = of_family + self.calibration.weight * gain * (best - own)
        within = np.exp(logits - logits.max(axis=1, keepdims=True))
        believed = known(best, self.calibration)[:, None] * softmax(of_family)
        return np.asarray(believed[:, places] * within / (within @ members)[:, places])

    def scores(self, embeddings: Floats) -> Doubles:
        """Return soft-maximum similarities of (N, D) embeddings to `materials`: (N, C)."""
        blocks = _blocks(self)
        sharpness = self.calibration.sharpness
        # One product with all references in order of material, then one sum per block of them: a
        # gallery of thousands takes the same two calls of numpy as one of ten. The order is cached
        # by gallery (`_blocks`), which is immutable; added user materials make a new one.
        powers = np.exp(np.float32(sharpness) * (embeddings @ blocks.references.T))
        means = np.add.reduceat(powers, blocks.starts, axis=1) / blocks.counts
        return np.asarray(np.log(np.maximum(means.astype(np.float64), _LEAST)) / sharpness)

    def _logits(
        self, embeddings: Floats, scores: Doubles, flat: NDArray[np.bool_] | None = None
    ) -> Doubles:
        logits = self.calibration.weight * self.calibration.sharpness * scores
        if self.layer is None:
            return logits
        read = embeddings @ self.layer.weights + self.layer.bias
        if flat is not None and self.flat_layer is not None:
            read[flat] = embeddings[flat] @ self.flat_layer.weights + self.flat_layer.bias
        return np.asarray(logits + read)

    def _with_user(self, embeddings: Floats, shipped: Doubles) -> Doubles:
        user_gallery = self.user
        assert user_gallery is not None
        scores = user_gallery.scores(embeddings)
        beside = log_softmax(self._columns(shipped, user_gallery.materials))
        logits = user_gallery._logits(embeddings, scores) + user_gallery.calibration.share * beside
        share = known(scores, user_gallery.calibration)[:, None]
        beliefs = dict(zip(user_gallery.materials, (share * softmax(logits)).T, strict=True))
        for name, belief in zip(self.materials, ((1.0 - share) * softmax(shipped)).T, strict=True):
            # User references claim the share p(known) of the belief, and the shipped gallery gets
            # the rest. So three pictures of walnut make walnut recognised, but claim nothing of a
            # tin can, which the shipped gallery still calls metal.
            beliefs[name] = beliefs.get(name, 0.0) + belief
        return np.stack([beliefs[name] for name in self.candidates], axis=1)

    def shipped_logits(self, embeddings: Floats, names: Sequence[str]) -> Doubles:
        """Return logits (N, C) of these materials without the user references."""
        logits = self._logits(embeddings, self.scores(embeddings))
        return self._columns(self.calibration.scale * logits, names)

    def parent(self, name: str) -> str | None:
        """Return the material that represents this one: itself, its class, or None."""
        parent = name if name in self.materials else self.parents.get(name)
        return parent if parent in self.materials else None

    def _columns(self, logits: Doubles, names: Sequence[str]) -> Doubles:
        """Return the columns (N, C) that represent these materials; else the mean of all."""
        parents = [self.parent(name) for name in names]
        columns = [
            logits.mean(axis=1) if parent is None else logits[:, self.materials.index(parent)]
            for parent in parents
        ]
        return np.stack(columns, axis=1)


def known(scores: Doubles, calibration: Calibration) -> Doubles:
    """Return the belief that (N, C) scores belong to any of the materials: (N,)."""
    power = -calibration.slope * (scores.max(axis=1) - calibration.threshold)
    return np.asarray(1.0 / (1.0 + np.exp(np.minimum(power, 700.0))))


def agreement(windows: Floats) -> float:
    """Return the mean cosine between two of N >= 2 embeddings (N, D) of unit norm."""
    count = len(windows)
    total = windows.sum(axis=0, dtype=np.float64)
    return float((total @ total - count) / (count * (count - 1)))


def _are_even(windows: Floats, calibration: Calibration) -> float:
    """Return the belief that windows of a texture map show one material."""
    power = -calibration.even_slope * (agreement(windows) - calibration.even)
    return 1.0 / (1.0 + math.exp(min(power, 700.0)))


def _ranked(names: Sequence[str], beliefs: Doubles) -> tuple[tuple[str, float], ...]:
    """Return the materials with a belief, the best first, without UNKNOWN."""
    pairs = zip(names, beliefs.tolist(), strict=True)
    kept = [pair for pair in pairs if pair[1] >= FLOOR and pair[0] != UNKNOWN]
    return tuple(sorted(kept, key=lambda item: -item[1]))


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
    """References in order of material, with the start and the size of each material's block."""

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
    """Join the references of galleries as if enrolled together; keeps the first's calibration."""
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
