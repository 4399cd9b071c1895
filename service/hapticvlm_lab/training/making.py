"""Builds the folder of the shipped encoder: its graph, its card and its gallery.

The scale of the logits, one for all pictures, is chosen on renders of other rooms and objects and
on sources.CHOICE. The chosen scale has the least mean surprise, -log of the probability of the true
material, with the four main candidates and with all materials: a scale that is too large is certain
and badly wrong now and then, one that is too small is never certain. No picture that is reported on
is read here.

References are centres of clusters (k-means) of the teaching embeddings, the same number for every
class of every source, so that a large set does not crowd out a small one.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.cluster.vq import kmeans2

from hapticvlm import materials
from hapticvlm.vision.encoders.encoder import CARD, DEFAULT, SHIPPED
from hapticvlm.vision.encoders.joint_embedding import layer_of
from hapticvlm.vision.encoders.onnx_encoder import GRAPH
from hapticvlm.vision.galleries.gallery import Calibration, Gallery, LinearLayer, log_softmax
from hapticvlm.vision.galleries.network_gallery import EXPONENT
from hapticvlm.vision.galleries.storage import FILE_NAME, save_gallery
from hapticvlm_lab.training import describing, head, shipped_graph
from hapticvlm_lab.training.describing import NAMES, Described
from hapticvlm_lab.training.head import Fitted

VERSION = 2  # of the heads: galleries made with another do not fit
NAME = f"lite0-{VERSION}"
SHARPNESS = 16.0  # of the shipped references, which teach a user's own ones what is none of them
SEED = 2  # of the fit; other seeds differ by .1 in surprise (LOG.md)
FOUR = ("wood", "glass", "fabric", "metal")
SCALES = tuple(np.geomspace(0.2, 4.0, 40).tolist())

CENTRES = 5  # references of a cell, one class of one source
ROUNDS = 25  # of k-means
FEW = 8  # pictures that a centre stands for at least

Floats = NDArray[np.float32]
Doubles = NDArray[np.float64]
Indices = NDArray[np.int64]


def make(data: Path, work: Path, out: Path) -> str:
    """Write the folder of the encoder; return a line on what was chosen."""
    graph = (SHIPPED / DEFAULT / GRAPH).read_bytes()
    teaching = describing.teaching(data, work)
    judging = describing.judging(data, work)
    described = describing.describe_all(shipped_graph.describing(graph), teaching | judging)
    taught = [described[name] for name in teaching]
    judged = {name: described[name] for name in judging if len(described[name].labels)}
    fitted = head.fit(taught, SEED)
    gallery, surprise = make_gallery(fitted, taught, judged)
    _write(out, shipped_graph.with_head(graph, fitted.head), fitted.head.dimension)
    save_gallery(gallery, out / FILE_NAME)
    pictures = sum(len(described[name].labels) for name in teaching)
    scale = gallery.calibration.scale
    return f"{NAME}: {pictures} crops, scale {scale:.2f}, surprise {surprise:.3f}"


def make_gallery(
    fitted: Fitted, taught: Sequence[Described], judged: Mapping[str, Described]
) -> tuple[Gallery, float]:
    """Build references, the layer of all materials, and its scale; return gallery and surprise."""
    rows = np.concatenate([fitted.embed(each) for each in taught])
    labels = np.concatenate([each.labels for each in taught])
    named = np.concatenate([each.sources for each in taught])
    cells = [f"{source}/{label}" for source, label in zip(named, labels, strict=True)]
    _, numbers = np.unique(cells, return_inverse=True)
    references, of = choose_references(rows, labels, numbers, VERSION)
    layer = LinearLayer(layer_of(fitted.layer.weights, EXPONENT), fitted.layer.bias)
    surprise, scale = min((_surprise(fitted, layer, judged, trial), trial) for trial in SCALES)
    calibration = Calibration(SHARPNESS, 1.0, -1000.0, weight=0.0, scale=scale)
    return Gallery(NAME, NAMES, references, of, calibration, layer), surprise


def choose_references(
    embeddings: Floats, labels: Indices, cells: Indices, seed: int
) -> tuple[Floats, Indices]:
    """Take CENTRES k-means centres of every cell: (R, D) unit float32 and (R,) labels."""
    references = []
    referenced = []
    for cell in np.unique(cells):
        rows = cells == cell
        points = embeddings[rows].astype(np.float64)
        count = min(CENTRES, max(1, len(points) // FEW))
        centres, _ = kmeans2(points, count, ROUNDS, minit="points", rng=seed)
        references.append(centres / np.linalg.norm(centres, axis=1, keepdims=True))
        referenced += [int(labels[rows][0])] * len(centres)
    order = np.argsort(referenced, kind="stable")
    return np.concatenate(references)[order].astype(np.float32), np.array(referenced, np.int64)[
        order
    ]


def _surprise(
    fitted: Fitted, layer: LinearLayer, judged: Mapping[str, Described], scale: float
) -> float:
    """Return the surprise at a scale, summed over the sets that judge, of four and of all."""
    total = 0.0
    for described in judged.values():
        logits = scale * (fitted.embed(described) @ layer.weights + layer.bias).astype(np.float64)
        total += among(logits, described.labels, FOUR) + among(logits, described.labels, NAMES)
    return total


def among(logits: Doubles, labels: NDArray[np.int64], admitted: Sequence[str]) -> float:
    """Return the mean surprise of logits (N, len(NAMES)) among some materials, classes equally.

    Unknown is a candidate beside them; labels (N,) are places in NAMES.
    """
    columns = [NAMES.index(name) for name in dict.fromkeys((*admitted, materials.UNKNOWN))]
    rows = np.isin(labels, [NAMES.index(name) for name in admitted])
    truth = np.array([columns.index(label) for label in labels[rows]])
    right = log_softmax(logits[rows][:, columns])[np.arange(len(truth)), truth]
    return -float(np.mean([right[truth == value].mean() for value in np.unique(truth)]))


def _write(out: Path, graph: bytes, dimension: int) -> None:
    out.mkdir(parents=True, exist_ok=True)
    card = json.loads((SHIPPED / DEFAULT / CARD).read_bytes())
    digest = hashlib.sha256(graph).hexdigest()
    card |= {"name": NAME, "dimension": dimension, "sha256": {GRAPH: digest}}
    (out / GRAPH).write_bytes(graph)
    (out / CARD).write_text(json.dumps(card, indent=2) + "\n", encoding="utf-8")
