"""Fits the layer of flat pictures.

A gallery reads the materials of flat pictures (vision/flatness.py) off an embedding by a layer of
their own, which begins as the layer of all others and is trained on with drawn game kits. Beside
them it sees references, photographs and rooms, and for these asks for the beliefs of the layer that
it began as, as well as for their labels. The encoder is not changed, so references that users made
stay valid.

The factor of the scale (Calibration.flat) is that of least surprise on flat pictures that taught
nothing: kits, each fold read by a layer that the others taught, rooms
left out and web pictures. W holds what `rooms` and `kits` drew, W/rooms and W/kits; embeddings that
exist in W are not computed again. No kit that is held back is read.
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
from hapticvlm.vision.pictures import Crop
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
Flags = NDArray[np.bool_]
Words = NDArray[np.str_]
Doubles = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Taught:
    """embeddings (N, D); labels (N,) places in NAMES; sources (N,), sources.KITS for kits."""

    embeddings: Floats
    labels: NDArray[np.int64]
    sources: NDArray[np.str_]


@dataclass(frozen=True, slots=True)
class Kits:
    """N crops: embeddings (N, D), whether they are flat, their materials and objects' paths."""

    embeddings: Floats
    flat: Flags
    truth: Words
    paths: Words

    @property
    def kits(self) -> Words:
        """The kit of each crop, (N,)."""
        return np.array([path.split("/")[-2] for path in self.paths])


def add_to(data: Path, work: Path, out: Path) -> str:
    """Add the layer to the gallery of the encoder in `out`; return a line on what was chosen."""
    encoder = load_encoder(str(out))
    gallery = load_gallery(out / FILE_NAME, encoder=encoder)
    shown = describing.teaching(data, work, encoder.side)
    known = join([_embedded(encoder, shown[name], work, name) for name in KNOWN])
    kits = read(work / sources.KITS, encoder)
    fitted = add(gallery, known, kits, judging(data, work, encoder))
    save_gallery(fitted, out / FILE_NAME)
    return f"{encoder.name}: flat pictures, scale times {fitted.calibration.flat:.2f}"


def read(folder: Path, encoder: Encoder) -> Kits:
    """Embed the crops of every file of a folder, in the order of their names.

    A file has big (N, 224, 224, 4) RGB and mask, label (N,), and path (N,) of the object.
    """
    rows = []
    flat = []
    labels: list[str] = []
    paths: list[str] = []
    for path in sorted(folder.glob("*.npz")):
        with np.load(path) as file:
            labels += file["label"].tolist()
            paths += file["path"].tolist()
            drawn = [Crop(big[..., :3].copy(), big[..., 3].copy()) for big in file["big"]]
        flat += [is_flat(crop) for crop in drawn]
        rows.append(encoder.embed(drawn))
    return Kits(np.concatenate(rows), np.array(flat), np.array(labels), np.array(paths))


def judging(data: Path, work: Path, encoder: Encoder) -> list[Kits]:
    """Embed the sets that choose and calibrate, but those of which nothing is drawn."""
    parts = []
    for name, labelled in describing.judging(data, work, encoder.side).items():
        shown = [(encoder.embed([crop])[0], is_flat(crop), label) for crop, label, _ in labelled]
        if shown:
            rows, flat, labels = zip(*shown, strict=True)
            paths = np.full(len(shown), f"{name}/")
            parts.append(Kits(np.stack(rows), np.array(flat), np.array(labels), paths))
    return parts


def add(gallery: Gallery, known: Taught, kits: Kits, others: Sequence[Kits]) -> Gallery:
    """Return a gallery with the layer and the factor of flat pictures.

    `others` are pictures that taught nothing, for the factor.
    """
    begin = gallery.layer
    assert begin is not None
    taught = Taught(kits.embeddings, _places(kits), np.full(len(kits.truth), sources.KITS))
    logits = np.zeros((len(kits.truth), len(NAMES)))
    for fold in FOLDS:
        out = np.array([kit.startswith(fold) for kit in kits.kits])
        logits[out] = _logits(fit(join([known, _keep(taught, ~out)]), begin), kits.embeddings[out])
    layer = fit(join([known, taught]), begin)
    shown = [(logits, kits), *((_logits(layer, other.embeddings), other) for other in others)]
    scale = gallery.calibration.scale
    flat = [(scale * read[part.flat], _places(part)[part.flat]) for read, part in shown]
    calibration = replace(gallery.calibration, flat=_factor(flat))
    return replace(gallery, flat_layer=layer, calibration=calibration)


def fit(taught: Taught, begin: LinearLayer) -> LinearLayer:
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


def _train(features: Floats, taught: Taught, before: Floats, bias: Floats) -> tuple[Floats, Floats]:
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
    optimiser = torch.optim.AdamW(layer.parameters(), weight_decay=0.0)
    steps = len(rows) // head.BATCH
    rate = torch.optim.lr_scheduler.OneCycleLR(optimiser, RATE, EPOCHS * steps)
    for _ in range(EPOCHS):
        for batch in torch.randperm(len(rows))[: steps * head.BATCH].reshape(steps, head.BATCH):
            logits = layer(functional.dropout(rows[batch], head.DROPPED))
            surprise = functional.cross_entropy(
                logits, labels[batch], reduction="none", label_smoothing=head.SMOOTHING
            )
            apart = asked[batch].exp() * (asked[batch] - logits.log_softmax(dim=1))
            cost = surprise + kept[batch] * apart.sum(dim=1)
            optimiser.zero_grad()
            (costs[batch] * cost).mean().backward()
            optimiser.step()
            rate.step()
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


def _places(kits: Kits) -> NDArray[np.int64]:
    return np.array([NAMES.index(name) for name in kits.truth], np.int64)


def join(parts: Sequence[Taught]) -> Taught:
    """Join what teaches."""
    return Taught(
        np.concatenate([part.embeddings for part in parts]),
        np.concatenate([part.labels for part in parts]),
        np.concatenate([part.sources for part in parts]),
    )


def _keep(taught: Taught, rows: NDArray[np.bool_]) -> Taught:
    return Taught(taught.embeddings[rows], taught.labels[rows], taught.sources[rows])


def _embedded(encoder: Encoder, crops: Iterable[Labelled], work: Path, name: str) -> Taught:
    """Embed a set, or read what W has of it."""
    path = work / f"{encoder.name}_{name}.npz"
    if not path.exists():
        shown = [
            (encoder.embed([crop])[0], NAMES.index(label), source)
            for crop, label, source in track(crops, name)
        ]
        embeddings, labels, named = zip(*shown, strict=True)
        with path.open("wb") as file:
            np.savez(file, embeddings=np.stack(embeddings), labels=labels, sources=named)
    with np.load(path, allow_pickle=False) as file:
        return Taught(file["embeddings"], file["labels"].astype(np.int64), file["sources"])
