"""Logistic regression of several classes: standardised features, classes weighed alike, L2.

Loss: mean over classes of the mean surprise of their rows + PENALTY / 2 |W|^2, W for features
scaled to a typical squared length of 1, by L-BFGS. With more features than rows it is solved in
their span, which is exact: a penalised optimum has no part outside it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Doubles = NDArray[np.float64]

PENALTY = 3e-3
STEPS = 150


@dataclass(frozen=True, slots=True)
class Logistic:
    """centre (F,), scale (F,), weights (F, C), bias (C,)."""

    centre: Doubles
    scale: Doubles
    weights: Doubles
    bias: Doubles

    def probabilities(self, features: NDArray[np.float32]) -> Doubles:
        """(N, F) features to (N, C) probabilities."""
        logits = (features - self.centre) / self.scale @ self.weights + self.bias
        return _softmax(logits)


def fit(features: NDArray[np.float32], labels: NDArray[np.int64]) -> Logistic:
    """Fit (N, F) features to (N,) labels 0..C-1, each present."""
    from scipy.optimize import minimize

    rows, width = features.shape
    centre = features.mean(axis=0, dtype=np.float64)
    scale = (features.std(axis=0, dtype=np.float64) + 1e-6) * np.sqrt(width)
    x = (features - centre) / scale
    basis = np.linalg.svd(x, full_matrices=False)[2].T if width > rows else np.eye(width)
    reduced = x @ basis
    targets = np.eye(int(labels.max()) + 1)[labels]
    weight = targets @ (1.0 / targets.sum(axis=0)) / targets.shape[1]
    found = minimize(
        _loss,
        np.zeros((reduced.shape[1] + 1) * targets.shape[1]),
        args=(reduced, targets, weight),
        jac=True,
        method="L-BFGS-B",
        options={"maxiter": STEPS},
    ).x.reshape(-1, targets.shape[1])
    return Logistic(centre, scale, basis @ found[:-1], found[-1])


def _loss(
    flat: Doubles, x: Doubles, targets: Doubles, weight: Doubles
) -> tuple[float, NDArray[np.float64]]:
    parameters = flat.reshape(-1, targets.shape[1])
    believed = _softmax(x @ parameters[:-1] + parameters[-1])
    surprise = -np.log(np.maximum((believed * targets).sum(axis=1), 1e-12))
    slope = (believed - targets) * weight[:, None]
    gradient = np.vstack([x.T @ slope + PENALTY * parameters[:-1], slope.sum(axis=0)])
    loss = float(weight @ surprise) + PENALTY / 2 * float((parameters[:-1] ** 2).sum())
    return loss, gradient.ravel()


def _softmax(logits: Doubles) -> Doubles:
    powers = np.exp(logits - logits.max(axis=1, keepdims=True))
    return np.asarray(powers / powers.sum(axis=1, keepdims=True))
