"""The chart as a picture: accuracy against latency, a panel per source, labels on the points."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from hapticvlm.palette import BLUE, INK, ORANGE, PURPLE, SKY, SOFT, VERMILION
from hapticvlm_lab.bench import figures
from hapticvlm_lab.bench.figures import place
from hapticvlm_lab.bench.material.rows import Row, undominated, weakness
from hapticvlm_lab.bench.material.scores import Score

if TYPE_CHECKING:
    from matplotlib.axes import Axes

WIDTH_IN = 12.0
PANEL_IN = 5.4
COLUMNS = 2
STEP = 1.12  # between methods that take the same time, so that their intervals can be read
BASELINES = ("guess", "stated", "plain", "ladder")
SHOWN = "5"  # references a class of the hollow points
STYLE = {  # colour and marker of each family
    "guess": (SOFT, "_"),
    "stated": (ORANGE, "v"),
    "plain": (SKY, "s"),
    "named": (PURPLE, "D"),
    "ours": (BLUE, "o"),
    "ladder": (VERMILION, "^"),
}


@dataclass(frozen=True, slots=True)
class Point:
    """A dot of a panel: latency in ms, accuracy and its interval in %, hollow when enrolled."""

    row: Row
    x: float
    score: Score
    hollow: bool

    @property
    def y(self) -> float:
        """Balanced accuracy, %."""
        return 100 * self.score.accuracy


def draw(rows: Sequence[Row], stem: Path) -> list[Path]:
    """Write `stem`.png and .svg; return both."""
    sources = list(dict.fromkeys(row.source for row in rows))
    size_in = (WIDTH_IN, PANEL_IN * -(-len(sources) // COLUMNS) + 0.9)
    with figures.figure(stem, size_in, len(sources), COLUMNS) as (drawn, panels):
        figures.title(drawn, _title())
        shown = worth_drawing(rows)
        for axes, source in zip(panels, sources, strict=True):
            mine = [row for row in shown if row.source == source]
            _panel(axes, mine)
            place(axes, _labels(mine), [(point.x, point.y) for point in points(mine)])
    return figures.files(stem)


def worth_drawing(rows: Sequence[Row]) -> list[Row]:
    """Leave out seen methods that are dominated on every source, zero-shot and enrolled.

    The default, and what is only a baseline, stay; the table has them all.
    """
    sources = dict.fromkeys(row.source for row in rows)
    kept = {
        row.method
        for source in sources
        for row in _best([row for row in rows if row.source == source])
    }
    return [row for row in rows if row.method in kept or row.is_default or row.family in BASELINES]


def _best(rows: Sequence[Row]) -> list[Row]:
    enrolled = [
        replace(row, four=few.four) for row in rows if (few := row.enrolled.get(SHOWN)) is not None
    ]
    return [*undominated(rows), *undominated(enrolled)]


def points(rows: Sequence[Row]) -> list[Point]:
    """Every dot of a panel: zero-shot filled, enrolled hollow; methods without a time have none."""
    found = []
    beside: Counter[float | None] = Counter()
    for row in rows:
        few = row.enrolled.get(SHOWN)
        for score, hollow in ((row.four, False), (few.four if few else None, True)):
            if score is not None and row.latency_ms is not None:
                shift = STEP ** beside[row.latency_ms]
                found.append(Point(row, row.latency_ms * shift, score, hollow))
        beside[row.latency_ms] += 1
    return found


def _title() -> str:
    return (
        "Material of 4 (wood, glass, fabric, metal): balanced accuracy with 95 % interval over "
        "objects, against the median time one core takes for a decision.\n"
        f"Filled: zero-shot. Hollow: enrolled with {SHOWN} references a material from other "
        "objects of the source. Ringed: the default. Line: no cheaper one is as good, zero-shot."
    )


def _panel(axes: Axes, rows: Sequence[Row]) -> None:
    dots = points(rows)
    for point in dots:
        _dot(axes, point)
    for row in rows:
        ends = [(point.x, point.y) for point in dots if point.row is row]
        if len(ends) == 2:
            colour = STYLE[row.family][0]
            axes.plot(*zip(*ends, strict=True), ":", color=colour, linewidth=0.8, zorder=2)
    best = undominated(rows)
    corners = sorted((point.x, point.y) for point in dots if point.row in best and not point.hollow)
    if corners:
        axes.step(*zip(*corners, strict=True), where="post", color=INK, linewidth=0.8, zorder=1)
    figures.level(axes, 25, "chance of 4")
    for row in rows:
        if row.family == "guess" and row.four is not None and len(row.four.classes) != 4:
            figures.level(axes, 100 * row.four.accuracy, "majority", dashes=":")
    axes.set_xscale("log")
    axes.set_xlim(figures.span([point.x for point in dots], 2.0, 6.0))
    axes.set_ylim(0, 104)
    axes.set_title(_heading(rows))
    axes.set_xlabel("ms of one core a decision")
    axes.set_ylabel("balanced accuracy of 4, %")


def _dot(axes: Axes, point: Point) -> None:
    colour, marker = STYLE[point.row.family]
    low = 100 * point.score.low
    high = 100 * point.score.high
    axes.vlines(point.x, low, high, color=colour, linewidth=1.0, alpha=0.45, zorder=2)
    face = "white" if point.hollow else colour
    axes.plot(point.x, point.y, marker, color=colour, markerfacecolor=face, markersize=7, zorder=4)
    if point.row.is_default:
        figures.ring(axes, point.x, point.y)


def _labels(rows: Sequence[Row]) -> list[tuple[float, float, str, str]]:
    """(x, y, text, colour) of one label a method, at its zero-shot dot where it has one."""
    first: dict[str, Point] = {}
    for point in points(rows):
        first.setdefault(point.row.method, point)
    return [
        (point.x, point.y, _label(point), STYLE[point.row.family][0])
        for point in sorted(first.values(), key=lambda point: -point.y)
    ]


def _label(point: Point) -> str:
    return f"{point.row.method} (default)" if point.row.is_default else point.row.method


def _heading(rows: Sequence[Row]) -> str:
    graded = next((row.four for row in rows if row.four is not None), None)
    if graded is None:
        return rows[0].source
    counts = ", ".join(f"{name} {count}" for name, count in graded.classes.items())
    weak = weakness(rows)
    least = "" if weak is None else f"\ndefault at its weakest: {weak[0]}, {weak[1]:.0%} found"
    return f"{rows[0].source}: objects of {counts}{least}"
