"""What the named objects of a scene teach about its unnamed ones. Bounded; reads no picture.

Objects whose material is sure give embeddings of their pictures as references, which count for the
other objects of the scene alone:

    p'(m) ~ p(m) exp(w s_m),   s_m = log(mean_r exp(k x.r)) / k over the references r of m,

with cosines centred on the mean of all references, so that a scene's own style cancels; a material
without references has s_m = 0. A few references know less than the shipped gallery, so w grows with
the number of objects that teach. A scene's references are forgotten with the scene.
"""

from __future__ import annotations

from collections import OrderedDict, deque
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from hapticvlm.evidence.ladder import Evidence

Floats = NDArray[np.float32]

MAX_OBJECTS = 64  # that teach in one scene; the oldest makes room
MAX_VIEWS = 4  # of each
LEAST_OBJECTS = 2  # one object has nothing to be compared with
# objects; between them the weight grows
FEW = 5
MANY = 20
WEIGHTS = (2.0, 5.0)  # of few and of many: an independent study's choice, not fitted here
SHARPNESS = 8.0  # k


class SceneReferences:
    """The embeddings that the named objects of one scene gave."""

    def __init__(self) -> None:
        self._objects: OrderedDict[str, tuple[str, deque[Floats]]] = OrderedDict()

    def add(self, object_id: str, material: str, embedding: Floats) -> None:
        """Receive a picture (D,) of an object whose material is sure."""
        known, views = self._objects.pop(object_id, (material, deque(maxlen=MAX_VIEWS)))
        if known != material:
            views.clear()
        views.append(embedding)
        self._objects[object_id] = (material, views)
        if len(self._objects) > MAX_OBJECTS:
            self._objects.popitem(last=False)

    def adjust(self, evidence: Evidence, embedding: Floats, object_id: str | None) -> Evidence:
        """Return the evidence on a picture (D,) after what other objects of the scene teach."""
        others = [item for name, item in self._objects.items() if name != object_id]
        if len(others) < LEAST_OBJECTS or not evidence.beliefs:
            return evidence
        scores = _scores(others, embedding)
        # How much a scene may teach grows with how many of its objects do. Two named ones could
        # both be odd; twenty say what this scene's wood looks like better than any gallery.
        weight = float(np.interp(len(others), (0, FEW, MANY), (0.0, *WEIGHTS)))
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
    middle = rows.mean(axis=0)
    # All pictures of one scene resemble each other: the same light, the same renderer. Without
    # taking their mean away that likeness would swamp what tells materials apart.
    cosines = _unit(rows - middle) @ _unit(embedding[None] - middle)[0]
    return {
        str(name): float(np.log(np.exp(SHARPNESS * cosines[names == name]).mean()) / SHARPNESS)
        for name in np.unique(names)
    }


def _unit(rows: Floats) -> Floats:
    return np.asarray(rows / np.maximum(np.linalg.norm(rows, axis=1, keepdims=True), 1e-6))
