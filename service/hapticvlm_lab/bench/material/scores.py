"""Scores of answers: balanced accuracy with its interval, recall and confusion. Pure.

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

from hapticvlm.statistics import wilson

Words = NDArray[np.str_]
Doubles = NDArray[np.float64]

SILENT = ""  # an answer that names nothing; counts as wrong


@dataclass(frozen=True, slots=True)
class Score:
    """Balanced accuracy 0..1 over `classes` (objects of each), its 95 % interval and its parts.

    n counts answers: pictures, or objects where views are fused.
    """

    accuracy: float
    low: float
    high: float
    n: int
    classes: Mapping[str, int]
    recall: Mapping[str, float]
    confusion: Mapping[str, Mapping[str, int]]


@dataclass(frozen=True, slots=True)
class Open:
    """Answers that may be "unknown": share named, and share of that right (None: never named)."""

    n: int
    coverage: float
    accuracy: float | None
    low: float
    high: float
    wrong_and_sure: float


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
    return Score(
        accuracy, low, high, int(rows.sum()), counts, recall, confusion(answers, truth, rows)
    )


def interval(accuracy: float, objects: Sequence[int]) -> tuple[float, float]:
    """Return the 95 % interval of a balanced accuracy over classes of so many objects."""
    trials = len(objects) ** 2 / sum(1.0 / count for count in objects)
    return wilson(accuracy * trials, trials)


def confusion(answers: Words, truth: Words, rows: NDArray[np.bool_]) -> dict[str, dict[str, int]]:
    """Count answers by truth; a silent one under "-"."""
    table: dict[str, dict[str, int]] = {}
    for true, answer in zip(truth[rows].tolist(), answers[rows].tolist(), strict=True):
        cells = table.setdefault(true, {})
        cells[answer or "-"] = cells.get(answer or "-", 0) + 1
    return table


def open_score(spoken: Words, sure: NDArray[np.bool_], truth: Words, objects: Words) -> Open:
    """Grade answers that may be SILENT, on objects of a known material."""
    spoke = spoken != SILENT
    right = spoken == truth
    among = len(set(objects[spoke].tolist()))
    accuracy = float(right[spoke].mean()) if spoke.any() else None
    low, high = wilson((accuracy or 0.0) * among, among)
    wrong = float((sure & spoke & ~right).mean()) if truth.size else 0.0
    return Open(truth.size, float(spoke.mean()), accuracy, low, high, wrong)
