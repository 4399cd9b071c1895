"""One row of the chart: a method, its error and what it costs; and all rows as text."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from hapticvlm_lab.bench.ambient.timing import Timed
from hapticvlm_studio.evaluation.scores import Score


@dataclass(frozen=True, slots=True)
class Row:
    """None: what takes no time, what has no error that means anything, nothing to complain of."""

    name: str
    family: str
    is_default: bool
    timed: Timed | None
    score: Score | None
    why_not: str | None

    @property
    def answered(self) -> int:
        """How many pictures got a temperature."""
        if self.timed is None:
            return 0
        return sum(guess is not None for guess in self.timed.guesses)


def print_rows(rows: Sequence[Row], note: str) -> None:
    """Print the chart for a reader."""
    print(f"\n{note}")
    print(f"{'way':<34}{'median s':>9}{'longest':>9}{'load s':>8}{'peak MB':>9}  MAE, degC")
    for row in rows:
        mark = "* " if row.is_default else "  "
        print(f"{mark + row.name:<34}{_cost(row.timed)}  {_error(row)}")
    print("\n* the default. Brackets: 95 %. Each way ran in a process of its own, on one thread.")


def _cost(timed: Timed | None) -> str:
    if timed is None:
        return f"{'-':>9}{'-':>9}{'-':>8}{'-':>9}"
    peak = "-" if timed.peak_mb is None else f"{timed.peak_mb:.0f}"
    return f"{timed.median_s:>9.3g}{timed.longest_s:>9.3g}{timed.load_s:>8.1f}{peak:>9}"


def _error(row: Row) -> str:
    if row.score is not None:
        score = row.score
        return f"{score.mae_c:.1f} [{score.mae_low_c:.1f}, {score.mae_high_c:.1f}], n = {score.n}"
    return row.why_not or "-"
