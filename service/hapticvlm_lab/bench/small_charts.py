"""Draws the small charts of docs/figures.md from the tables of FIGURES.md, so no number is typed.

`python -m hapticvlm_lab.bench.small_charts` writes them; a test compares. Bars with a line of text
each: labels have rows of their own and cannot overlap.
"""

from __future__ import annotations

import html
import re
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from hapticvlm.palette import BLUE, GROUND, INK, ORANGE, SOFT

ROOT = Path(__file__).parents[3]
TABLES = ROOT / "service" / "hapticvlm_lab" / "FIGURES.md"
OUT = ROOT / "docs" / "figures"
WIDTH, LEFT, RIGHT, ROW = 600, 260, 110, 24  # px


@dataclass(frozen=True, slots=True)
class Bar:
    """A row of a chart: its label, value, the text behind it, and its colour."""

    label: str
    value: float
    text: str
    colour: str = BLUE


def charts() -> Iterator[tuple[str, str]]:
    """Yield the name and SVG of each chart."""
    touches = [
        bar
        for load, touch, echo, _ in _rows("**Round trip**", "real-time")
        for bar in (
            Bar(load.removeprefix("real-time, "), _number(touch), f"{_number(touch):g} ms"),
            Bar("bare echo beside it", _number(echo), f"{_number(echo):g} ms", SOFT),
        )
    ]
    yield "touch", _svg("Touch until its answer, median, with real-time priority", touches)
    stops = [
        Bar(meanwhile, _number(silent), f"{_number(silent):g} ms")
        for meanwhile, silent, _ in _rows("**Stop**")
    ]
    yield "stop", _svg("Stop until silence, median; at most 50 ms", stops, most=50.0)
    (default,) = _rows("**Forced choice**", "`lite0` (default)")
    named = []
    for kind, cell in zip(("demo", "caltech101", "web photographs"), default[1:], strict=False):
        says, right = map(float, re.findall(r"says (\d+); (\d+)", cell)[0])
        named.append(Bar(f"{kind}: named", says, f"{says:g} %", ORANGE))
        named.append(Bar("right, of these", right, f"{right:g} %"))
    yield "pictures", _svg("Materials in pictures", named, most=100.0)
    evidence = [
        Bar(what, _number(kits), f"{_number(kits):g} %")
        for what, kits, *_ in _rows("**Everything together**")
    ]
    yield "evidence", _svg("Touched rightly in game kits, by a model", evidence, most=100.0)
    heat = [
        Bar(method, _number(slides), f"{_number(slides):g} degC")
        for method, _, slides, _ in _rows("**Heat**")
    ]
    yield "heat", _svg("Largest error of the skin in a slide", heat)


def main() -> int:
    """Write the charts."""
    OUT.mkdir(exist_ok=True)
    for name, svg in charts():
        (OUT / f"{name}.svg").write_text(svg, encoding="utf-8")
    return 0


def _rows(heading: str, begins: str = "") -> list[list[str]]:
    """Return the cells of the first table below a heading, of rows that begin so."""
    text = TABLES.read_text(encoding="utf-8").split(heading, 1)[1]
    table = re.findall(r"^\|(.*)\|$", text.split("\n\n", 2)[1], re.MULTILINE)[2:]
    rows = [[cell.strip() for cell in row.split("|")] for row in table]
    return [row for row in rows if row[0].startswith(begins)]


def _number(cell: str) -> float:
    return float(re.findall(r"[\d.]+", cell)[0])


def _svg(title: str, bars: Sequence[Bar], most: float | None = None) -> str:
    most = most or max(bar.value for bar in bars)
    height = ROW * (len(bars) + 1) + 8
    said = html.escape("; ".join(f"{bar.label} {bar.text}" for bar in bars))
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {height}" width="{WIDTH}" '
        f'height="{height}" font-family="sans-serif" font-size="13" fill="{INK}" role="img">',
        f"<title>{html.escape(title)}: {said}</title>",
        f'<rect width="{WIDTH}" height="{height}" fill="{GROUND}"/>',
        f'<text x="8" y="18" font-weight="bold">{html.escape(title)}</text>',
    ]
    for at, bar in enumerate(bars, 1):
        y = ROW * at + 6
        wide = max(2.0, (WIDTH - LEFT - RIGHT) * bar.value / most)
        parts += [
            f'<text x="{LEFT - 8}" y="{y + 14}" text-anchor="end">{html.escape(bar.label)}</text>',
            f'<rect x="{LEFT}" y="{y}" width="{wide:.1f}" height="{ROW - 6}" fill="{bar.colour}"/>',
            f'<text x="{LEFT + wide + 6:.1f}" y="{y + 14}">{html.escape(bar.text)}</text>',
        ]
    return "\n".join((*parts, "</svg>")) + "\n"


if __name__ == "__main__":
    sys.exit(main())
