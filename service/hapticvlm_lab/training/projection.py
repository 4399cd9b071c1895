"""Which directions of a network's features become its embedding. Pure; numpy only.

The features and, beside them, what the heads for classes and names make of them (logits without
their mean) are cut to the directions in which pictures differ most (principal components). All of
it is linear, so it ships as the network's last matrix. Chosen on rooms and choose_web: LOG.md.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float32]
Affine = tuple[Floats, Floats]  # weights (D, F) and bias (D,) of a linear layer


def fit_projection(features: Floats, heads: Sequence[Affine], dimension: int) -> Affine:
    """Fit weights (dimension, F) and bias to features (N, F) of pictures and to their heads."""
    width = features.shape[1]
    maps, shifts = [np.eye(width)], [np.zeros(width)]
    for weights, bias in heads:
        maps.append((weights - weights.mean(axis=0)).T.astype(np.float64))
        shifts.append((bias - bias.mean()).astype(np.float64))
    widen, shift = np.hstack(maps), np.concatenate(shifts)
    wide = features.astype(np.float64) @ widen + shift
    mean = wide.mean(axis=0)
    _, axes = np.linalg.eigh(np.cov((wide - mean).T))
    strongest = axes[:, ::-1][:, :dimension]
    found = (widen @ strongest).T, (shift - mean) @ strongest
    return found[0].astype(np.float32), found[1].astype(np.float32)
