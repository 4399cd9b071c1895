"""What training asks of an embedding: the teacher's view, its class, its neighbours."""

from __future__ import annotations

from dataclasses import dataclass

import torch
from torch import Tensor, nn
from torch.nn import functional

SCALE = 14.0  # of cosines before the softmax
SMOOTHING = 0.1
TEMPERATURE = 0.1


@dataclass(frozen=True, slots=True)
class Weights:
    """How much each loss counts."""

    distil: float = 1.0
    relate: float = 0.5
    classify: float = 0.4
    contrast: float = 0.0


class Heads(nn.Module):
    """What training puts on the network and leaves off afterwards."""

    def __init__(self, features: int, dimension: int, target: int, classes: int) -> None:
        super().__init__()
        self.teacher = nn.Linear(features, target)
        self.classes = nn.Parameter(torch.randn(classes, dimension) * 0.05)

    def losses(
        self, features: Tensor, embeddings: Tensor, targets: Tensor, labels: Tensor
    ) -> dict[str, Tensor]:
        """Losses of a batch; labels below 0 are not known."""
        known = labels >= 0
        unit = embeddings[known]
        logits = unit @ functional.normalize(self.classes, dim=1).T * SCALE
        return {
            "distil": 1 - functional.cosine_similarity(self.teacher(features), targets).mean(),
            "relate": _relate(embeddings, targets),
            "classify": functional.cross_entropy(logits, labels[known], label_smoothing=SMOOTHING),
            "contrast": _contrast(unit, labels[known]),
        }


def _relate(embeddings: Tensor, targets: Tensor) -> Tensor:
    """Mean squared difference of the batch's cosines, the student's and the teacher's."""
    ours, theirs = embeddings @ embeddings.T, targets @ targets.T
    off = ~torch.eye(len(ours), dtype=torch.bool)
    return ((ours - theirs)[off] ** 2).mean() * 10


def _contrast(unit: Tensor, labels: Tensor) -> Tensor:
    """Supervised contrastive loss (Khosla et al. 2020) over the batch's own positives."""
    same = (labels[:, None] == labels[None, :]).float()
    same.fill_diagonal_(0.0)
    logits = unit @ unit.T / TEMPERATURE
    logits = logits - torch.eye(len(unit)) * 1e4
    logs = logits - torch.logsumexp(logits, dim=1, keepdim=True)
    positives = same.sum(dim=1)
    each = -(same * logs).sum(dim=1)[positives > 0] / positives[positives > 0]
    return each.mean()
