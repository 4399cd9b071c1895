"""Makes the gallery of a network that the user named, on first use; it is cached.

The shipped reference pictures, crops of our own rendered rooms, are embedded once. A strongly
regularised linear layer is fitted to their features, and the beliefs that the network's own classes
or words imply count beside it. The gain of the layer and the scale of the logits are chosen by
cross-validation: the pictures are left out one fold at a time, and the constants are those under
which the true materials of the pictures left out are least surprising. The share of these that is
right says whether the network can tell materials apart at all; it is printed beside chance. PENALTY
and EXPONENT were chosen with two small ImageNet networks, on rooms and on pictures that no reported
figure uses (hapticvlm_lab/training/LOG.md).
"""

from __future__ import annotations

import hashlib
import logging
import sys
from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from hapticvlm import materials
from hapticvlm.cache_folder import cache_folder
from hapticvlm.vision.encoders import joint_embedding
from hapticvlm.vision.encoders.encoder import SHIPPED, NetworkEncoder
from hapticvlm.vision.galleries.gallery import Calibration, Gallery, LinearLayer, log_softmax
from hapticvlm.vision.pictures import Crop, central_mask

if TYPE_CHECKING:
    from PIL import Image

Floats = NDArray[np.float32]
Doubles = NDArray[np.float64]
Indices = NDArray[np.int64]

PART = 64  # pictures embedded at once, which fill a GPU
STEPS = 300  # of the fit, at most
MEMORY = 10  # steps that it remembers
# Shares of the expected fall, of a step, and of the loss: less of it is too little, or the end.
ENOUGH, SHORTEST, FLAT = 1e-4, 1e-10, 2e-9
NAMES = (*materials.MATERIALS, materials.UNKNOWN)
REFERENCES = SHIPPED / "references"  # NAME.jpg and NAME.mask.png: sheets of COLUMNS squares a row
COLUMNS = 8
PENALTY = 0.003  # of the squared weights of unit features
EXPONENT = 0.5  # of the beliefs that the network's own classes imply, beside the layer
FOLDS = 4
GAINS = (1.0, 2.0, 4.0, 8.0)  # of the layer beside the classes
SCALES = tuple(np.geomspace(0.25, 4.0, 13).tolist())
BLANK_LEVELS = (0, 64, 127, 191, 255)  # plain grey pictures count as unknown
KNOWN = Calibration(16.0, 1.0, -1000.0, 0.0)  # p(known) is 1, since unknown is one of the classes
VERSION = 3  # of this fit; a gallery of another version is fitted again
CHANCE = 1 / len(NAMES)  # share that is right where the features say nothing
# Below this share a network hardly tells materials apart: our choice. Networks of random weights
# see colours, which is better than chance: those tried reach 16 to 20 %.
LEAST = 3 * CHANCE

logger = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True)
class Fit:
    """The gallery of a network, and the share 0..1 of reference pictures right when left out.

    The share is the mean over the classes NAMES, so that one class guessed for all gives CHANCE.
    """

    gallery: Gallery
    share: float

    @property
    def tells_materials(self) -> bool:
        """Whether the network is clearly better than chance."""
        return self.share >= LEAST


def cached_gallery(encoder: NetworkEncoder) -> Path:
    """Return the path of a network's gallery in the cache."""
    key = f"{VERSION} {encoder.name} {encoder.revision}".encode()
    return cache_folder() / f"gallery-{hashlib.sha256(key).hexdigest()[:16]}.npz"


def make_gallery(encoder: NetworkEncoder) -> Fit:
    """Embed the reference pictures, with a progress bar, fit, and print how well it fits.

    Raises EncoderError.
    """
    from rich.console import Console
    from rich.progress import track

    crops, labels = read_references(encoder.side)
    console = Console(file=sys.stderr)
    text = f"fitting `{encoder.name}`, once"
    parts = track(range(0, len(crops), PART), text, console=console)
    rows = [encoder.embed(crops[at : at + PART]) for at in parts]
    fitted = fit(encoder.name, np.concatenate(rows), labels, has_beliefs=encoder.beliefs)
    right = f"`{encoder.name}` is right about {fitted.share:.0%} of the reference pictures left out"
    console.print(f"{right}; chance is {CHANCE:.0%}", soft_wrap=True, markup=False, highlight=False)
    if not fitted.tells_materials:
        message = "encoder `%s` hardly tells materials apart (%.0f %% right, chance is %.0f %%): "
        cure = (
            "most frames will be `unknown`; name a network that was trained on many kinds of things"
        )
        logger.warning(message + cure, encoder.name, 100 * fitted.share, 100 * CHANCE)
    return fitted


def trial_shares(encoders: Sequence[NetworkEncoder]) -> list[float]:
    """Return for each the share of every other reference picture that is right when left out.

    The encoders take crops of one side.
    """
    crops, labels = read_references(encoders[0].side)
    rows = [encoder.embed(crops[::2]) for encoder in encoders]
    beliefs = encoders[0].beliefs
    return [fit("", embeddings, labels[::2], has_beliefs=beliefs).share for embeddings in rows]


def read_references(side: int) -> tuple[list[Crop], Indices]:
    """Read the reference pictures as crops, blank ones as unknown; labels are indices in NAMES."""
    from PIL import Image

    crops: list[Crop] = []
    labels: list[int] = []
    for label, name in enumerate(NAMES):
        with (
            Image.open(REFERENCES / f"{name}.jpg") as sheet,
            Image.open(REFERENCES / f"{name}.mask.png") as masks,
        ):
            cut = _cut(sheet.convert("RGB"), masks.convert("L"), side)
        crops += cut
        labels += [label] * len(cut)
    flat = [np.full((side, side, 3), level, np.uint8) for level in BLANK_LEVELS]
    noise = np.random.default_rng(1).integers(0, 256, (side, side, 3), np.uint8)
    crops += [Crop(image, central_mask(side)) for image in (*flat, noise)]
    labels += [NAMES.index(materials.UNKNOWN)] * (len(flat) + 1)
    return crops, np.array(labels, np.int64)


def fit(name: str, embeddings: Floats, labels: Indices, *, has_beliefs: bool) -> Fit:
    """Fit a gallery to embeddings (N, D) of the materials NAMES[labels]."""
    folds = _folds(labels)
    gain, scale, share = _calibrate(embeddings, labels, folds, has_beliefs=has_beliefs)
    layer = _layer(embeddings, labels, gain, has_beliefs=has_beliefs)
    calibration = Calibration(KNOWN.sharpness, KNOWN.slope, KNOWN.threshold, 0.0, scale)
    return Fit(Gallery(name, NAMES, embeddings, labels, calibration, layer), share)


def _layer(embeddings: Floats, labels: Indices, gain: float, *, has_beliefs: bool) -> LinearLayer:
    features = joint_embedding.features_of(embeddings) if has_beliefs else embeddings
    weights = 1.0 / np.bincount(labels)[labels]
    layer = fit_layer(features, labels, weights / weights.sum(), PENALTY)
    rows = layer.weights * np.float32(gain)
    bias = layer.bias * np.float32(gain)
    return LinearLayer(joint_embedding.layer_of(rows, EXPONENT) if has_beliefs else rows, bias)


def _calibrate(
    embeddings: Floats, labels: Indices, folds: Indices, *, has_beliefs: bool
) -> tuple[float, float, float]:
    """Choose gain and scale by the mean surprise of the pictures left out.

    Returns both, and the share of these pictures that is then right.
    """
    plain = np.zeros((len(labels), len(NAMES)))
    beside = np.zeros((len(labels), len(NAMES)))
    for fold in range(FOLDS):
        out = folds == fold
        # The final layer is fitted to all pictures, so it is too sure of them. How sure it may be
        # is measured with layers fitted without the fold in question. A fold is a whole stretch of
        # each sheet, because neighbours on a sheet show the same room.
        layer = _layer(embeddings[~out], labels[~out], 1.0, has_beliefs=has_beliefs)
        plain[out] = embeddings[out] @ layer.weights + layer.bias
    if has_beliefs:
        beside = EXPONENT * joint_embedding.log_beliefs(embeddings).astype(np.float64)
        plain -= beside
    rows = np.arange(len(labels))
    even = 1.0 / np.bincount(labels)[labels]

    def surprise(gain: float, scale: float) -> float:
        return -float(even @ log_softmax(scale * (gain * plain + beside))[rows, labels])

    gain, scale = min(product(GAINS, SCALES), key=lambda trial: surprise(*trial))
    is_right = (gain * plain + beside).argmax(axis=1) == labels
    return gain, scale, float(even @ is_right / even.sum())


def _folds(labels: Indices) -> Indices:
    """Assign the pictures of a class to folds in blocks: neighbours show the same room."""
    folds = np.zeros(len(labels), np.int64)
    for label in np.unique(labels):
        rows = np.flatnonzero(labels == label)
        folds[rows] = np.arange(len(rows)) * FOLDS // len(rows)
    return folds


def _cut(sheet: Image.Image, masks: Image.Image, side: int) -> list[Crop]:
    from PIL import Image

    square = sheet.width // COLUMNS
    boxes = [
        (left, top, left + square, top + square)
        for top in range(0, sheet.height, square)
        for left in range(0, sheet.width, square)
    ]
    size = (side, side)
    images = [sheet.resize(size, Image.Resampling.BILINEAR, box=box) for box in boxes]
    inside = [masks.resize(size, Image.Resampling.BILINEAR, box=box) for box in boxes]
    return [
        Crop(np.asarray(image), np.where(np.asarray(mask) >= 128, 255, 0).astype(np.uint8))
        for image, mask in zip(images, inside, strict=True)
    ]


def fit_layer(embeddings: Floats, labels: Indices, weights: Doubles, penalty: float) -> LinearLayer:
    """Fit a layer to (N, D) embeddings of classes 0..C-1 by L-BFGS; weights (N,) sum to 1."""
    rows = np.hstack([embeddings, np.ones((len(embeddings), 1))]).astype(np.float64)
    targets = np.eye(int(labels.max()) + 1)[labels]

    def loss(flat: Doubles) -> tuple[float, Doubles]:
        parameters = flat.reshape(rows.shape[1], -1)
        logs = log_softmax(rows @ parameters)
        slope = rows.T @ ((np.exp(logs) - targets) * weights[:, None])
        slope[:-1] += penalty * parameters[:-1]
        surprise = -float(weights @ (logs * targets).sum(axis=1))
        return surprise + penalty / 2 * float((parameters[:-1] ** 2).sum()), slope.ravel()

    start = np.zeros(rows.shape[1] * targets.shape[1])
    parameters = _least(loss, start).reshape(rows.shape[1], -1).astype(np.float32)
    return LinearLayer(parameters[:-1], parameters[-1])


def _least(loss: Callable[[Doubles], tuple[float, Doubles]], start: Doubles) -> Doubles:
    """Return the place of the least of a smooth convex loss, by L-BFGS from a start.

    J. Nocedal and S. J. Wright, Numerical Optimization (2006), algorithms 7.4 and 3.1.
    """
    place, (value, slope) = start, loss(start)
    pairs: deque[tuple[Doubles, Doubles]] = deque(maxlen=MEMORY)  # steps, and changes of the slope
    for _ in range(STEPS):
        way = -_turned(slope, pairs)
        length = 1.0 if pairs else 1.0 / max(1.0, float(np.abs(slope).sum()))
        fall = ENOUGH * float(slope @ way)
        while (there := loss(place + length * way))[0] > value + length * fall:
            length /= 2.0
            if length < SHORTEST:
                return place
        pairs.append((length * way, there[1] - slope))
        gain, place, (value, slope) = value - there[0], place + length * way, there
        if gain <= FLAT * max(abs(value), 1.0):
            break
    return place


def _turned(slope: Doubles, pairs: deque[tuple[Doubles, Doubles]]) -> Doubles:
    """Multiply a slope by the inverse of the curvature that the last steps met."""
    shares = []
    for step, change in reversed(pairs):
        shares.append(float(step @ slope) / float(step @ change))
        slope = slope - shares[-1] * change
    if pairs:
        step, change = pairs[-1]
        slope = slope * (float(step @ change) / float(change @ change))
    for step, change in pairs:
        slope = slope + (shares.pop() - float(change @ slope) / float(step @ change)) * step
    return slope
