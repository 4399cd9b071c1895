"""One row of the chart: a method on a source, all protocols, and its cost."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from hapticvlm_lab.bench.material.scores import Open, Rejection, Score
from hapticvlm_lab.bench.material.timing import Cost
from hapticvlm_lab.bench.pareto import pareto

PICTURE_FAMILIES = ("plain", "named", "ours")  # families that see the picture alone


@dataclass(frozen=True, slots=True)
class Enrolment:
    """With so many references a class: among FOUR, among all, and unknown against all."""

    four: Score | None
    eleven: Score | None
    unknown: Rejection | None


@dataclass(frozen=True, slots=True)
class Row:
    """What could not be measured is None: no reference, no second object, nothing unknown.

    views: mean views per decision, by which `latency_ms` multiplies the cost of one.
    """

    source: str
    method: str
    family: str
    is_default: bool
    cut: str
    views: float
    references: str
    four: Score | None
    eleven: Score | None
    open: Open | None
    unknown: Rejection | None
    enrolled: Mapping[str, Enrolment]
    probe: Score | None
    cost: Cost | None

    @property
    def latency_ms(self) -> float | None:
        """Median time of one core for one decision, ms; None for what takes no time."""
        return None if self.cost is None else self.cost.median * self.views


def knee(rows: Sequence[Row]) -> tuple[Row, Row] | None:
    """Find the best zero-shot method on pictures, and the cheapest whose interval reaches it.

    None where nothing was timed and graded.
    """
    graded = [row for row in rows if row.family in PICTURE_FAMILIES and row.four and row.latency_ms]
    if not graded:
        return None
    best = max(graded, key=_accuracy)
    reaching = [row for row in graded if row.four and row.four.high >= _accuracy(best)]
    return best, min(reaching, key=lambda row: row.latency_ms or 0.0)


def undominated(rows: Sequence[Row]) -> list[Row]:
    """Return the rows that no cheaper one is as accurate as, zero-shot, of 4; cheapest first."""
    timed = [row for row in rows if row.four is not None and row.latency_ms is not None]
    return pareto(timed, lambda row: row.latency_ms or 0.0, _accuracy)


def weakness(rows: Sequence[Row]) -> tuple[str, float] | None:
    """Return the class that the default finds least often, and how often; None if not graded."""
    default = next((row.four for row in rows if row.is_default and row.four is not None), None)
    if default is None:
        return None
    return min(default.recall.items(), key=lambda item: (item[1], item[0]))


def _accuracy(row: Row) -> float:
    return row.four.accuracy if row.four else 0.0
