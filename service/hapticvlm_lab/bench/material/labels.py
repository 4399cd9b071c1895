"""Puts labels beside the points of a panel so that none covers another, a marker or the edge."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.text import Annotation

SIZE = 8.0  # points
REACH = 8  # rings of places tried round a point
DOT_PX = 6.0  # half the side of a marker that labels keep clear of

Box = tuple[float, float, float, float]  # left, bottom, right, top in px


def place(
    axes: Axes,
    labels: Sequence[tuple[float, float, str, str]],
    dots: Sequence[tuple[float, float]],
) -> None:
    """Write (x, y, text, colour) labels clear of all dots; call after the figure was drawn."""
    from matplotlib.text import Text

    at = [axes.transData.transform((x, y)) for x, y, _, _ in labels]
    marks = [axes.transData.transform(dot) for dot in dots]
    written = [text.get_window_extent() for text in axes.texts]
    taken = [(box.x0, box.y0, box.x1, box.y1) for box in written]
    taken += [(x - DOT_PX, y - DOT_PX, x + DOT_PX, y + DOT_PX) for x, y in marks]
    frame = axes.get_window_extent()
    edge = (frame.x0, frame.y0, frame.x1, frame.y1)
    points_per_px = 72.0 / axes.figure.dpi
    for (x, y, text, colour), (px, py) in zip(labels, at, strict=True):
        note = _write(axes, (x, y), text, colour)
        extent = Text.get_window_extent(note)  # an annotation's own holds its line too
        size = (extent.width, extent.height)
        tried = [(offset, _box((px, py), offset, size)) for offset in _places(size)]
        free = (place for place in tried if _is_free(place[1], edge, taken))
        (dx, dy), box = next(free, tried[0])
        note.set_position((dx * points_per_px, dy * points_per_px))
        taken.append(box)


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


def _places(size: tuple[float, float]) -> Iterator[tuple[float, float]]:
    """Offsets of a label's left middle from its point, px: right and left, in growing steps."""
    width, height = size
    for ring in range(REACH):
        for rise in (ring * (height + 2), -ring * (height + 2)):
            for shift in (10.0, -10.0 - width, 26.0, -26.0 - width):
                yield shift, rise


def _box(at: tuple[float, float], offset: tuple[float, float], size: tuple[float, float]) -> Box:
    left, middle = at[0] + offset[0], at[1] + offset[1]
    return left, middle - size[1] / 2, left + size[0], middle + size[1] / 2


def _is_free(box: Box, edge: Box, taken: Sequence[Box]) -> bool:
    inside = edge[0] <= box[0] and edge[1] <= box[1] and box[2] <= edge[2] and box[3] <= edge[3]
    return inside and not any(_overlaps(box, other) for other in taken)


def _overlaps(a: Box, b: Box) -> bool:
    return a[0] < b[2] and b[0] < a[2] and a[1] < b[3] and b[1] < a[3]
