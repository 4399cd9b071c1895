"""Adjusts evidence on a scene's unnamed objects by references to its named ones. Bounded.

Objects whose material is sure give embeddings of their pictures as references, which count only for
the other objects of the same scene:

    p'(m) ~ p(m) exp(w s_m),   s_m = log(mean_r exp(k x.r)) / k over the references r of m,

with cosines centred on the mean of all references, so that a scene's own style cancels; a material
without references has s_m = 0. A few references are worth less than the shipped gallery, so the
weight w grows with the number of objects that have any. For a picture of flat colours
(flatness.py) few references weigh twice as much, because the gallery says little there. Reads no
picture.
"""

from __future__ import annotations

from collections import OrderedDict, deque
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from hapticvlm.evidence.ladder import Evidence

Floats = NDArray[np.float32]

MAX_OBJECTS = 64  # with references in one scene; the oldest is dropped
MAX_VIEWS = 4  # of each object; the oldest is dropped
LEAST_OBJECTS = 2  # a single object cannot be compared with others
# Numbers of objects between which the weight grows.
FEW = 5
MANY = 20
WEIGHTS = (2.0, 5.0)  # w for FEW and for MANY objects; chosen in a separate study, not fitted here
FLAT_WEIGHTS = (4.0, 6.0)  # for pictures of flat colours; chosen on game kits (training/LOG.md)
SHARPNESS = 8.0  # k


class SceneReferences:
    """Embeddings of pictures of the named objects of one scene."""

    def __init__(self) -> None:
        self._objects: OrderedDict[str, tuple[str, deque[Floats]]] = OrderedDict()

    def add(self, object_id: str, material: str, embedding: Floats) -> None:
        """Add the embedding (D,) of a picture of an object whose material is sure."""
        known, views = self._objects.pop(object_id, (material, deque(maxlen=MAX_VIEWS)))
        if known != material:
            views.clear()
        views.append(embedding)
        self._objects[object_id] = (material, views)
        if len(self._objects) > MAX_OBJECTS:
            self._objects.popitem(last=False)

    def adjust(
        self,
        evidence: Evidence,
        embedding: Floats,
        object_id: str | None,
        *,
        is_flat: bool = False,
    ) -> Evidence:
        """Return evidence on an embedding (D,), adjusted by the references of other objects.

        `is_flat`: the picture has flat colours.
        """
        others = [item for name, item in self._objects.items() if name != object_id]
        if len(others) < LEAST_OBJECTS or not evidence.beliefs:
            return evidence
        scores = _scores(others, embedding)
        weights = FLAT_WEIGHTS if is_flat else WEIGHTS
        # Two named objects may both be unusual, but twenty show what wood looks like in this scene
        # better than any gallery. Hence the weight grows with the number of objects.
        weight = float(np.interp(len(others), (0, FEW, MANY), (0.0, *weights)))
        powers = [
            (name, belief * float(np.exp(weight * scores.get(name, 0.0))))
            for name, belief in evidence.beliefs
        ]
        unknown = max(0.0, 1.0 - sum(belief for _, belief in evidence.beliefs))
        total = sum(power for _, power in powers) + unknown
        ranked = sorted(powers, key=lambda item: -item[1])
        return Evidence(evidence.rung, tuple((name, power / total) for name, power in ranked))


def _scores(others: Sequence[tuple[str, deque[Floats]]], embedding: Floats) -> dict[str, float]:
    rows = np.stack([view for _, views in others for view in views])
    names = np.array([material for material, views in others for _ in views])
    mean = rows.mean(axis=0)
    # All pictures of one scene resemble each other, because they share its light and its renderer.
    # Subtracting their mean removes that resemblance, which is larger than the differences between
    # materials.
    cosines = _unit(rows - mean) @ _unit(embedding[None] - mean)[0]
    return {
        str(name): float(np.log(np.exp(SHARPNESS * cosines[names == name]).mean()) / SHARPNESS)
        for name in np.unique(names)
    }


def _unit(rows: Floats) -> Floats:
    return np.asarray(rows / np.maximum(np.linalg.norm(rows, axis=1, keepdims=True), 1e-6))
