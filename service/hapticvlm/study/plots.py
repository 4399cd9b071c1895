"""Pictures of a study: confusion matrices, recognition with intervals, reaction times."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from hapticvlm.study.statistics import Share

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Matrix = tuple[list[str], NDArray[np.int64]]
DPI = 110
_INK, _MARK, _SOFT = "#15202b", "#1d5b8f", "#8795a3"


def confusion(path: Path, title: str, whole: Matrix, parts: Sequence[tuple[str, Matrix]]) -> None:
    """Draw the matrix of all patterns, and beside it those of its factors."""
    figure = _figure(13.0, 7.2)
    grid = figure.add_gridspec(2, 2, width_ratios=(2.1, 1.0))
    _draw_matrix(figure.add_subplot(grid[:, 0]), title, whole)
    for at, (name, matrix) in enumerate(parts[:2]):
        _draw_matrix(figure.add_subplot(grid[at, 1]), name, matrix)
    figure.savefig(path, dpi=DPI)


def recognition(
    path: Path,
    title: str,
    shares: Sequence[tuple[str, Share]],
    times: Sequence[NDArray[np.float64]] | None,
    chance: float,
) -> None:
    """Draw recognition of each pattern with both intervals and, if known, reaction times in s."""
    figure = _figure(12.0 if times else 7.5, 0.42 * len(shares) + 1.9)
    left, *right = figure.subplots(1, 2 if times else 1, sharey=True, squeeze=False)[0]
    _draw_shares(left, shares, chance)
    left.set_title(title, loc="left")
    if times:
        rows = np.arange(len(shares))
        right[0].boxplot(
            list(times), positions=list(rows), orientation="horizontal", widths=0.55,
            medianprops={"color": _MARK, "linewidth": 2}, flierprops={"markersize": 3},
        )  # fmt: skip
        right[0].set_xlabel("reaction time from the first stroke, s")
        right[0].set_xlim(left=0.0)
        right[0].set_title("all answers, right or wrong", loc="left")
    left.set_yticks(np.arange(len(shares)), [name for name, _ in shares])
    left.set_ylim(len(shares) - 0.5, -0.5)
    figure.savefig(path, dpi=DPI)


def _draw_shares(axes: Axes, shares: Sequence[tuple[str, Share]], chance: float) -> None:
    for row, (_, share) in enumerate(shares):
        apart = 0.12 if share.by_person else 0.0
        intervals = ((share.wilson, apart, _MARK), (share.by_person, -apart, _SOFT))
        for interval, offset, colour in intervals:
            if interval is not None:
                ends = [100 * end for end in interval]
                axes.plot(ends, [row + offset] * 2, color=colour, linewidth=2.5)
        if share.share is not None:
            axes.plot(100 * share.share, row, "o", color=_INK, markersize=6)
    axes.axvline(100 * chance, color=_SOFT, linestyle=":")
    axes.plot([], [], color=_MARK, linewidth=2.5, label="95 % Wilson, trials independent")
    if any(share.by_person for _, share in shares):
        axes.plot([], [], color=_SOFT, linewidth=2.5, label="95 % by person, t on the logit")
    axes.plot([], [], color=_SOFT, linestyle=":", label="chance")
    axes.set_xlim(0.0, 101.0)
    axes.set_xlabel("recognised, %")
    axes.grid(axis="x", alpha=0.3)
    handles, labels = axes.get_legend_handles_labels()
    axes.figure.legend(
        handles, labels, loc="outside lower left", ncols=3, fontsize=8, frameon=False
    )


def _draw_matrix(axes: Axes, title: str, matrix: Matrix) -> None:
    names, counts = matrix
    totals = counts.sum(axis=1, keepdims=True)
    shares = np.divide(counts, totals, out=np.zeros(counts.shape), where=totals > 0)
    axes.imshow(shares, vmin=0.0, vmax=1.0, cmap="Blues", aspect="auto")
    for i, j in zip(*np.nonzero(counts), strict=True):
        colour = "white" if shares[i, j] > 0.55 else _INK
        axes.text(j, i, str(counts[i, j]), ha="center", va="center", color=colour, fontsize=9)
    axes.set_xticks(range(len(names)), names, rotation=40, ha="right", rotation_mode="anchor")
    axes.set_yticks(range(len(names)), names)
    axes.set_xlabel("answered")
    axes.set_ylabel("presented")
    axes.set_title(title, loc="left", fontsize=11)


def _figure(width: float, height: float) -> Figure:
    """Make a figure that no screen is needed for, inches."""
    from matplotlib.figure import Figure

    return Figure(figsize=(width, height), layout="constrained")
