"""What a crop may look like before it is another crop: cut, mirrored, lit, mixed.

The teachers' answers are computed once, so a variation must stay small enough for them to fit.
"""

from __future__ import annotations

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor
from torch.nn import functional

MIXED = 0.4  # share of batches whose crops and targets are mixed (Zhang et al. 2018)
MIX = 0.4  # both parameters of the beta distribution of the mix
SIDES = (128, 128, 120, 112, 104)  # px of the pool's crops that a batch uses


def vary(crops: NDArray[np.uint8], side: int, rng: np.random.Generator) -> Tensor:
    """Cut, mirror and light (N, S, S, 4) so little that the teachers' answers still fit."""
    given, size = torch.from_numpy(crops), crops.shape[1]
    chosen = rng.choice(SIDES, len(crops)) * size // max(SIDES)
    varied = torch.empty(len(crops), side, side, 4, dtype=torch.uint8)
    for edge in np.unique(chosen).tolist():
        rows = np.flatnonzero(chosen == edge)
        top, left = rng.integers(0, size + 1 - edge, 2)
        varied[rows] = resize(given[rows][:, top : top + edge, left : left + edge], side)
    mirrored = torch.from_numpy(rng.random(len(crops)) < 0.5)
    varied[mirrored] = varied[mirrored].flip(2)
    tint = rng.normal(0, 0.05, (len(crops), 1, 1, 3)) + rng.normal(0, 0.15, (len(crops), 1, 1, 1))
    lit = varied[..., :3].float() * torch.from_numpy(np.exp(tint)).float()
    varied[..., :3] = lit.clamp(0, 255).byte()
    return varied


def mix(
    planes: Tensor, wanted: dict[str, Tensor], known: Tensor, rng: np.random.Generator
) -> tuple[Tensor, dict[str, Tensor], Tensor]:
    """Mix a share of the batches, crops and targets alike; leave the others as they are."""
    if rng.random() >= MIXED:
        return planes, wanted, known
    share = float(rng.beta(MIX, MIX))
    share = max(share, 1 - share)
    other = torch.from_numpy(rng.permutation(len(planes)))
    mixed = {name: share * rows + (1 - share) * rows[other] for name, rows in wanted.items()}
    return share * planes + (1 - share) * planes[other], mixed, known * known[other]


def resize(crops: NDArray[np.uint8] | Tensor, side: int) -> Tensor:
    """Make (N, S, S, 4) crops (N, side, side, 4)."""
    given = torch.from_numpy(crops) if isinstance(crops, np.ndarray) else crops
    if given.shape[1] == side:
        return given
    planes = functional.interpolate(
        given.permute(0, 3, 1, 2).float(),
        (side, side),
        mode="bilinear",
        antialias=given.shape[1] > side,
        align_corners=False,
    )
    return planes.round().clamp(0, 255).byte().permute(0, 2, 3, 1)
