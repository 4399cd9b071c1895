"""The chart as a picture: error against cost, a panel for one contact and one for slides.

Colours are Okabe and Ito's, which colour-blind readers tell apart; families differ in shape too.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from hapticvlm.palette import BLUE, FIGURE, GREEN, GREY, GRID, INK, ORANGE, SOFT, VERMILION
from hapticvlm_lab.bench.material.labels import place
from hapticvlm_lab.bench.thermal.methods import Row

if TYPE_CHECKING:
    from matplotlib.axes import Axes

WIDTH_IN, HEIGHT_IN, DPI = 12.0, 5.6, 80
LOWEST_C, HIGHEST_C = 1e-3, 100.0  # what lies outside is drawn at the edge
FLOORS_C = ((0.1, "cool floor 0.1"), (0.2, "warm floor 0.2"))
STYLE = {  # colour and marker of each family
    "step": (GREY, "s"),
    "fitted": (ORANGE, "v"),
    "cells": (BLUE, "D"),
    "closed": (GREEN, "o"),
    "stepped": (VERMILION, "X"),
}


def draw(rows: Sequence[Row], stem: Path, reason: str) -> list[Path]:
    """Write `stem`.png and .svg; return both."""
    import matplotlib as mpl

    mpl.use("Agg")
    from matplotlib import pyplot as plt

    with mpl.rc_context(dict(FIGURE)):
        figure, panels = plt.subplots(
            1, 2, figsize=(WIDTH_IN, HEIGHT_IN), dpi=DPI, sharey=True, layout="constrained"
        )
        _panel(panels[0], rows, "felt_c", "one contact of 10 s")
        _panel(panels[1], rows, "slide_c", "slides from object to object")
        panels[0].set_ylabel("worst error of the skin's surface, degC (10 degC of contrast)")
        figure.suptitle(
            f"What skin feels, every method. {reason[:1].upper()}{reason[1:]}.",
            fontsize=10,
            x=0.01,
            ha="left",
        )
        figure.canvas.draw()
        for axes, field in zip(panels, ("felt_c", "slide_c"), strict=True):
            place(axes, _labels(rows, field), [(row.touch_us, _height(row, field)) for row in rows])
        paths = [stem.with_suffix(".png"), stem.with_suffix(".svg")]
        figure.savefig(paths[0], dpi=DPI)
        figure.savefig(paths[1], metadata={"Date": None})
        plt.close(figure)
    return paths


def _panel(axes: Axes, rows: Sequence[Row], field: str, title: str) -> None:
    for row in rows:
        colour, marker = STYLE[row.family]
        axes.plot(row.touch_us, _height(row, field), marker, color=colour, markersize=8, zorder=4)
        if row.is_default:
            at = (row.touch_us, _height(row, field))
            axes.plot(*at, "o", color=INK, markerfacecolor="none", markersize=14, zorder=3)
    for floor_c, text in FLOORS_C:
        axes.axhline(floor_c, color=SOFT, linewidth=0.8, linestyle="--", zorder=1)
        axes.text(
            0.995,
            floor_c * 1.04,
            text,
            transform=axes.get_yaxis_transform(),
            ha="right",
            color=SOFT,
            fontsize=8,
        )
    axes.axvline(5.0, color=SOFT, linewidth=0.8, linestyle=":", zorder=1)
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.set_ylim(LOWEST_C / 1.6, HIGHEST_C * 1.6)
    times = [row.touch_us for row in rows]
    axes.set_xlim(min(times) / 2.0, max(times) * 3.0)
    axes.set_title(title, fontsize=9.5, loc="left", color=INK)
    axes.set_xlabel("us a step, setting up spread over a touch of one second (dotted: 5 us)")
    axes.grid(color=GRID, linewidth=0.6)
    axes.set_axisbelow(True)
    axes.spines[["top", "right"]].set_visible(False)


def _labels(rows: Sequence[Row], field: str) -> list[tuple[float, float, str, str]]:
    return [
        (row.touch_us, _height(row, field), _label(row, field), STYLE[row.family][0])
        for row in sorted(rows, key=lambda row: -_height(row, field))
    ]


def _label(row: Row, field: str) -> str:
    error_c = getattr(row, field)
    text = f"{row.method} (default)" if row.is_default else row.method
    if error_c is None or error_c > HIGHEST_C:
        return f"{text}: diverges"
    return f"{text}: below 0.001" if error_c < LOWEST_C else text


def _height(row: Row, field: str) -> float:
    error_c: float | None = getattr(row, field)
    return HIGHEST_C if error_c is None else min(max(error_c, LOWEST_C), HIGHEST_C)
