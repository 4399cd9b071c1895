"""Scores of answers: balanced accuracy with its interval, and recall. Pure.

Pictures of one object are wrong together, so an interval that counted pictures would be far too
narrow. It counts objects instead: Wilson's interval for the balanced accuracy p over

    m = C^2 / sum_c(1 / m_c)

trials, where m_c objects show class c. The balanced accuracy is a mean of C shares, and the
variance of such a mean is sum_c(p (1 - p) / m_c) / C^2, which is p (1 - p) / m. With classes of
equal size m is the number of all objects; a class of one object alone keeps the interval wide.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hapticvlm import materials
from hapticvlm.statistics import wilson

Words = NDArray[np.str_]
Doubles = NDArray[np.float64]

SILENT = ""  # an answer that names nothing; counts as wrong


@dataclass(frozen=True, slots=True)
class Score:
    """Balanced accuracy 0..1 of n pictures over `classes` (objects of each); 95 % interval."""

    accuracy: float
    low: float
    high: float
    n: int
    classes: Mapping[str, int]
    recall: Mapping[str, float]


@dataclass(frozen=True, slots=True)
class Open:
    """Answers that may be "unknown": share named, and share of that right (None: never named)."""

    n: int
    coverage: float
    accuracy: float | None


def score(answers: Words, truth: Words, objects: Words, classes: Sequence[str]) -> Score | None:
    """Grade forced answers over the classes that occur; None if none does."""
    rows = np.isin(truth, classes)
    present = [name for name in classes if (truth == name).any()]
    if not present:
        return None
    # Recall first, its mean over classes second: a class of few pictures counts as much as any.
    counts = {name: len(set(objects[truth == name].tolist())) for name in present}
    recall = {name: float((answers == name)[truth == name].mean()) for name in present}
    accuracy = float(np.mean(list(recall.values())))
    low, high = interval(accuracy, list(counts.values()))
    return Score(accuracy, low, high, int(rows.sum()), counts, recall)


def interval(accuracy: float, objects: Sequence[int]) -> tuple[float, float]:
    """Return the 95 % interval of a balanced accuracy over classes of so many objects."""
    trials = len(objects) ** 2 / sum(1.0 / count for count in objects)
    return wilson(accuracy * trials, trials)


def open_score(spoken: Words, truth: Words) -> Open | None:
    """Grade answers that may be SILENT, on objects of a known material; None if there is none."""
    known = truth != materials.UNKNOWN
    spoke = known & (spoken != SILENT)
    if not known.any():
        return None
    accuracy = float((spoken == truth)[spoke].mean()) if spoke.any() else None
    return Open(int(known.sum()), float(spoke[known].mean()), accuracy)
