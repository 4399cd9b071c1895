"""Draws estimates against true temperatures, and how often intervals contain the truth."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from hapticvlm.evidence.reading import COVERAGE
from hapticvlm.palette import BLUE, FIGURE, GRID, INK, SOFT, VERMILION
from hapticvlm_studio.evaluation.grades import Outcome
from hapticvlm_studio.evaluation.scores import TOLERANCE_C

if TYPE_CHECKING:
    from matplotlib.axes import Axes

WIDTH_IN = 12.0
HEIGHT_IN = 5.6
DPI = 100
MARGIN_C = 6.0
MARKERS = "osD^vPX"  # of sources, in turn


def draw(outcome: Outcome, method: str, stem: Path) -> list[Path]:
    """Write `stem`.png and .svg and return both paths, or [] where nothing was answered."""
    import matplotlib as mpl

    if outcome.score is None:
        return []
    mpl.use("Agg")
    from matplotlib import pyplot as plt

    with mpl.rc_context(dict(FIGURE)):
        figure, (left, right) = plt.subplots(
            1, 2, figsize=(WIDTH_IN, HEIGHT_IN), dpi=DPI, layout="constrained"
        )
        _scatter(left, outcome)
        _calibration(right, outcome)
        figure.suptitle(_title(outcome, method), fontsize=10.5, x=0.01, ha="left")
        paths = [stem.with_suffix(".png"), stem.with_suffix(".svg")]
        figure.savefig(paths[0], dpi=DPI)
        figure.savefig(paths[1], metadata={"Date": None})
        plt.close(figure)
    return paths


def _title(outcome: Outcome, method: str) -> str:
    ours = outcome.score
    theirs = outcome.constants[outcome.best]
    assert ours is not None
    return (
        f"Ambient temperature by {method}: mean absolute error {ours.mae_c:.1f} degC "
        f"[{ours.mae_low_c:.1f}, {ours.mae_high_c:.1f}] over n = {ours.n}; "
        f"best constant guess ({outcome.best}) {theirs.mae_c:.1f} degC "
        f"[{theirs.mae_low_c:.1f}, {theirs.mae_high_c:.1f}]."
    )


def _scatter(axes: Axes, outcome: Outcome) -> None:
    answered = [
        (answer.labelled, answer.guess) for answer in outcome.answers if answer.guess is not None
    ]
    temperatures = [
        t for labelled, guess in answered for t in (labelled.truth_c, guess.low_c, guess.high_c)
    ]
    low = min(temperatures) - MARGIN_C
    high = max(temperatures) + MARGIN_C
    line = np.array([low, high])
    axes.fill_between(
        line, line - TOLERANCE_C, line + TOLERANCE_C, color=GRID, label="within 8 degC"
    )
    axes.plot(line, line, color=SOFT, linewidth=0.8)
    for at, source in enumerate(outcome.sources):
        pairs = [(labelled, guess) for labelled, guess in answered if labelled.source == source]
        true = np.array([labelled.truth_c for labelled, _ in pairs])
        guessed = np.array([guess.value_c for _, guess in pairs])
        ends = [(guess.low_c, guess.high_c) for _, guess in pairs]
        axes.vlines(true, *zip(*ends, strict=True), color=BLUE, linewidth=1.0, alpha=0.4)
        axes.plot(true, guessed, MARKERS[at % len(MARKERS)], color=BLUE, markersize=5, label=source)
    axes.set(xlim=(low, high), ylim=(low, high), aspect="equal")
    axes.set(xlabel="true air temperature, degC", ylabel="estimate with its interval, degC")
    axes.legend(loc="upper left", frameon=False)
    _tidy(axes, "Estimates")


def _calibration(axes: Axes, outcome: Outcome) -> None:
    stated, held = (100 * np.array(column) for column in zip(*outcome.calibration, strict=True))
    assert outcome.score is not None
    coverage = outcome.score.interval_coverage
    axes.plot([0, 100], [0, 100], color=SOFT, linewidth=0.8, label="as stated")
    axes.plot(
        stated,
        held,
        "o-",
        color=BLUE,
        markersize=4,
        label="intervals scaled as of a normal distribution",
    )
    axes.vlines(100 * COVERAGE, 100 * coverage.low, 100 * coverage.high, color=VERMILION, alpha=0.6)
    axes.plot(
        100 * COVERAGE,
        100 * coverage.share,
        "D",
        color=VERMILION,
        markersize=7,
        label="stated interval, with 95 % interval",
    )
    axes.set(xlim=(0, 100), ylim=(0, 102), aspect="equal")
    axes.set(xlabel="stated coverage of an interval, %", ylabel="truths inside, %")
    axes.legend(loc="upper left", frameon=False)
    _tidy(axes, "Calibration (below the line: intervals too narrow)")


def _tidy(axes: Axes, title: str) -> None:
    axes.set_title(title, fontsize=9.5, loc="left", color=INK)
    axes.grid(color=GRID, linewidth=0.6)
    axes.set_axisbelow(True)
    axes.spines[["top", "right"]].set_visible(False)
