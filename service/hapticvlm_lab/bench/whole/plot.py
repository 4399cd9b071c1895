"""The chart of whole pipelines as a picture: one panel, a colour for each source."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from hapticvlm.palette import BLUE, GREEN, PURPLE, VERMILION
from hapticvlm_lab.bench import figures
from hapticvlm_lab.bench.figures import place
from hapticvlm_lab.bench.whole.rows import undominated

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from hapticvlm_lab.bench.whole.rows import Row

SIZE_IN = (11.0, 6.2)
DPI = 90
LOOKS = ((VERMILION, "o"), (BLUE, "s"), (GREEN, "D"), (PURPLE, "^"))  # colour, marker


def draw(rows: Sequence[Row], stem: Path, reason: str) -> list[Path]:
    """Write `stem`.png and .svg; return both."""
    with figures.figure(stem, SIZE_IN, 1, dpi=DPI) as (drawn, (axes,)):
        heading = f"Whole pipelines: {reason}."
        figures.title(drawn, textwrap.fill(heading, 130))
        sources = dict.fromkeys(row.source for row in rows)
        for source, look in zip(sources, LOOKS, strict=False):
            _draw_source(axes, [row for row in rows if row.source == source], look)
        axes.set(xscale="log", ylim=(-4, 108))
        axes.set_xlim(*figures.span([row.core_ms for row in rows], 1.3, 1.6))
        axes.set_xlabel("ms of one core for one look and one touch of a second")
        axes.set_ylabel("objects felt as what they are, % (predicted)")
        axes.legend(loc="lower right")
        richest = max(sources, key=lambda source: sum(row.source == source for row in rows))
        colour = LOOKS[list(sources).index(richest)][0]
        labelled = [row for row in rows if row.source == richest]
        labels = [(*_at(row), row.renders or row.decides, colour) for row in labelled]
        place(axes, labels, [_at(row) for row in rows])
    return figures.files(stem)


def _draw_source(axes: Axes, rows: Sequence[Row], look: tuple[str, str]) -> None:
    colour, marker = look
    title = f"{rows[0].source}, {rows[0].n} objects"
    axes.plot(*zip(*map(_at, rows), strict=True), marker, color=colour, label=title, zorder=4)
    kept = undominated(rows)
    axes.step(
        *zip(*map(_at, kept), strict=True), where="post", color=colour, linewidth=0.9, zorder=2
    )
    for row in rows:
        if row.is_default:
            figures.ring(axes, *_at(row))


def _at(row: Row) -> tuple[float, float]:
    return row.core_ms, 100.0 * row.share
