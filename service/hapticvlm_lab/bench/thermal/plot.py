"""The chart as a picture: error against cost, a panel for one contact and one for slides."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from hapticvlm.palette import BLUE, GREEN, GREY, ORANGE, SOFT, VERMILION
from hapticvlm_lab.bench import figures
from hapticvlm_lab.bench.labels import place
from hapticvlm_lab.bench.thermal.methods import Row

if TYPE_CHECKING:
    from matplotlib.axes import Axes

SIZE_IN = (12.0, 5.6)
DPI = 80
PANELS = (("felt_c", "one contact of 10 s"), ("slide_c", "slides from object to object"))
# what lies outside is drawn at the edge
LOWEST_C = 1e-3
HIGHEST_C = 100.0
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
    with figures.figure(stem, SIZE_IN, 2, dpi=DPI, sharey=True) as (drawn, panels):
        heading = f"{reason[:1].upper()}{reason[1:]}"
        figures.title(drawn, f"What skin feels, every method. {heading}.")
        panels[0].set_ylabel("worst error of the skin's surface, degC (10 degC of contrast)")
        for axes, (field, name) in zip(panels, PANELS, strict=True):
            _panel(axes, rows, field)
            axes.set_title(name)
            place(axes, _labels(rows, field), [(row.touch_us, _height(row, field)) for row in rows])
    return figures.files(stem)


def _panel(axes: Axes, rows: Sequence[Row], field: str) -> None:
    for row in rows:
        colour, marker = STYLE[row.family]
        axes.plot(row.touch_us, _height(row, field), marker, color=colour, markersize=8, zorder=4)
        if row.is_default:
            figures.ring(axes, row.touch_us, _height(row, field))
    for floor_c, text in FLOORS_C:
        figures.level(axes, floor_c, text)
    axes.axvline(5.0, color=SOFT, linewidth=0.8, linestyle=":", zorder=1)
    axes.set(xscale="log", yscale="log", ylim=(LOWEST_C / 1.6, HIGHEST_C * 1.6))
    axes.set_xlim(figures.span([row.touch_us for row in rows], 2.0, 3.0))
    axes.set_xlabel("us a step, setting up spread over a touch of one second (dotted: 5 us)")


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
