"""A linear layer fitted to embeddings: logistic regression with an L2 penalty. Pure."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize

from hapticvlm.recognition.galleries.gallery import LinearLayer, log_softmax

Floats = NDArray[np.float32]
Doubles = NDArray[np.float64]
Indices = NDArray[np.int64]

STEPS = 300


def fit_layer(embeddings: Floats, labels: Indices, weights: Doubles, penalty: float) -> LinearLayer:
    """Fit to (N, D) embeddings of classes 0..C-1; weights (N,) sum to 1."""
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
    found = minimize(loss, start, jac=True, method="L-BFGS-B", options={"maxiter": STEPS}).x
    parameters = found.reshape(rows.shape[1], -1).astype(np.float32)
    return LinearLayer(parameters[:-1], parameters[-1])
