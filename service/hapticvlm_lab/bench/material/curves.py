"""Stability as small multiples: a panel per perturbation, a figure per source."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from hapticvlm.palette import BLUE, GREEN, ORANGE, SOFT, VERMILION
from hapticvlm_lab.bench import figures
from hapticvlm_lab.bench.material.breaks import CHANCE, Curve

if TYPE_CHECKING:
    from matplotlib.axes import Axes

WIDTH_IN = 12.0
PANEL_IN = 2.5
COLUMNS = 4
LINES = (  # field, label, colour, line and marker
    ("accuracy", "right of 4, zero-shot", BLUE, "-o"),
    ("enrolled", "right of 4, enrolled", GREEN, "-s"),
    ("flips", "answer changed (zero-shot)", ORANGE, "--^"),
    ("wrong_and_sure", "wrong and sure", VERMILION, ":x"),
)


def draw(source: str, found: Sequence[Curve], stem: Path) -> list[Path]:
    """Write `stem`-source.png and .svg; return both."""
    stem = stem.with_name(f"{stem.name}-{source}")
    rows = -(-len(found) // COLUMNS)
    size_in = (WIDTH_IN, PANEL_IN * rows + 0.8)
    with figures.figure(stem, size_in, len(found), COLUMNS, sharey=True) as (drawn, panels):
        for axes, curve in zip(panels, found, strict=True):
            _panel(axes, curve)
        for axes in panels[::COLUMNS]:
            axes.set_ylabel("% of pictures")
        figures.title(drawn, f"{source}: the default as its pictures get worse")
        handles, texts = panels[0].get_legend_handles_labels()
        drawn.legend(handles, texts, loc="upper right", ncols=len(LINES) + 1, frameon=False)
    return figures.files(stem)


def _panel(axes: Axes, curve: Curve) -> None:
    at = [step.severity for step in curve.steps]
    low, high = ([100 * getattr(step, edge) for step in curve.steps] for edge in ("low", "high"))
    axes.fill_between(at, low, high, color=LINES[0][2], alpha=0.12, linewidth=0)
    for field, label, colour, style in LINES:
        values = [100 * float(getattr(step, field)) for step in curve.steps]
        axes.plot(at, values, style, color=colour, markersize=4, linewidth=1.4, label=label)
    axes.axhline(100 * CHANCE, color=SOFT, linewidth=0.8, linestyle="--", label="chance")
    breaks = curve.breaks_at()
    if breaks is not None:
        axes.axvline(breaks, color=LINES[0][2], linewidth=0.8, linestyle=":")
    axes.set(title=f"{curve.name} (n = {curve.n})", xlabel=curve.unit, xticks=at, ylim=(-3, 103))
