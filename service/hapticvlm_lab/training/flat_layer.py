"""Fits the layer of flat pictures.

A gallery reads the materials of flat pictures (vision/flatness.py) off an embedding by a layer of
their own, which begins as the layer of all others and is trained on with drawn game kits. Beside
them it sees references, photographs and rooms, and for these asks for the beliefs of the layer that
it began as, as well as for their labels. The encoder is not changed, so references that users made
stay valid.

The scale stays that of all pictures: the factor of least surprise on flat pictures that taught
nothing was .99 (LOG.md). W holds what `rooms` and `kits` drew, W/rooms and W/kits. No kit that is
held back is read.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, replace
from itertools import chain
from pathlib import Path

import numpy as np
import torch
from numpy.typing import NDArray
from rich.progress import track
from torch.nn import functional

from hapticvlm.vision.encoders import joint_embedding
from hapticvlm.vision.encoders.encoder import Encoder
from hapticvlm.vision.galleries.gallery import LinearLayer
from hapticvlm.vision.galleries.network_gallery import EXPONENT
from hapticvlm.vision.galleries.storage import FILE_NAME, load_gallery, save_gallery
from hapticvlm.vision.loading import load_encoder
from hapticvlm_lab.training import describing, head, sources
from hapticvlm_lab.training.describing import NAMES, Labelled

KNOWN = ("references", "photographs_0", "rooms")  # of what taught the layer of all others
EPOCHS = 6
RATE = 5e-3
KEPT = 1.0  # weight of the beliefs of the layer that it began as, beside a label
SEED = 1

Floats = NDArray[np.float32]


@dataclass(frozen=True, slots=True)
class Embedded:
    """N crops: embeddings (N, D), places of labels in NAMES, and sources."""

    embeddings: Floats
    labels: NDArray[np.int64]
    sources: NDArray[np.str_]


def add_to(data: Path, work: Path, out: Path) -> str:
    """Add the layer to the gallery of the encoder in `out`; return a line on what was chosen."""
    encoder = load_encoder(str(out))
    gallery = load_gallery(out / FILE_NAME, encoder=encoder)
    shown = describing.teaching(data, work)
    known = [track(shown[name], name) for name in KNOWN]
    drawn = describing.drawn(sorted((work / sources.KITS).glob("*.npz")))
    kits = ((crop, label, sources.KITS) for crop, label, _ in drawn)
    taught = embed(encoder, chain(*known, kits))
    begin = gallery.layer
    assert begin is not None
    save_gallery(replace(gallery, flat_layer=fit(taught, begin)), out / FILE_NAME)
    count = np.count_nonzero(taught.sources == sources.KITS)
    return f"{encoder.name}: flat pictures, taught by {count} crops of kits"


def embed(encoder: Encoder, crops: Iterable[Labelled]) -> Embedded:
    """Embed crops one by one."""
    rows = [(encoder.embed([crop])[0], label, source) for crop, label, source in crops]
    embeddings, labels, named = zip(*rows, strict=True)
    places = np.array([NAMES.index(label) for label in labels], np.int64)
    return Embedded(np.array(embeddings, np.float32), places, np.array(named))


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
