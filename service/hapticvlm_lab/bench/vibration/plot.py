"""The chart as a picture: a panel for each knob, perceived difference against cost."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from hapticvlm.palette import BLUE, GREEN, INK, ORANGE
from hapticvlm_lab.bench import figures
from hapticvlm_lab.bench.labels import place
from hapticvlm_lab.bench.vibration.spectra import JND_DB

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from hapticvlm_lab.bench.vibration.methods import Row

SIZE_IN = (13.0, 4.8)
DPI = 80
LOWEST_DB = 0.02  # what differs less is drawn there
PANELS = (  # knob, title, x axis, colour and marker
    ("modes", "modes of an impact", "us a strike", BLUE, "o"),
    ("noise", "noise of a texture", "us a block of 128 samples", ORANGE, "s"),
    ("block", "block size, two rubbing hands", "share of one core, %", GREEN, "D"),
)


def draw(rows: Sequence[Row], stem: Path, reason: str) -> list[Path]:
    """Write `stem`.png and .svg; return both."""
    with figures.figure(stem, SIZE_IN, 3, dpi=DPI, sharey=True) as (drawn, panels):
        heading = f"Vibration, every way. {reason[:1].upper()}{reason[1:]}."
        figures.title(drawn, textwrap.fill(heading, 150))
        panels[0].set_ylabel("largest felt difference, dB, masked by what is meant")
        for axes, panel in zip(panels, PANELS, strict=True):
            shown = [row for row in rows if row.knob == panel[0]]
            _panel(axes, shown, panel)
            place(axes, [(*_at(row), _label(row), INK) for row in shown], [_at(r) for r in shown])
    return figures.files(stem)


def _panel(axes: Axes, rows: Sequence[Row], panel: tuple[str, str, str, str, str]) -> None:
    from matplotlib.ticker import FormatStrFormatter, LogLocator, NullLocator

    _, title, across, colour, marker = panel
    for row in rows:
        axes.plot(*_at(row), marker, color=colour, markersize=7, zorder=4)
        if row.is_default:
            figures.ring(axes, *_at(row))
    figures.level(axes, JND_DB, f"told apart from {JND_DB:g} dB on", align="left")
    axes.set(xscale="log", yscale="log", title=title, xlabel=across)
    axes.xaxis.set_major_locator(LogLocator(subs=(1, 1.5, 2, 3, 5, 7)))  # hardly a decade wide
    axes.xaxis.set_major_formatter(FormatStrFormatter("%g"))
    axes.xaxis.set_minor_locator(NullLocator())
    axes.margins(x=0.25, y=0.2)


def _at(row: Row) -> tuple[float, float]:
    across = row.cost_us if row.core_share is None else 100.0 * row.core_share
    return across, max(row.error_db, LOWEST_DB)


def _label(row: Row) -> str:
    text = f"{row.value} (default)" if row.is_default else row.value
    return text if row.delay_ms is None else f"{text}, {row.delay_ms:.1f} ms"
