"""Stability as small multiples: a panel per perturbation, a figure per source."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from hapticvlm.palette import BLUE, GREEN, GRID, INK, ORANGE, SOFT, VERMILION
from hapticvlm_lab.bench.material.breaks import CHANCE, Curve

if TYPE_CHECKING:
    from matplotlib.axes import Axes

WIDTH_IN, PANEL_IN, DPI = 12.0, 2.5, 100  # 1200 px wide
COLUMNS = 4
LINES = (  # field, label, colour, line and marker
    ("accuracy", "right of 4, zero-shot", BLUE, "-o"),
    ("enrolled", "right of 4, enrolled", GREEN, "-s"),
    ("flips", "answer changed (zero-shot)", ORANGE, "--^"),
    ("wrong_and_sure", "wrong and sure", VERMILION, ":x"),
)


def draw(source: str, found: Sequence[Curve], stem: Path) -> list[Path]:
    """Write `stem`-source.png and .svg; return both."""
    import matplotlib as mpl

    mpl.use("Agg")
    from matplotlib import pyplot as plt

    rows = -(-len(found) // COLUMNS)
    with mpl.rc_context({"font.size": 8.5, "svg.hashsalt": "hapticvlm", "svg.fonttype": "none"}):
        figure, grid = plt.subplots(
            rows,
            COLUMNS,
            figsize=(WIDTH_IN, PANEL_IN * rows + 0.8),
            dpi=DPI,
            sharey=True,
            squeeze=False,
            layout="constrained",
        )
        panels = list(grid.ravel())
        for axes in panels[len(found) :]:
            axes.set_axis_off()
        for axes, curve in zip(panels, found, strict=False):
            _panel(axes, curve)
        for row in grid:
            row[0].set_ylabel("% of pictures")
        figure.suptitle(
            f"{source}: the default as its pictures get worse", fontsize=10.5, x=0.01, ha="left"
        )
        handles, texts = panels[0].get_legend_handles_labels()
        figure.legend(handles, texts, loc="upper right", ncols=len(LINES) + 1, frameon=False)
        name = f"{stem.name}-{source}"
        paths = [stem.with_name(f"{name}.png"), stem.with_name(f"{name}.svg")]
        figure.savefig(paths[0], dpi=DPI)
        figure.savefig(paths[1], metadata={"Date": None})
        plt.close(figure)
    return paths


def _panel(axes: Axes, curve: Curve) -> None:
    at = [step.severity for step in curve.steps]
    low, high = ([100 * edge for edge in edges] for edges in _interval(curve))
    axes.fill_between(at, low, high, color=LINES[0][2], alpha=0.12, linewidth=0)
    for field, label, colour, style in LINES:
        values = [100 * float(getattr(step, field)) for step in curve.steps]
        axes.plot(at, values, style, color=colour, markersize=4, linewidth=1.4, label=label)
    axes.axhline(100 * CHANCE, color=SOFT, linewidth=0.8, linestyle="--", label="chance")
    breaks = curve.breaks_at()
    if breaks is not None:
        axes.axvline(breaks, color=LINES[0][2], linewidth=0.8, linestyle=":")
    axes.set_title(f"{curve.name} (n = {curve.n})", fontsize=9, loc="left", color=INK)
    axes.set_xlabel(curve.unit)
    axes.set_xticks(at)
    axes.set_ylim(-3, 103)
    axes.grid(color=GRID, linewidth=0.6)
    axes.spines[["top", "right"]].set_visible(False)


def _interval(curve: Curve) -> tuple[list[float], list[float]]:
    return [step.low for step in curve.steps], [step.high for step in curve.steps]
