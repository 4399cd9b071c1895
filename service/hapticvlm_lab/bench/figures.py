"""How every figure of the laboratory is laid out and written: one style, a PNG and an SVG each.

Colours are Okabe and Ito's (hapticvlm.palette), which colour-blind readers tell apart; what differs
in colour differs in marker or dash too.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from hapticvlm.palette import FIGURE, GRID, INK, SOFT

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

DPI = 100
STYLE = {
    **FIGURE,
    "axes.axisbelow": True,
    "axes.grid": True,
    "axes.spines.right": False,
    "axes.spines.top": False,
    "axes.titlecolor": INK,
    "axes.titlelocation": "left",
    "axes.titlesize": 9.5,
    "figure.titlesize": 10,
    "grid.color": GRID,
    "grid.linewidth": 0.6,
    "legend.fontsize": 8,
}


def files(stem: Path) -> list[Path]:
    """Return what a figure of this name is written to."""
    return [stem.with_name(f"{stem.name}.png"), stem.with_name(f"{stem.name}.svg")]


@contextmanager
def figure(
    stem: Path,
    size_in: tuple[float, float],
    panels: int,
    columns: int | None = None,
    *,
    dpi: int = DPI,
    sharey: bool = False,
) -> Iterator[tuple[Figure, list[Axes]]]:
    """Lay out panels, row by row; they are written to `files(stem)` when the context ends."""
    import matplotlib as mpl
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    columns = min(columns or panels, panels)
    with mpl.rc_context(STYLE):
        drawn = Figure(size_in, dpi, layout="constrained")
        FigureCanvasAgg(drawn)
        grid = drawn.subplots(-(-panels // columns), columns, sharey=sharey, squeeze=False)
        axes = list(grid.ravel())
        for empty in axes[panels:]:
            empty.set_axis_off()
        yield drawn, axes[:panels]
        png, svg = files(stem)
        drawn.savefig(png)
        drawn.savefig(svg, metadata={"Date": None})


def title(drawn: Figure, text: str) -> None:
    """Write what the whole figure shows above its panels."""
    drawn.suptitle(text, x=0.01, ha="left")


def ring(axes: Axes, x: float, y: float) -> None:
    """Draw a ring round the point of the default method."""
    axes.plot(x, y, "o", color=INK, markerfacecolor="none", markersize=14, zorder=3)


def level(axes: Axes, y: float, text: str, *, dashes: str = "--", align: str = "right") -> None:
    """Draw a level across a panel, its name above it at one end."""
    axes.axhline(y, color=SOFT, linewidth=0.8, linestyle=dashes, zorder=1)
    axes.annotate(
        text,
        (0.01 if align == "left" else 0.995, y),
        xycoords=("axes fraction", "data"),
        xytext=(0, 2),
        textcoords="offset points",
        ha=align,
        color=SOFT,
        fontsize=8,
    )


def span(values: Sequence[float], below: float, above: float) -> tuple[float, float]:
    """Return limits of a logarithmic axis: these times below the least, above the greatest."""
    return min(values, default=1.0) / below, max(values, default=1.0) * above
