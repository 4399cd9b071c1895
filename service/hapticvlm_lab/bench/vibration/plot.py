"""The chart as a picture: a panel for each knob, perceived difference against cost."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from hapticvlm.palette import BLUE, FIGURE, GREEN, GRID, INK, ORANGE, SOFT
from hapticvlm_lab.bench.material.labels import place
from hapticvlm_lab.bench.vibration.spectra import JND_DB

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from hapticvlm_lab.bench.vibration.methods import Row

WIDTH_IN, HEIGHT_IN, DPI = 13.0, 4.8, 80
LOWEST_DB = 0.02  # what differs less is drawn there
PANELS = (  # knob, title, x axis, colour and marker
    ("modes", "modes of an impact", "us a strike", BLUE, "o"),
    ("noise", "noise of a texture", "us a block of 128 samples", ORANGE, "s"),
    ("block", "block size, two rubbing hands", "share of one core, %", GREEN, "D"),
)


def draw(rows: Sequence[Row], stem: Path, reason: str) -> list[Path]:
    """Write `stem`.png and .svg; return both."""
    import matplotlib as mpl

    mpl.use("Agg")
    from matplotlib import pyplot as plt

    with mpl.rc_context(dict(FIGURE)):
        figure, panels = plt.subplots(
            1, 3, figsize=(WIDTH_IN, HEIGHT_IN), dpi=DPI, sharey=True, layout="constrained"
        )
        for axes, panel in zip(panels, PANELS, strict=True):
            _panel(axes, [row for row in rows if row.knob == panel[0]], panel)
        panels[0].set_ylabel("largest felt difference, dB, masked by what is meant")
        title = "\n".join(
            textwrap.wrap(f"Vibration, every way. {reason[:1].upper()}{reason[1:]}.", 150)
        )
        figure.suptitle(title, fontsize=10, x=0.01, ha="left")
        figure.canvas.draw()
        for axes, panel in zip(panels, PANELS, strict=True):
            shown = [row for row in rows if row.knob == panel[0]]
            place(axes, [(*_at(row), _label(row), INK) for row in shown], [_at(r) for r in shown])
        paths = [stem.with_suffix(".png"), stem.with_suffix(".svg")]
        figure.savefig(paths[0], dpi=DPI)
        figure.savefig(paths[1], metadata={"Date": None})
        plt.close(figure)
    return paths


def _panel(axes: Axes, rows: Sequence[Row], panel: tuple[str, str, str, str, str]) -> None:
    from matplotlib.ticker import FormatStrFormatter, LogLocator, NullLocator

    _, title, across, colour, marker = panel
    for row in rows:
        x, y = _at(row)
        axes.plot(x, y, marker, color=colour, markersize=7, zorder=4)
        if row.is_default:
            axes.plot(x, y, "o", color=INK, markerfacecolor="none", markersize=14, zorder=3)
    axes.axhline(JND_DB, color=SOFT, linewidth=0.8, linestyle="--", zorder=1)
    axes.text(
        0.01,
        JND_DB * 1.06,
        f"told apart from {JND_DB:g} dB on",
        ha="left",
        color=SOFT,
        fontsize=8,
        transform=axes.get_yaxis_transform(),
    )
    axes.set_yscale("log")
    axes.set_xscale("log")
    axes.xaxis.set_major_locator(LogLocator(subs=(1, 1.5, 2, 3, 5, 7)))  # hardly a decade wide
    axes.xaxis.set_major_formatter(FormatStrFormatter("%g"))
    axes.xaxis.set_minor_locator(NullLocator())
    axes.margins(x=0.25, y=0.2)
    axes.set_title(title, fontsize=9.5, loc="left", color=INK)
    axes.set_xlabel(across)
    axes.grid(color=GRID, linewidth=0.6)
    axes.set_axisbelow(True)
    axes.spines[["top", "right"]].set_visible(False)


def _at(row: Row) -> tuple[float, float]:
    across = row.cost_us if row.core_share is None else 100.0 * row.core_share
    return across, max(row.error_db, LOWEST_DB)


def _label(row: Row) -> str:
    text = f"{row.value} (default)" if row.is_default else row.value
    return text if row.delay_ms is None else f"{text}, {row.delay_ms:.1f} ms"
