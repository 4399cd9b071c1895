"""The chart as a picture: error against seconds, and memory against seconds."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from hapticvlm.palette import BLUE, GREEN, SOFT, VERMILION
from hapticvlm_lab.bench import figures
from hapticvlm_lab.bench.ambient.rows import Row
from hapticvlm_lab.bench.labels import place

if TYPE_CHECKING:
    from matplotlib.axes import Axes

SIZE_IN = (12.0, 5.8)
STYLE = {  # colour and marker of each family
    "readout": (BLUE, "o"),
    "generation": (VERMILION, "s"),
    "remote": (GREEN, "^"),
    "wire": (SOFT, "x"),
    "constant": (SOFT, "_"),
}


def draw(rows: Sequence[Row], note: str, stem: Path) -> list[Path]:
    """Write `stem`.png and .svg; return both."""
    with figures.figure(stem, SIZE_IN, 2) as (drawn, (left, right)):
        heading = "Ambient temperature off one picture, every way in a process of its own."
        figures.title(drawn, f"{heading}\n{note}")
        _errors(left, rows)
        _memory(right, rows)
        _labels(left, rows, [row.score.mae_c if row.score else None for row in rows])
        _labels(right, rows, [row.timed.peak_mb if row.timed else None for row in rows])
    return figures.files(stem)


def _errors(axes: Axes, rows: Sequence[Row]) -> None:
    graded = [row for row in rows if row.score is not None]
    for row in graded:
        score = row.score
        assert score is not None
        if row.timed is None:
            interval = f"[{score.mae_low_c:.1f}, {score.mae_high_c:.1f}]"
            figures.level(axes, score.mae_c, f"{row.name} {score.mae_c:.1f} {interval}")
            continue
        colour, marker = STYLE[row.family]
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
        seconds = row.timed.median_s
        peak = row.timed.peak_mb
        axes.plot([seconds, row.timed.longest_s], [peak, peak], color=colour, alpha=0.5)
        axes.plot(seconds, peak, marker, color=colour, markersize=7)
        if row.is_default:
            figures.ring(axes, seconds, peak)
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
    axes.set_xscale("log")
    axes.set_xlim(figures.span([row.timed.median_s for row in rows if row.timed], 2, 4))
    axes.set(xlabel="median seconds an answer, one thread", ylabel=label, title=title)
