"""Ways to fuse the looks at one object, to compare `recognition.fusion` with. All pure.

Each takes the looks of one object in order and gives the fused evidence after each of them.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from hapticvlm.measure.streams import Stream
from hapticvlm.recognition import fusion, ladder
from hapticvlm.recognition.gallery import Gallery
from hapticvlm.recognition.ladder import FLOOR, Evidence

Floats = NDArray[np.float32]

OPEN = "unknown"  # the class of what beliefs leave open


Way = Callable[[Stream, Gallery], list[Evidence]]


def ways() -> dict[str, Way]:
    """Return every way by name, the shipped one last."""
    return {
        "latest look": lambda stream, _: list(stream.evidence),
        "mean of the last 8": lambda stream, _: _window(stream.evidence, 8),
        "moving average, 1/4": lambda stream, _: _average(stream.evidence, 4),
        "moving average, 1/8": lambda stream, _: _average(stream.evidence, 8),
        "moving average, 1/32": lambda stream, _: _average(stream.evidence, 32),
        "geometric mean, 1/8": lambda stream, _: _geometric(stream.evidence, 8, 0.0),
        "product, root of 8 looks": lambda stream, _: _geometric(stream.evidence, 8, 0.5),
        "Bayes filter, 1/4, 5 %": lambda stream, _: _filter(stream.evidence, 0.25, 0.05),
        "mean embedding, 1/8": lambda stream, gallery: _embedding(stream, gallery, 8),
        "mean embedding, 1/32": lambda stream, gallery: _embedding(stream, gallery, 32),
        "1/32, weighed by size": lambda stream, _: _average(stream.evidence, 32, stream.size),
        "1/32, weighed by sharpness": lambda stream, _: _average(
            stream.evidence, 32, stream.sharpness
        ),
        "shipped": lambda stream, _: _shipped(stream.evidence),
    }


def _shipped(looks: Sequence[Evidence]) -> list[Evidence]:
    fused: fusion.Fused | None = None
    found = []
    for look in looks:
        fused = fusion.take_in(fused, look)
        found.append(fused.evidence)
    return found


def _window(looks: Sequence[Evidence], length: int) -> list[Evidence]:
    return [ladder.fuse(looks[max(0, end - length) : end]) for end in range(1, len(looks) + 1)]


def _average(
    looks: Sequence[Evidence], memory: int, weights: Floats | None = None
) -> list[Evidence]:
    """Average all looks, the newest counting 1 / memory at least; weights against their mean."""
    mean: dict[str, float] = {}
    mass, found = 0.0, []
    for number, look in enumerate(looks):
        weight = 1.0 if weights is None else float(weights[number] / weights[: number + 1].mean())
        mass = min(mass + weight, float(memory) - 1.0 + weight)
        share = weight / mass
        new = dict(look.beliefs)
        mean = {
            name: (1.0 - share) * mean.get(name, 0.0) + share * new.get(name, 0.0)
            for name in {*mean, *new}
        }
        found.append(_evidence(mean))
    return found


def _geometric(looks: Sequence[Evidence], memory: int, power: float) -> list[Evidence]:
    """Average log beliefs as they move on, times (looks remembered) ** power."""
    classes, rows = _full(looks)
    mean, found = np.zeros(len(classes)), []
    for number, row in enumerate(rows, 1):
        share = max(1.0 / number, 1.0 / memory)
        mean = (1.0 - share) * mean + share * np.log(row)
        found.append(_normal(classes, mean * min(number, memory) ** power))
    return found


def _filter(looks: Sequence[Evidence], exponent: float, hazard: float) -> list[Evidence]:
    """Bayes filter: what is shown changes with probability `hazard` between looks."""
    classes, rows = _full(looks)
    belief, found = np.full(len(classes), 1.0 / len(classes)), []
    for row in rows:
        before = (1.0 - hazard) * belief + hazard / len(classes)
        fused = _normal(classes, np.log(before) + exponent * np.log(row))
        belief = np.array([dict(fused.beliefs).get(name, 0.0) for name in classes])
        belief[-1] = max(0.0, 1.0 - belief[:-1].sum())
        found.append(fused)
    return found


def _embedding(stream: Stream, gallery: Gallery, memory: int) -> list[Evidence]:
    """Match the moving average of the embeddings instead."""
    mean, found = np.zeros_like(stream.embeddings[0]), []
    for number, embedding in enumerate(stream.embeddings, 1):
        share = np.float32(max(1.0 / number, 1.0 / memory))
        mean = (1 - share) * mean + share * embedding
        found.append(gallery.match(mean / np.linalg.norm(mean)))
    return found


def _full(looks: Sequence[Evidence]) -> tuple[list[str], list[NDArray[np.float64]]]:
    """List named classes, OPEN last, and beliefs; half of what is open goes to the named."""
    classes = [*sorted({name for look in looks for name, _ in look.beliefs}), OPEN]
    rows = []
    for look in looks:
        beliefs = dict(look.beliefs)
        rest = max(0.0, 1.0 - sum(beliefs.values()))
        row = [beliefs.get(name, 0.0) + rest / (2 * len(classes)) for name in classes[:-1]]
        rows.append(np.maximum(np.array([*row, rest / 2]), FLOOR))
    return classes, rows


def _normal(classes: Sequence[str], logs: NDArray[np.float64]) -> Evidence:
    powers = np.exp(logs - logs.max())
    powers /= powers.sum()
    return _evidence(dict(zip(classes[:-1], powers.tolist(), strict=False)))


def _evidence(beliefs: Mapping[str, float]) -> Evidence:
    kept = [item for item in beliefs.items() if item[1] >= FLOOR and math.isfinite(item[1])]
    return Evidence("encoder", tuple(sorted(kept, key=lambda item: (-item[1], item[0]))))
