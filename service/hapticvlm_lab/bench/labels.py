"""Puts labels beside the points of a panel so that none covers another, a marker or the edge."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.text import Annotation
    from matplotlib.transforms import Bbox

SIZE = 8.0  # points
REACH = 8  # rings of places tried round a point
DOT_PX = 6.0  # half the side of a marker that labels keep clear of


def place(
    axes: Axes,
    labels: Sequence[tuple[float, float, str, str]],
    dots: Sequence[tuple[float, float]],
) -> None:
    """Write (x, y, text, colour) labels clear of all dots; the limits of the axes are set."""
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
        fontsize=SIZE,
        color=colour,
        va="center",
        arrowprops=line,
        zorder=5,
        path_effects=[withStroke(linewidth=2.5, foreground="white")],
    )


def _offsets(width: float, height: float) -> Iterator[tuple[float, float]]:
    """Offsets of a label's left middle from its point, px: right and left, in growing steps."""
    for ring in range(REACH):
        for rise in (ring * (height + 2), -ring * (height + 2)):
            for shift in (10.0, -10.0 - width, 26.0, -26.0 - width):
                yield shift, rise


def _is_free(box: Bbox, frame: Bbox, taken: Sequence[Bbox]) -> bool:
    is_inside = frame.containsx(box.x0) and frame.containsx(box.x1)
    is_inside = is_inside and frame.containsy(box.y0) and frame.containsy(box.y1)
    return is_inside and not box.count_overlaps(taken)
