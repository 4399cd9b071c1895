"""The chart as text: a table per source, the default's recall and confusion, what was skipped."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

from hapticvlm import materials
from hapticvlm_lab.bench.material.data import Source
from hapticvlm_lab.bench.material.protocols import REFERENCES
from hapticvlm_lab.bench.material.rows import Row, knee
from hapticvlm_lab.bench.material.scores import Open, Rejection, Score

_HEAD = (
    f"{'method':<38}{'core ms':>9}{'wall':>9}{'p99':>9}{'floors':>8}  {'of 4':<15}{'of 11':<15}"
    f"{'speaks, right':<15}" + "".join(f"{f'k = {k}':<10}" for k in REFERENCES) + "probe  unknown"
)


def print_source(source: Source, rows: Sequence[Row]) -> None:
    """Print the rows of one source."""
    mine = [row for row in rows if row.source == source.name]
    objects = {view.object_id: view.truth for view in source.views}
    counts = ", ".join(f"{name} {n}" for name, n in Counter(objects.values()).most_common())
    note = f"; {source.note}" if source.note else ""
    print(f"\n== {source.name}: {len(source.views)} pictures, objects: {counts}{note}")
    print(_HEAD)
    for row in mine:
        print(_line(row))
    print(knee_sentence(mine))
    for row in mine:
        if row.is_default:
            _print_confusion("zero-shot, of all", row.eleven, row)
            twenty = row.enrolled.get(str(REFERENCES[-1]))
            _print_confusion("enrolled, of 4", twenty.four if twenty else None, row)


def knee_sentence(rows: Sequence[Row]) -> str:
    """Return which method by the picture alone is best, and which cheaper one may equal it."""
    found = knee(rows)
    if found is None:
        return "no method was both timed and graded zero-shot"
    best, cheapest = found
    reach = "no cheaper one's interval reaches it"
    if cheapest is not best:
        reach = f"{cheapest.method} at {cheapest.latency_ms:.2g} ms reaches it with its interval"
    return f"zero-shot, of 4: {best.method} is best at {best.latency_ms:.2g} ms; {reach}"


def print_end(skipped: Sequence[str]) -> None:
    """Print how to read it, and what was left out."""
    print("\nBalanced accuracy, %, 95 % interval over objects; k: references a class from other")
    print(
        "objects of the source, among 4, +- s.d. of 20 draws; probe: logistic regression, 5-fold;"
    )
    print("unknown: share rejected where 5 % of the known are. Core, wall: median time of one core")
    print("and of the clock; p99: of the clock; floors: core time over that of decoding one JPEG.")
    for text in skipped:
        print(f"left out  {text}")


def _line(row: Row) -> str:
    mark = "* " if row.is_default else "  "
    cost = row.cost
    times = f"{'-':>9}{'-':>9}{'-':>9}{'-':>8}"
    if cost is not None:
        figures = (cost.median, cost.wall, cost.p99)
        times = "".join(f"{figure * row.views:>9.3g}" for figure in figures)
        times += f"{cost.floors * row.views:>8.3g}"
    few = [row.enrolled.get(str(k)) for k in REFERENCES]
    enrolled = "".join(f"{_spread(enrolment.four if enrolment else None):<10}" for enrolment in few)
    return (
        f"{mark + row.method:<38}{times}  {_share(row.four):<15}{_share(row.eleven):<15}"
        f"{_spoken(row.open):<15}{enrolled}{_percent(row.probe):<7}{_rejected(row.unknown)}"
    )


def _share(score: Score | None) -> str:
    if score is None:
        return "-"
    return f"{100 * score.accuracy:.0f} [{100 * score.low:.0f}, {100 * score.high:.0f}]"


def _spread(score: Score | None) -> str:
    if score is None or score.sd is None:
        return "-"
    return f"{100 * score.accuracy:.0f} +- {100 * score.sd:.0f}"


def _percent(score: Score | None) -> str:
    return "-" if score is None else f"{100 * score.accuracy:.0f}"


def _spoken(open_: Open | None) -> str:
    if open_ is None:
        return "-"
    right = "-" if open_.accuracy is None else f"{100 * open_.accuracy:.0f}"
    return f"{100 * open_.coverage:.0f}, {right}"


def _rejected(unknown: Rejection | None) -> str:
    if unknown is None:
        return "-"
    return f"{100 * unknown.rejected:.0f} (n = {unknown.n})"


def _print_confusion(title: str, score: Score | None, row: Row) -> None:
    """Print truth by row, answer by column, in % of the truth."""
    if score is None:
        return
    answers = {name for cells in score.confusion.values() for name in cells}
    columns = [name for name in (*materials.MATERIALS, "-") if name in answers]
    print(f"\n  {row.method}, {title}: {'truth':>9} |" + "".join(f"{c[:7]:>8}" for c in columns))
    for truth in (name for name in materials.MATERIALS if name in score.confusion):
        cells = score.confusion[truth]
        total = sum(cells.values())
        shares = "".join(f"{100 * cells.get(c, 0) / total:>8.0f}" for c in columns)
        print(f"{truth:>{len(row.method) + len(title) + 15}} |{shares}")
