"""`hapticvlm chart whole`: the worth of a whole pipeline, against its cost.

A row is a method to decide on the material of an object: the default, and each that differs from it
in one respect. Worth is the share of held-back objects that are recognised by touch (predicted,
feeling.py); cost is the time of one core for one recognition. The temperature of the air is left
out, since it needs the weights of a vision-language model.

The figure has a panel for each style of picture, because what decides differs: photographs have no
names, the objects of rooms and game kits have, and game kits look like nothing that was
photographed.
"""

from __future__ import annotations

import textwrap
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from hapticvlm.commands.progress import track
from hapticvlm.materials import MATERIALS
from hapticvlm.palette import BLUE, VERMILION
from hapticvlm.statistics import wilson
from hapticvlm_lab.bench import figures
from hapticvlm_lab.bench.material.answers import embed
from hapticvlm_lab.bench.material.data import Source
from hapticvlm_lab.bench.material.methods import Floats, Method
from hapticvlm_lab.bench.material.reading import Kind, sources_of
from hapticvlm_lab.bench.material.timing import costs_ms
from hapticvlm_lab.bench.pareto import pareto
from hapticvlm_lab.bench.printing import publish
from hapticvlm_lab.bench.whole import deciding, feeling
from hapticvlm_lab.bench.whole.deciding import STATED, Decided

if TYPE_CHECKING:
    from matplotlib.axes import Axes

NAME = "chart-whole"
SIZE_IN = (12.5, 5.8)
DPI = 90
LOOKS = ((VERMILION, "o"), (BLUE, "s"))  # colour and marker of the sources of a panel
STYLES: dict[Kind, str] = {
    "photographs": "Photographs, nothing named",
    "renders": "Rendered rooms",
    "game kits": "Game kits, left out whole",
}
FREE_MS = 0.003  # where the figure shows what costs nothing, on its logarithmic axis


@dataclass(frozen=True, slots=True)
class Row:
    """One pipeline on one source of n objects.

    `share` recognised by touch (predicted), with its 95 % interval (Wilson); mean difference of the
    skin from the true material; ms of one core for a recognition (median; a frame is decoded and
    cut).
    """

    source: str
    style: Kind
    decides: str
    is_default: bool
    n: int
    share: float
    low: float
    high: float
    skin_c: float
    look_ms: float


def run(data: Path | None, kits: Path | None, out: Path, *, as_json: bool) -> int:
    """Measure, print a table or JSON, write picture and JSON.

    Raises CaptureError, EncoderError, GalleryError.
    """
    rows = measure(sources_of(data, kits))
    files = draw(rows, out / NAME, sentence(rows))
    report = {
        "chart": "whole",
        "default": sentence(rows),
        "rows": [asdict(row) for row in rows],
    }
    return publish(out / NAME, report, files, as_json=as_json, show=lambda: show(rows))


def measure(sources: Sequence[tuple[Source, Kind]]) -> list[Row]:
    """Decide every object by every method, render it in every way, and time all of it."""
    ways = deciding.ways()
    # The source that states most lends the names, shaders and maps that are timed.
    telling = max((source for source, _ in sources), key=_telling)
    looks_ms = costs_ms(ways, telling if telling.stated else None)
    rows = []
    for source, style in track(sources, "deciding and rendering every object"):
        seen: dict[int, Floats | None] = {}  # each picture is looked at once by each eye
        for way in (way for way in ways if deciding.fits(way, source)):
            eye = id(way.encoder)
            if eye not in seen:
                seen[eye] = embed(way, source)
            decisions = deciding.decided(way, source, seen[eye])
            rows.append(_row(source, style, way, decisions, looks_ms))
    return rows


def _telling(source: Source) -> tuple[bool, int]:
    has_maps = any(stated.texture for stated in source.stated.values())
    return has_maps, len(source.stated)


def sentence(rows: Sequence[Row]) -> str:
    """Compare the default of each source with the best rung."""
    parts = []
    for source in dict.fromkeys(row.source for row in rows):
        there = [row for row in rows if row.source == source]
        machines = [row for row in there if row.decides != STATED]
        default = next(row for row in machines if row.is_default)
        best = max(machines, key=lambda row: (row.share, -row.look_ms))
        text = f"{source}: {default.decides} {default.share:.0%} in {default.look_ms:.1f} ms"
        if best.share > default.share:
            text += f", {best.decides} {best.share:.0%} in {best.look_ms:.1f} ms"
        parts.append(text)
    return "recognised by touch by default: " + "; ".join(parts)


def undominated(rows: Sequence[Row]) -> list[Row]:
    """Return the rows that no cheaper one equals, cheapest first, without STATED."""
    machines = [row for row in rows if row.decides != STATED]
    return pareto(machines, lambda row: row.look_ms, lambda row: row.share)


def show(rows: Sequence[Row]) -> None:
    """Print a table for each source."""
    for source in dict.fromkeys(row.source for row in rows):
        there = [row for row in rows if row.source == source]
        kept = undominated(there)
        print(f"\n{source}: {there[0].n} objects of {len(MATERIALS)} materials")
        print(f"{'recognised':>16} {'skin':>8} {'picture':>8}")
        for row in there:
            share = f"{row.share:.0%} [{100 * row.low:.0f}, {100 * row.high:.0f}]"
            cells = f"{share:>16} {row.skin_c:>5.2f} °C {row.look_ms:>5.1f} ms"
            mark = " (default)" if row.is_default else ""
            line = " *" if row in kept else "  "
            print(f"{cells}{line} {row.decides}{mark}")
    print("\n* no cheaper pipeline equals it, except for a scene that states its materials")
    print(sentence(rows))


def _row(
    source: Source,
    style: Kind,
    way: Method,
    decisions: Sequence[Decided],
    looks_ms: Mapping[str, float],
) -> Row:
    felt = [feeling.felt(each.rendition, each.truth) for each in decisions]
    right = [each.recognised for each in felt]
    low, high = wilson(sum(right), len(right))
    return Row(
        source=source.name,
        style=style,
        decides=way.name,
        is_default=deciding.is_default(way, source),
        n=len(decisions),
        share=round(sum(right) / len(right), 3),
        low=round(low, 3),
        high=round(high, 3),
        skin_c=round(float(np.mean([f.skin_c for f in felt])), 3),
        look_ms=round(looks_ms.get(way.name, 0.0), 3),
    )


def draw(rows: Sequence[Row], stem: Path, reason: str) -> list[Path]:
    """Write `stem`.png and .svg; return both."""
    styles = [style for style in STYLES if any(row.style == style for row in rows)]
    with figures.figure(stem, SIZE_IN, len(styles), dpi=DPI, sharey=True) as (drawn, panels):
        figures.title(drawn, textwrap.fill(f"What each rung adds: {reason}.", 150))
        for axes, style in zip(panels, styles, strict=True):
            _draw_style(axes, [row for row in rows if row.style == style])
            axes.set_title(STYLES[style])
        panels[0].set_ylabel("objects recognised by touch, % (predicted)")
    return figures.files(stem)


def _draw_style(axes: Axes, rows: Sequence[Row]) -> None:
    """Draw the rungs of one style: a line through those that no cheaper one equals."""
    axes.set(xscale="log", xlim=(FREE_MS / 1.6, 60.0), ylim=(-4, 128), yticks=range(0, 101, 20))
    sources = list(dict.fromkeys(row.source for row in rows))
    labels = []
    for source, (colour, marker) in zip(sources, LOOKS, strict=False):
        there = [row for row in rows if row.source == source]
        title = f"{source}, {there[0].n} objects"
        axes.plot(*_points(there), marker, color=colour, label=title, zorder=4)
        for row in there:
            axes.plot([_ms(row)] * 2, [100 * row.low, 100 * row.high], color=colour, linewidth=0.8)
        axes.step(*_points(undominated(there)), where="post", color=colour, linewidth=0.9, zorder=2)
        default = next(row for row in there if row.is_default)
        figures.ring(axes, *_at(default))
        labels += [(*_at(row), row.decides, colour) for row in there]
    axes.legend(loc="upper left", title="95 % interval; ring: the default", title_fontsize=8)
    axes.set_xlabel("ms of one core for a recognition")
    figures.place(axes, labels, [_at(row) for row in rows])


def _points(rows: Sequence[Row]) -> tuple[list[float], list[float]]:
    return [_ms(row) for row in rows], [100.0 * row.share for row in rows]


def _at(row: Row) -> tuple[float, float]:
    return _ms(row), 100.0 * row.share


def _ms(row: Row) -> float:
    return max(row.look_ms, FREE_MS)
