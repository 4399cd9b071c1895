"""The chart as a picture: error against seconds, and memory against seconds."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from hapticvlm.palette import BLUE, FIGURE, GREEN, GRID, INK, SOFT, VERMILION
from hapticvlm_lab.bench.ambient.rows import Row
from hapticvlm_lab.bench.material.labels import place

if TYPE_CHECKING:
    from matplotlib.axes import Axes

WIDTH_IN, HEIGHT_IN, DPI = 12.0, 5.8, 100
STYLE = {  # colour and marker of each family
    "readout": (BLUE, "o"),
    "generation": (VERMILION, "s"),
    "remote": (GREEN, "^"),
    "wire": (SOFT, "x"),
    "constant": (SOFT, "_"),
}


def draw(rows: Sequence[Row], note: str, stem: Path) -> list[Path]:
    """Write `stem`.png and .svg; return both."""
    import matplotlib as mpl

    mpl.use("Agg")
    from matplotlib import pyplot as plt

    with mpl.rc_context(dict(FIGURE)):
        figure, (left, right) = plt.subplots(
            1, 2, figsize=(WIDTH_IN, HEIGHT_IN), dpi=DPI, layout="constrained"
        )
        _errors(left, rows)
        _memory(right, rows)
        title = f"Ambient temperature off one picture, every way in a process of its own.\n{note}"
        figure.suptitle(title, fontsize=10.5, x=0.01, ha="left")
        figure.canvas.draw()
        _labels(left, rows, [row.score.mae_c if row.score else None for row in rows])
        _labels(right, rows, [row.timed.peak_mb if row.timed else None for row in rows])
        paths = [stem.with_suffix(".png"), stem.with_suffix(".svg")]
        figure.savefig(paths[0], dpi=DPI)
        figure.savefig(paths[1], metadata={"Date": None})
        plt.close(figure)
    return paths


def _errors(axes: Axes, rows: Sequence[Row]) -> None:
    graded = [row for row in rows if row.score is not None]
    for row in graded:
        score = row.score
        assert score is not None
        colour, marker = STYLE[row.family]
        if row.timed is None:
            axes.axhline(score.mae_c, color=colour, linewidth=0.8, linestyle="--")
            axes.annotate(
                f"{row.name} {score.mae_c:.1f} [{score.mae_low_c:.1f}, {score.mae_high_c:.1f}]",
                (1.0, score.mae_c),
                xycoords=("axes fraction", "data"),
                xytext=(0, 3),
                textcoords="offset points",
                ha="right",
                color=colour,
            )
            continue
        seconds = row.timed.median_s
        axes.vlines(seconds, score.mae_low_c, score.mae_high_c, color=colour, alpha=0.5)
        axes.plot(seconds, score.mae_c, marker, color=colour, markersize=7)
    _without_error(axes, [row for row in rows if row.timed and row.score is None])
    tops = [row.score.mae_high_c for row in graded if row.score]
    axes.set_ylim(0, 1.25 * max(tops, default=8.0))
    _tidy(axes, rows, "mean absolute error, degC", "Error")
    if not graded:
        text = "no labelled pictures: --data CSV"
        axes.text(0.5, 0.5, text, transform=axes.transAxes, ha="center", color=SOFT)


def _without_error(axes: Axes, rows: Sequence[Row]) -> None:
    """Mark the time of methods whose error means nothing or is not known, at the foot."""
    for row in rows:
        assert row.timed is not None
        colour, marker = STYLE[row.family]
        axes.plot(
            row.timed.median_s,
            0.02,
            marker,
            color=colour,
            markersize=7,
            markerfacecolor="white",
            transform=axes.get_xaxis_transform(),
            clip_on=False,
        )
    if rows:
        text = "hollow, at the foot: seconds alone, no error that means anything"
        axes.text(0.01, 0.06, text, transform=axes.transAxes, color=SOFT)


def _memory(axes: Axes, rows: Sequence[Row]) -> None:
    for row in rows:
        if row.timed is None or row.timed.peak_mb is None:
            continue
        colour, marker = STYLE[row.family]
        seconds, peak = row.timed.median_s, row.timed.peak_mb
        axes.plot([seconds, row.timed.longest_s], [peak, peak], color=colour, alpha=0.5)
        axes.plot(seconds, peak, marker, color=colour, markersize=7)
        if row.is_default:
            axes.plot(seconds, peak, "o", color=INK, markerfacecolor="none", markersize=13)
    axes.set_ylim(0, 1.15 * max(axes.get_ylim()[1], 1.0))
    _tidy(axes, rows, "peak memory of the process, MB", "Memory; line: median to longest")


def _labels(axes: Axes, rows: Sequence[Row], heights: Sequence[float | None]) -> None:
    """Name the dots, beside one another."""
    found = [
        (row.timed.median_s, y, _name(row), STYLE[row.family][0])
        for row, y in zip(rows, heights, strict=True)
        if row.timed is not None and y is not None
    ]
    place(axes, found, [(x, y) for x, y, _, _ in found])


def _name(row: Row) -> str:
    return f"{row.name} (default)" if row.is_default else row.name


def _tidy(axes: Axes, rows: Sequence[Row], label: str, title: str) -> None:
    times = [row.timed.median_s for row in rows if row.timed] or [1.0]
    axes.set_xscale("log")
    axes.set_xlim(min(times) / 2, max(times) * 4)
    axes.set(xlabel="median seconds an answer, one thread", ylabel=label)
    axes.set_title(title, fontsize=9.5, loc="left", color=INK)
    axes.grid(color=GRID, linewidth=0.6)
    axes.set_axisbelow(True)
    axes.spines[["top", "right"]].set_visible(False)
