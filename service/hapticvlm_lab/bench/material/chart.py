"""`hapticvlm chart material`: the accuracy of each method on the same pictures, beside its cost.

Rows are per source and never mixed, since a method may be good on renders and poor on photographs.
Each method must choose one of FOUR materials, then one of all, and then it may say "unknown".
None has seen a picture of the source.

Accuracy is balanced: the mean over classes of the share found of each, so that a source with many
wooden objects does not reward a method that says wood. The line of the picture joins the methods
that no cheaper one equals (pareto.py).
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from hapticvlm.commands.progress import track
from hapticvlm.palette import BLUE, INK, ORANGE, PURPLE, SOFT, VERMILION
from hapticvlm_lab.bench import figures
from hapticvlm_lab.bench.material.answers import ELEVEN, answer, embed
from hapticvlm_lab.bench.material.data import FOUR, Source, Where
from hapticvlm_lab.bench.material.methods import Floats, Method, assemble, networks
from hapticvlm_lab.bench.material.reading import load_sources
from hapticvlm_lab.bench.material.scores import Open, Score, open_score, score
from hapticvlm_lab.bench.material.timing import costs_ms
from hapticvlm_lab.bench.pareto import pareto
from hapticvlm_lab.bench.printing import publish

if TYPE_CHECKING:
    from matplotlib.axes import Axes

NAME = "chart-material"

WIDTH_IN = 12.0
PANEL_IN = 5.4
COLUMNS = 2
STYLE = {  # colour and marker of each family
    "guess": (SOFT, "_"),
    "stated": (ORANGE, "v"),
    "named": (PURPLE, "D"),
    "ours": (BLUE, "o"),
    "ladder": (VERMILION, "^"),
}


@dataclass(frozen=True, slots=True)
class Row:
    """One method on one source. None: it cannot be measured there.

    `latency_ms` is the median time of one core for one decision; None for what takes no time.
    """

    source: str
    method: str
    family: str
    is_default: bool
    cut: str
    four: Score | None
    eleven: Score | None
    open: Open | None
    latency_ms: float | None


def run(where: Where, named: Sequence[str], out: Path, *, as_json: bool) -> int:
    """Chart every source.

    named: networks as `--encoder` takes them, none for those of the data folder. Raises
    CaptureError, EncoderError, GalleryError, PictureError.
    """
    sources, skipped = load_sources(where)
    methods, missing = assemble(named or networks(where.data))
    skipped += missing
    stated = next((source for source in sources if source.stated), None)
    times = costs_ms(methods, stated)
    rows: list[Row] = []
    for source in track(sources, "asking every method about each source"):
        rows += chart_source(source, methods, times)
        if not as_json:
            print_source(source, rows)
    files = draw(rows, out / NAME)
    report = _report(sources, rows, skipped)
    return publish(out / NAME, report, files, as_json=as_json, show=partial(print_end, skipped))


def chart_source(
    source: Source, methods: Sequence[Method], times: Mapping[str, float]
) -> list[Row]:
    """Ask every method that fits the source; pictures are embedded once for all of them."""
    seen: dict[tuple[int, str], Floats | None] = {}
    rows = []
    for method in methods:
        if method.fits(source):
            key = (id(method.encoder), method.cut or source.cut)
            if key not in seen:
                seen[key] = embed(method, source)
            rows.append(_row(method, source, seen[key], times.get(method.name)))
    return rows


def _row(
    method: Method, source: Source, embeddings: Floats | None, latency_ms: float | None
) -> Row:
    answers = answer(method, source, embeddings)
    return Row(
        source=source.name,
        method=method.name,
        family=method.family,
        is_default=method.is_default,
        cut=method.cut or source.cut,
        four=score(answers.four, answers.truth, answers.objects, FOUR),
        eleven=score(answers.eleven, answers.truth, answers.objects, ELEVEN),
        open=None if answers.spoken is None else open_score(answers.spoken, answers.truth),
        latency_ms=latency_ms,
    )


def _report(
    sources: Sequence[Source], rows: Sequence[Row], skipped: Sequence[str]
) -> dict[str, object]:
    return {
        "chart": "material",
        "chance": {"four": 1 / len(FOUR), "eleven": 1 / len(ELEVEN)},
        "sources": {
            source.name: {
                "pictures": len(source.views),
                "cut": source.cut,
                "note": source.note,
            }
            for source in sources
        },
        "rows": [asdict(row) for row in rows],
        "skipped": list(skipped),
    }


def undominated(rows: Sequence[Row]) -> list[Row]:
    """Return the rows that no cheaper one equals, zero-shot, of 4; cheapest first."""
    timed = [row for row in rows if row.four is not None and row.latency_ms is not None]
    return pareto(timed, lambda row: row.latency_ms or 0.0, _accuracy)


def weakness(rows: Sequence[Row]) -> tuple[str, float] | None:
    """Return the class that the default finds least often, and its recall; None if not graded."""
    default = next((row.four for row in rows if row.is_default and row.four is not None), None)
    if default is None:
        return None
    return min(default.recall.items(), key=lambda item: (item[1], item[0]))


def _accuracy(row: Row) -> float:
    return row.four.accuracy if row.four else 0.0


def print_source(source: Source, rows: Sequence[Row]) -> None:
    """Print the rows of one source."""
    mine = [row for row in rows if row.source == source.name]
    objects = {view.object_id: view.truth for view in source.views}
    counts = ", ".join(f"{name} {n}" for name, n in Counter(objects.values()).most_common())
    note = f"; {source.note}" if source.note else ""
    print(f"\n== {source.name}: {len(source.views)} pictures, objects: {counts}{note}")
    print(f"{'method':<38}{'core ms':>9}  {'of 4':<15}{'of 11':<15}speaks, right")
    for row in mine:
        print(_line(row))
    for row in mine:
        if row.is_default and row.eleven is not None:
            found = ", ".join(f"{name} {share:.0%}" for name, share in row.eleven.recall.items())
            print(f"the default finds, of all: {found}")


def print_end(skipped: Sequence[str]) -> None:
    """Print the legend, and the sources and methods that were skipped."""
    print("\nBalanced accuracy, %, 95 % interval over objects. Core: median time of one core.")
    for text in skipped:
        print(f"skipped  {text}")


def _line(row: Row) -> str:
    mark = "* " if row.is_default else "  "
    core_ms = "-" if row.latency_ms is None else f"{row.latency_ms:.3g}"
    return (
        f"{mark + row.method:<38}{core_ms:>9}  {_share(row.four):<15}{_share(row.eleven):<15}"
        f"{_spoken(row.open)}"
    )


def _share(score: Score | None) -> str:
    if score is None:
        return "-"
    return f"{100 * score.accuracy:.0f} [{100 * score.low:.0f}, {100 * score.high:.0f}]"


def _spoken(open_: Open | None) -> str:
    if open_ is None:
        return "-"
    right = "-" if open_.accuracy is None else f"{100 * open_.accuracy:.0f}"
    return f"{100 * open_.coverage:.0f}, {right}"


def draw(rows: Sequence[Row], stem: Path) -> list[Path]:
    """Write `stem`.png and .svg; return both. Methods that take no time are not drawn."""
    sources = list(dict.fromkeys(row.source for row in rows))
    size_in = (WIDTH_IN, PANEL_IN * -(-len(sources) // COLUMNS) + 0.9)
    with figures.figure(stem, size_in, len(sources), COLUMNS) as (drawn, panels):
        figures.title(
            drawn,
            "Material of 4 (wood, glass, fabric, metal): balanced accuracy with 95 % interval over "
            "objects, against the median time one core takes.\n"
            "Ringed: the default. Line: no cheaper one is as good.",
        )
        for axes, source in zip(panels, sources, strict=True):
            mine = [row for row in rows if row.source == source]
            dots = [row for row in mine if row.four is not None and row.latency_ms is not None]
            _panel(axes, mine, dots)
            places = [(row.latency_ms or 0.0, 100 * _accuracy(row)) for row in dots]
            labels = [
                (x, y, row.method + " (default)" * row.is_default, STYLE[row.family][0])
                for row, (x, y) in zip(dots, places, strict=True)
            ]
            figures.place(axes, labels, places)
    return figures.files(stem)


def _panel(axes: Axes, rows: Sequence[Row], dots: Sequence[Row]) -> None:
    for row in dots:
        _dot(axes, row)
    corners = [(row.latency_ms or 0.0, 100 * _accuracy(row)) for row in undominated(dots)]
    if corners:
        axes.step(*zip(*corners, strict=True), where="post", color=INK, linewidth=0.8, zorder=1)
    figures.level(axes, 25, "chance of 4")
    axes.set_xscale("log")
    axes.set_xlim(figures.span([row.latency_ms or 0.0 for row in dots]))
    axes.set_ylim(0, 104)
    axes.set_title(_heading(rows))
    axes.set_xlabel("ms of one core a decision")
    axes.set_ylabel("balanced accuracy of 4, %")


def _dot(axes: Axes, row: Row) -> None:
    assert row.four is not None
    assert row.latency_ms is not None
    colour, marker = STYLE[row.family]
    x, y = row.latency_ms, 100 * row.four.accuracy
    low, high = 100 * row.four.low, 100 * row.four.high
    axes.vlines(x, low, high, color=colour, linewidth=1.0, alpha=0.45, zorder=2)
    axes.plot(x, y, marker, color=colour, markersize=7, zorder=4)
    if row.is_default:
        figures.ring(axes, x, y)


def _heading(rows: Sequence[Row]) -> str:
    graded = next((row.four for row in rows if row.four is not None), None)
    if graded is None:
        return rows[0].source
    counts = ", ".join(f"{name} {count}" for name, count in graded.classes.items())
    weak = weakness(rows)
    least = "" if weak is None else f"\ndefault at its weakest: {weak[0]}, {weak[1]:.0%} found"
    return f"{rows[0].source}: objects of {counts}{least}"
