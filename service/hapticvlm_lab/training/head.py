"""The head of the shipped encoder: one hidden layer on the features of a frozen network.

Classes count equally; within a class renders and photographs do, and within these their sources, so
that the largest set does not become the material. The layer's activation of unit norm is the
embedding; the linear layer of the gallery reads the materials off it. The seed is fixed.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import torch
from numpy.typing import NDArray
from torch.nn import functional

from hapticvlm.vision.encoders import joint_embedding
from hapticvlm.vision.galleries.gallery import LinearLayer
from hapticvlm_lab.training import sources
from hapticvlm_lab.training.describing import NAMES, ROOMS, Described
from hapticvlm_lab.training.shipped_graph import LAST, STAGES, Head

WIDTH = 256  # of the hidden layer
EPOCHS = 10
BATCH = 256
RATE = 2e-3
DECAY = 0.05
SMOOTHING = 0.05
DROPPED_FEATURES = 0.2
DROPPED = 0.5
# of the unit features, and of the unit activation
GAIN = 16.0
HIDDEN_GAIN = 8.0
LAST_WEIGHT = 3.0  # of the last map beside a stage; a review's choice, kept
LEAST_DEVIATION = 1e-3  # of the largest: what hardly varies is not blown up
# of the rooms, and of the kits, beside another source of renders
ROOMS_WEIGHT = 3.0
KITS_WEIGHT = 3.0
# pictures from which a source, or a kind, counts in full
RARE_SOURCE = 50
RARE_KIND = 60
LEVELS = 127  # of the hidden weights

Floats = NDArray[np.float32]
Doubles = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Fitted:
    """A head, and the layer (W, C) that reads the materials of NAMES off its activation."""

    head: Head
    layer: LinearLayer

    def activation(self, features: NDArray[np.float16]) -> Floats:
        """Return the unit activation (N, W) of features (N, F), as the graph does."""
        head = self.head
        unit = _unit((features.astype(np.float32) - head.mean) * head.scale)
        hidden = unit @ (head.weights * head.steps) + head.bias
        return _unit(np.maximum(hidden, 0.0))

    def embed(self, described: Described) -> Floats:
        """Return the embeddings (N, D) of described crops, as the graph does."""
        beliefs = joint_embedding.material_beliefs(described.scores.astype(np.float32))
        return joint_embedding.join(self.activation(described.features), beliefs)


def fit(sets: Sequence[Described], seed: int) -> Fitted:
    """Fit a head; the same sets and seed give the same bytes on one machine."""
    labels = np.concatenate([each.labels for each in sets])
    weights = weigh(labels, np.concatenate([each.sources for each in sets]))
    features = np.concatenate([each.features for each in sets]).astype(np.float32)
    mean, scale = _standard(features, weights)
    rows = torch.from_numpy(_unit((features - mean) * scale) * np.float32(GAIN))
    hidden, last = _train(rows, torch.from_numpy(labels), weights, seed)
    wide = hidden.weight.detach().numpy().T * np.float32(GAIN)
    steps = np.asarray(np.abs(wide).max(axis=0) / LEVELS, np.float32)
    whole = np.rint(wide / steps).astype(np.int8)
    head = Head(mean, scale, whole, steps, hidden.bias.detach().numpy())
    read = last.weight.detach().numpy().T * np.float32(HIDDEN_GAIN)
    return Fitted(head, LinearLayer(read, last.bias.detach().numpy()))


def weigh(labels: NDArray[np.int64], sources_of: NDArray[np.str_]) -> Doubles:
    """Return weights (N,), which sum to 1, so that classes, kinds and sources count equally."""
    weights = np.zeros(len(labels))
    is_render = np.isin(sources_of, (ROOMS, "references", sources.KITS))
    for label in np.unique(labels):
        for kind in (is_render, ~is_render):
            _weigh_kind(weights, (labels == label) & kind, sources_of)
        weights[labels == label] /= weights[labels == label].sum()
    return np.asarray(weights / weights.sum())


def _weigh_kind(weights: Doubles, chosen: NDArray[np.bool_], sources_of: NDArray[np.str_]) -> None:
    if not chosen.any():
        return
    for source in np.unique(sources_of[chosen]):
        rows = chosen & (sources_of == source)
        rare = min(1.0, rows.sum() / RARE_SOURCE)
        share = {ROOMS: ROOMS_WEIGHT, sources.KITS: KITS_WEIGHT * rare}.get(source, rare)
        weights[rows] = share / rows.sum()
    weights[chosen] *= min(1.0, chosen.sum() / RARE_KIND) / weights[chosen].sum()


def _standard(features: Floats, weights: Doubles) -> tuple[Floats, Floats]:
    """Return mean and scale by which each stage's features count equally, the last map's more."""
    share = [np.full(width, width**-0.5) for width in STAGES for _ in range(2)]
    share.append(np.full(LAST, LAST_WEIGHT * LAST**-0.5))
    mean = weights @ features
    deviation = np.sqrt(weights @ (features - mean) ** 2)
    scale = np.concatenate(share) / np.maximum(deviation, LEAST_DEVIATION * deviation.max())
    return mean.astype(np.float32), scale.astype(np.float32)


def _train(
    rows: torch.Tensor, labels: torch.Tensor, weights: Doubles, seed: int
) -> tuple[torch.nn.Linear, torch.nn.Linear]:
    """Train hidden and last layer on unit features times GAIN, on one thread: repeatable."""
    torch.set_num_threads(1)
    torch.manual_seed(seed)
    hidden = torch.nn.Linear(rows.shape[1], WIDTH)
    last = torch.nn.Linear(WIDTH, len(NAMES))
    costs = torch.from_numpy((weights * len(weights)).astype(np.float32))

    def cost(batch: torch.Tensor) -> torch.Tensor:
        seen = functional.dropout(rows[batch], DROPPED_FEATURES)
        active = HIDDEN_GAIN * functional.normalize(torch.relu(hidden(seen)), dim=1)
        return costs[batch] * surprise(last(functional.dropout(active, DROPPED)), labels[batch])

    optimiser = torch.optim.AdamW([*hidden.parameters(), *last.parameters()], weight_decay=DECAY)
    descend(optimiser, cost, len(rows), (EPOCHS, RATE))
    return hidden, last


def surprise(logits: torch.Tensor, labels: torch.Tensor) -> torch.Tensor:
    """Return the smoothed surprise of each row."""
    return functional.cross_entropy(logits, labels, reduction="none", label_smoothing=SMOOTHING)


def descend(
    optimiser: torch.optim.Optimizer,
    cost: Callable[[torch.Tensor], torch.Tensor],
    count: int,
    schedule: tuple[int, float],
) -> None:
    """Take steps down the mean cost of batches of `count` rows; schedule: epochs, highest rate."""
    epochs, highest = schedule
    steps = count // BATCH
    rate = torch.optim.lr_scheduler.OneCycleLR(optimiser, highest, epochs * steps)
    for _ in range(epochs):
        for batch in torch.randperm(count)[: steps * BATCH].reshape(steps, BATCH):
            optimiser.zero_grad()
            cost(batch).mean().backward()  # type: ignore[no-untyped-call, unused-ignore]
            optimiser.step()
            rate.step()


def _unit(rows: Floats) -> Floats:
    raised = rows + np.float32(1e-6)
    return np.asarray(raised / np.linalg.norm(raised, axis=1, keepdims=True), np.float32)
