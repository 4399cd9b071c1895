"""Draws a study's recognition and ratings with their intervals, reaction times."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from hapticvlm.palette import BLUE, GREY, GRID, INK, SOFT
from hapticvlm_studio.report.statistics import Share

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

DPI = 110
# By person is the interval that counts, so it is drawn boldly; Wilson's is thin and grey.
_BY_PERSON: Any = {"color": BLUE, "linewidth": 3.0, "solid_capstyle": "butt"}
_WILSON: Any = {"color": GREY, "linewidth": 1.5}
OUTLYING = 2.0  # times the 95th percentile: the axis of reaction times ends there
MIN_QUARTILES = 5  # answers, for quartiles to be drawn
MIN_SURE = 10  # answers; a share of fewer is drawn hollow


def recognition(
    path: Path,
    title: str,
    shares: Sequence[tuple[str, Share]],
    times: Sequence[NDArray[np.float64]] | None,
    chance: float,
) -> None:
    """Draw each pattern's recognition with both intervals and, if known, reaction times in s."""
    figure = _figure(12.0 if times else 7.5, 0.42 * len(shares) + 1.9)
    left, *right = figure.subplots(1, 2 if times else 1, sharey=True, squeeze=False)[0]
    _draw_shares(left, shares, chance)
    left.set_title(title, loc="left")
    if times:
        _draw_times(right[0], times)
        right[0].set_xlabel("reaction time from the first stroke, s")
        right[0].set_xlim(0.0, _longest_shown(times))
        beyond = sum(int((each > right[0].get_xlim()[1]).sum()) for each in times)
        more = f"; {beyond} beyond the axis" if beyond else ""
        right[0].set_title(f"all answers, right or wrong{more}", loc="left")
        right[0].grid(axis="x", color=GRID)
    left.set_yticks(np.arange(len(shares)), [name for name, _ in shares])
    left.set_ylim(len(shares) - 0.5, -0.5)
    figure.savefig(path, dpi=DPI)


def ratings(path: Path, title: str, rated: Sequence[dict[str, Any]]) -> None:
    """Draw each pattern's mean rating with its interval by person, one panel per rating."""
    names = [each["name"] for each in rated[0]["patterns"]]
    figure = _figure(3.0 + 3.6 * len(rated), 0.42 * len(names) + 1.5)
    panels = figure.subplots(1, len(rated), sharey=True, squeeze=False)[0]
    for axes, rating in zip(panels, rated, strict=True):
        for row, each in enumerate(rating["patterns"]):
            if each["by_person"] is not None:
                axes.plot(each["by_person"], [row] * 2, **_BY_PERSON)
            if each["mean"] is not None:
                axes.plot(each["mean"], row, "o", color=INK, markersize=6)
        axes.set_xlim(0.8, rating["steps"] + 0.2)
        axes.set_xlabel(f"{rating['name']}, 1 to {rating['steps']}")
        axes.grid(axis="x", color=GRID)
    panels[0].set_yticks(np.arange(len(names)), names)
    panels[0].set_ylim(len(names) - 0.5, -0.5)
    panels[0].set_title(title, loc="left")
    panels[-1].plot([], [], **_BY_PERSON, label="95 % by person, Student's t")
    _legend(panels[-1])
    figure.savefig(path, dpi=DPI)


def _draw_times(axes: Axes, times: Sequence[NDArray[np.float64]]) -> None:
    """Draw a box plot where there are enough answers for quartiles, else each answer."""
    enough = [(row, each) for row, each in enumerate(times) if len(each) >= MIN_QUARTILES]
    if enough:
        axes.boxplot(
            [each for _, each in enough], positions=[row for row, _ in enough], widths=0.55,
            orientation="horizontal", manage_ticks=False,
            medianprops={"color": BLUE, "linewidth": 2}, flierprops={"markersize": 3},
        )  # fmt: skip
    for row, each in enumerate(times):
        if len(each) < MIN_QUARTILES:
            axes.plot(each, [row] * len(each), "o", color=BLUE, markersize=4, fillstyle="none")


def _longest_shown(times: Sequence[NDArray[np.float64]]) -> float | None:
    """Return the end of the axis in s: one answer after a break must not squeeze the others."""
    every = np.concatenate(list(times))
    if not every.size:
        return None
    # "lower" picks an answer that was given. Interpolated, a single outlier among few answers would
    # pull the quantile towards itself and be shown after all.
    usual = OUTLYING * float(np.quantile(every, 0.95, method="lower"))
    return usual if every.max() > usual > 0.0 else None


def _dot(axes: Axes, value: float, row: float, count: int) -> None:
    """Draw a value, hollow where it rests on fewer than MIN_SURE answers."""
    fill = "full" if count >= MIN_SURE else "none"
    axes.plot(value, row, "o", color=INK, markersize=6, fillstyle=fill)


def _draw_shares(axes: Axes, shares: Sequence[tuple[str, Share]], chance: float) -> None:
    for row, (_, share) in enumerate(shares):
        # Both intervals are drawn, one above the other: where the one by person is much longer,
        # people differ, and the other must not be used.
        gap = 0.12 if share.by_person else 0.0
        intervals = ((share.wilson, gap, _WILSON), (share.by_person, -gap, _BY_PERSON))
        for interval, offset, style in intervals:
            if interval is not None:
                axes.plot([100 * end for end in interval], [row + offset] * 2, **style)
        if share.share is not None:
            _dot(axes, 100 * share.share, row, share.of)
    axes.axvline(100 * chance, color=SOFT, linestyle=":")
    if any(share.by_person for _, share in shares):
        axes.plot([], [], **_BY_PERSON, label="95 % by person, t on the logit")
    axes.plot([], [], **_WILSON, label="95 % Wilson, assumes independent trials")
    axes.plot([], [], color=SOFT, linestyle=":", label="chance")
    axes.set_xlim(0.0, 101.0)
    axes.set_xlabel("recognised, %")
    axes.grid(axis="x", color=GRID)
    if any(0 < share.of < MIN_SURE for _, share in shares):
        axes.plot([], [], "o", color=INK, fillstyle="none", label=f"fewer than {MIN_SURE} trials")
    _legend(axes)


def _legend(axes: Axes) -> None:
    """Draw the legend below the axes, where it covers no data."""
    handles, labels = axes.get_legend_handles_labels()
    axes.figure.legend(
        handles, labels, loc="outside lower left", ncols=3, fontsize=8, frameon=False
    )


def _figure(width: float, height: float) -> Figure:
    """Return a figure of this size in inches; it needs no display."""
    from matplotlib.figure import Figure

    return Figure(figsize=(width, height), layout="constrained")
