"""Layout and files of every figure of the laboratory: one style, a PNG and an SVG each.

Colours are Okabe and Ito's (hapticvlm.palette), which colour-blind readers distinguish; a
difference in colour always comes with a difference in marker or dash.
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
    from matplotlib.text import Annotation
    from matplotlib.transforms import Bbox

DPI = 100
LABEL_PT = 8.0
REACH = 8  # rings of positions that are tried round a point
DOT_PX = 6.0  # half the side of a marker that labels keep clear of
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
    """Return the files of a figure of this name."""
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
    """Write a heading above all panels."""
    drawn.suptitle(text, x=0.01, ha="left")


def ring(axes: Axes, x: float, y: float) -> None:
    """Draw a ring round the point of the default method."""
    axes.plot(x, y, "o", color=INK, markerfacecolor="none", markersize=14, zorder=3)


def level(axes: Axes, y: float, text: str, *, align: str = "right") -> None:
    """Draw a level across a panel, its name above it at one end."""
    axes.axhline(y, color=SOFT, linewidth=0.8, linestyle="--", zorder=1)
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


def span(values: Sequence[float]) -> tuple[float, float]:
    """Return limits of a logarithmic axis, with room for labels at the right."""
    return min(values, default=1.0) / 2.0, max(values, default=1.0) * 6.0


def place(
    axes: Axes,
    labels: Sequence[tuple[float, float, str, str]],
    dots: Sequence[tuple[float, float]],
) -> None:
    """Write (x, y, text, colour) labels clear of all dots; the limits of the axes must be set."""
    from matplotlib.text import Text
    from matplotlib.transforms import Bbox

    axes.figure.canvas.draw()  # the layout decides where points lie in px
    written = [text.get_window_extent() for text in axes.texts]
    marks = [Bbox([at, at]).padded(DOT_PX) for at in map(axes.transData.transform, dots)]
    taken = [*written, *marks]
    frame = axes.get_window_extent()
    points_per_px = 72.0 / axes.figure.dpi
    for x, y, text, colour in labels:
        px, py = axes.transData.transform((x, y))
        note = _write(axes, (x, y), text, colour)
        extent = Text.get_window_extent(note)  # an annotation's own holds its line too
        offsets = list(_offsets(extent.width, extent.height))
        boxes = [
            Bbox.from_bounds(px + dx, py + dy - extent.height / 2, extent.width, extent.height)
            for dx, dy in offsets
        ]
        free = (at for at, box in enumerate(boxes) if _is_free(box, frame, taken))
        chosen = next(free, 0)
        dx, dy = offsets[chosen]
        note.set_position((dx * points_per_px, dy * points_per_px))
        taken.append(boxes[chosen])


def _write(axes: Axes, at: tuple[float, float], text: str, colour: str) -> Annotation:
    from matplotlib.patheffects import withStroke

    line = {"arrowstyle": "-", "color": colour, "linewidth": 0.5, "alpha": 0.6, "shrinkB": 3}
    return axes.annotate(
        text,
        at,
        (0, 0),
        textcoords="offset points",
        fontsize=LABEL_PT,
        color=colour,
        va="center",
        arrowprops=line,
        zorder=5,
        path_effects=[withStroke(linewidth=2.5, foreground="white")],
    )


def _offsets(width: float, height: float) -> Iterator[tuple[float, float]]:
    """Yield offsets of a label's left middle, px: right and left of its point, in growing steps."""
    for ring in range(REACH):
        for rise in (ring * (height + 2), -ring * (height + 2)):
            for shift in (10.0, -10.0 - width, 26.0, -26.0 - width):
                yield shift, rise


def _is_free(box: Bbox, frame: Bbox, taken: Sequence[Bbox]) -> bool:
    is_inside = frame.containsx(box.x0) and frame.containsx(box.x1)
    is_inside = is_inside and frame.containsy(box.y0) and frame.containsy(box.y1)
    return is_inside and not box.count_overlaps(taken)
