"""Fits the layer of flat pictures.

A gallery reads the materials of flat pictures (vision/flatness.py) off an embedding by a layer of
their own, which begins as the layer of all others and is trained on with drawn game kits. Beside
them it sees references, photographs and rooms, and for these asks for the beliefs of the layer that
it began as, as well as for their labels. The encoder is not changed, so references that users made
stay valid.

The factor of the scale (Calibration.flat) is that of least surprise on flat pictures that taught
nothing: kits, each fold read by a layer that the others taught, rooms
left out and web pictures. W holds what `rooms` and `kits` drew, W/rooms and W/kits. No kit that is
held back is read.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import torch
from numpy.typing import NDArray
from rich.progress import track
from torch.nn import functional

from hapticvlm.materials import MATERIALS
from hapticvlm.vision.encoders import joint_embedding
from hapticvlm.vision.encoders.encoder import Encoder
from hapticvlm.vision.flatness import is_flat
from hapticvlm.vision.galleries.gallery import Gallery, LinearLayer
from hapticvlm.vision.galleries.network_gallery import EXPONENT
from hapticvlm.vision.galleries.storage import FILE_NAME, load_gallery, save_gallery
from hapticvlm.vision.loading import load_encoder
from hapticvlm_lab.training import describing, head, making, sources
from hapticvlm_lab.training.describing import NAMES, Labelled
from hapticvlm_lab.training.making import FOUR

KNOWN = ("references", "photographs_0", "rooms")  # of what taught the layer of all others
# Kits that are left out together, by the beginnings of their names: authors whole in three of four.
FOLDS = (
    ("kaykit",),
    ("kenney", "megakit"),
    (
        "quaternius_house",
        "quaternius_cyberpunk",
        "quaternius_crops",
        "quaternius_scifi",
        "minimike",
    ),
    ("quaternius_dungeon", "quaternius_platformer", "quaternius_rpg", "quaternius_weapons"),
)
EPOCHS = 6
RATE = 5e-3
FACTORS: tuple[float, ...] = tuple(np.geomspace(0.2, 1.5, 30).tolist())  # of the scale
KEPT = 1.0  # weight of the beliefs of the layer that it began as, beside a label
SEED = 1

Floats = NDArray[np.float32]
Doubles = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Embedded:
    """N crops: embeddings (N, D), places of labels in NAMES, sources or kits, and who is flat."""

    embeddings: Floats
    labels: NDArray[np.int64]
    sources: NDArray[np.str_]
    flat: NDArray[np.bool_]

    def rows(self, chosen: NDArray[np.bool_]) -> Embedded:
        """Return some of the crops."""
        return Embedded(
            self.embeddings[chosen], self.labels[chosen], self.sources[chosen], self.flat[chosen]
        )


def add_to(data: Path, work: Path, out: Path) -> str:
    """Add the layer to the gallery of the encoder in `out`; return a line on what was chosen."""
    encoder = load_encoder(str(out))
    gallery = load_gallery(out / FILE_NAME, encoder=encoder)
    shown = describing.teaching(data, work)
    known = join([embed(encoder, track(shown[name], name)) for name in KNOWN])
    others = describing.judging(data, work).values()
    judged = [part for part in (embed(encoder, crops) for crops in others) if len(part.labels)]
    kits = describing.drawn(sorted((work / sources.KITS).glob("*.npz")))
    fitted = add(gallery, known, embed(encoder, kits), judged)
    save_gallery(fitted, out / FILE_NAME)
    return f"{encoder.name}: flat pictures, scale times {fitted.calibration.flat:.2f}"


def embed(encoder: Encoder, crops: Iterable[Labelled]) -> Embedded:
    """Embed crops one by one."""
    rows = [
        (encoder.embed([crop])[0], label, source, is_flat(crop)) for crop, label, source in crops
    ]
    embeddings, labels, named, flat = zip(*rows, strict=True) if rows else ((), (), (), ())
    places = np.array([NAMES.index(label) for label in labels], np.int64)
    return Embedded(np.array(embeddings, np.float32), places, np.array(named), np.array(flat, bool))


def add(gallery: Gallery, known: Embedded, kits: Embedded, others: Sequence[Embedded]) -> Gallery:
    """Return a gallery with the layer and the factor of flat pictures.

    `others` are pictures that taught nothing, for the factor.
    """
    begin = gallery.layer
    assert begin is not None
    taught = replace(kits, sources=np.full(len(kits.labels), sources.KITS))
    logits = np.zeros((len(kits.labels), len(NAMES)))
    for fold in FOLDS:
        out = np.array([kit.startswith(fold) for kit in kits.sources])
        logits[out] = _logits(fit(join([known, taught.rows(~out)]), begin), kits.embeddings[out])
    layer = fit(join([known, taught]), begin)
    shown = [(logits, kits), *((_logits(layer, other.embeddings), other) for other in others)]
    scale = gallery.calibration.scale
    flat = [(scale * read[part.flat], part.labels[part.flat]) for read, part in shown]
    calibration = replace(gallery.calibration, flat=_factor(flat))
    return replace(gallery, flat_layer=layer, calibration=calibration)


def fit(taught: Embedded, begin: LinearLayer) -> LinearLayer:
    """Train a layer on, on one thread: the same pictures give the same bytes on one machine."""
    # Only the rows of the features learn. Those of the beliefs that the network's own classes
    # imply keep their exponent.
    count = taught.embeddings.shape[1] - joint_embedding.ADDED
    features = joint_embedding.features_of(taught.embeddings) * np.float32(head.HIDDEN_GAIN)
    before = begin.weights[:count] * np.float32(math.sqrt(1.0 - joint_embedding.SHARE))
    before = before / np.float32(head.HIDDEN_GAIN)
    weights, bias = _train(features, taught, before, begin.bias)
    read = weights * np.float32(head.HIDDEN_GAIN)
    return LinearLayer(joint_embedding.layer_of(read, EXPONENT), bias)


def _train(
    features: Floats, taught: Embedded, before: Floats, bias: Floats
) -> tuple[Floats, Floats]:
    torch.set_num_threads(1)
    torch.manual_seed(SEED)
    rows = torch.from_numpy(features)
    labels = torch.from_numpy(taught.labels)
    weights = head.weigh(taught.labels, taught.sources)
    costs = torch.from_numpy((weights * len(weights)).astype(np.float32))
    kept = torch.from_numpy(KEPT * (taught.sources != sources.KITS).astype(np.float32))
    asked = torch.from_numpy(features @ before + bias).log_softmax(dim=1)
    layer = torch.nn.Linear(len(before), len(bias))
    with torch.no_grad():
        layer.weight.copy_(torch.from_numpy(before.T))
        layer.bias.copy_(torch.from_numpy(bias))

    def cost(batch: torch.Tensor) -> torch.Tensor:
        logits = layer(functional.dropout(rows[batch], head.DROPPED))
        apart = asked[batch].exp() * (asked[batch] - logits.log_softmax(dim=1))
        surprise = head.surprise(logits, labels[batch])
        return torch.mul(costs[batch], surprise + kept[batch] * apart.sum(dim=1))

    optimiser = torch.optim.AdamW(layer.parameters(), weight_decay=0.0)
    head.descend(optimiser, cost, len(rows), (EPOCHS, RATE))
    return layer.weight.detach().numpy().T.copy(), layer.bias.detach().numpy().copy()


def _factor(shown: Sequence[tuple[Doubles, NDArray[np.int64]]]) -> float:
    """Return the factor of least surprise, of logits (N, C) and labels (N,); sets count equally."""

    def surprise(factor: float) -> float:
        return sum(
            making.among(factor * logits, labels, names)
            for logits, labels in shown
            for names in (FOUR, tuple(MATERIALS))
        )

    return min(FACTORS, key=surprise)


def _logits(layer: LinearLayer, embeddings: Floats) -> Doubles:
    return np.asarray(embeddings @ layer.weights + layer.bias, np.float64)


def join(parts: Sequence[Embedded]) -> Embedded:
    """Join what teaches."""
    fields = ("embeddings", "labels", "sources", "flat")
    return Embedded(*(np.concatenate([getattr(part, name) for part in parts]) for name in fields))
