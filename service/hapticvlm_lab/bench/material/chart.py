"""`hapticvlm chart material`: every method on the same pictures, accuracy beside what it costs.

Rows are per source and never mixed. Zero-shot forces an answer among FOUR and among all classes,
then allows "unknown"; enrolled and probe use references of the source itself, by object.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from functools import partial
from pathlib import Path

from hapticvlm import materials
from hapticvlm.commands.progress import track
from hapticvlm_lab.bench.material import plots, tables
from hapticvlm_lab.bench.material.answers import ELEVEN, Answers, answer, embed
from hapticvlm_lab.bench.material.data import FOUR, Source, Where
from hapticvlm_lab.bench.material.methods import (
    NEAREST,
    Floats,
    GalleryHead,
    Method,
    assemble,
    for_source,
    networks,
)
from hapticvlm_lab.bench.material.protocols import REFERENCES, LabelledEmbeddings, enrolled, probe
from hapticvlm_lab.bench.material.reading import load_sources, read_teaching
from hapticvlm_lab.bench.material.rows import Enrolment, Row
from hapticvlm_lab.bench.material.scores import Open, Rejection, open_score, rejection, score
from hapticvlm_lab.bench.material.timing import Cost, costs
from hapticvlm_lab.bench.printing import made_with, publish

NAME = "chart-material"


def run(where: Where, named: Sequence[str], out: Path, *, as_json: bool) -> int:
    """Chart all that is there; 2 when there is no picture to chart on.

    named: networks as `--encoder` takes them, none for those of the data folder. Raises
    CaptureError, EncoderError, GalleryError, PictureError.
    """
    sources, skipped = load_sources(where)
    if not sources:
        print("\n".join(["no pictures to chart on:", *skipped]))
        return 2
    teaching = read_teaching(where.data)
    methods, missing = assemble(named or networks(where.data), teaching)
    skipped += missing
    stated = next((source for source in sources if source.stated), None)
    times = costs(for_source(methods, sources[0]), stated)
    rows: list[Row] = []
    for source in track(sources, "asking every method about each source"):
        rows += chart_source(source, for_source(methods, source), times)
        if not as_json:
            tables.print_source(source, rows)
    files = plots.draw(rows, out / NAME)
    figures = _figures(sources, rows, skipped) | {"files": [str(path) for path in files]}
    end = partial(tables.print_end, skipped)
    return publish(out / f"{NAME}.json", figures, as_json=as_json, show=end)


def chart_source(source: Source, methods: Sequence[Method], times: Mapping[str, Cost]) -> list[Row]:
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


def _row(method: Method, source: Source, embeddings: Floats | None, cost: Cost | None) -> Row:
    found = answer(method, source, embeddings)
    labelled = None
    if embeddings is not None and not method.rungs:
        sharpness = _sharpness(method)
        labelled = LabelledEmbeddings(
            embeddings, source.truth, source.objects, sharpness, method.fused
        )
    views = len(source.views) / len(set(source.objects.tolist())) if method.fused else 1.0
    return Row(
        source=source.name,
        method=method.name,
        family=method.family,
        is_default=method.is_default,
        cut=method.cut or source.cut,
        views=round(views, 2),
        references=method.references if found is not None else "",
        four=None if found is None else score(found.four, found.truth, found.objects, FOUR),
        eleven=None if found is None else score(found.eleven, found.truth, found.objects, ELEVEN),
        open=None if found is None else _open(found),
        unknown=None if found is None else _rejection(found),
        enrolled={} if labelled is None else {str(k): _enrolment(labelled, k) for k in REFERENCES},
        probe=None if labelled is None else probe(labelled, FOUR),
        cost=cost,
    )


def _sharpness(method: Method) -> float:
    head = method.head
    return (
        head.gallery.calibration.sharpness if isinstance(head, GalleryHead) else NEAREST.sharpness
    )


def _open(answers: Answers) -> Open | None:
    known = answers.truth != materials.UNKNOWN
    if answers.spoken is None or not known.any():
        return None
    return open_score(
        answers.spoken[known], answers.sure[known], answers.truth[known], answers.objects[known]
    )


def _rejection(answers: Answers) -> Rejection | None:
    if answers.familiar is None:
        return None
    return rejection(answers.familiar, answers.truth != materials.UNKNOWN, answers.objects)


def _enrolment(labelled: LabelledEmbeddings, count: int) -> Enrolment:
    four, _ = enrolled(labelled, FOUR, count)
    eleven, unknown = enrolled(labelled, ELEVEN, count)
    return Enrolment(four, eleven, unknown)


def _figures(
    sources: Sequence[Source], rows: Sequence[Row], skipped: Sequence[str]
) -> dict[str, object]:
    return {
        "chart": "material",
        **made_with(),
        "floor": "decoding a 448 px JPEG",
        "chance": {"four": 1 / len(FOUR), "eleven": 1 / len(ELEVEN)},
        "sources": {
            source.name: {
                "pictures": len(source.views),
                "cut": source.cut,
                "note": source.note,
                "knee": tables.knee_sentence([row for row in rows if row.source == source.name]),
            }
            for source in sources
        },
        "rows": [asdict(row) for row in rows],
        "skipped": list(skipped),
    }
