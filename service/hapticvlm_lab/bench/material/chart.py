"""`hapticvlm chart material`: every method on the same pictures, accuracy beside what it costs.

Rows are per source and never mixed. Zero-shot forces an answer among FOUR and among all classes,
then allows "unknown"; enrolled and probe use references of the source itself, by object.
"""

from __future__ import annotations

import json
import platform
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

from hapticvlm import __version__, materials
from hapticvlm.commands.progress import track
from hapticvlm_lab.bench.material import plots, tables
from hapticvlm_lab.bench.material.answers import ELEVEN, Answers, answer, embed
from hapticvlm_lab.bench.material.data import FOUR, Source, Where
from hapticvlm_lab.bench.material.methods import (
    NEAREST,
    Floats,
    GalleryHead,
    Method,
    Wiring,
    assemble,
    for_source,
)
from hapticvlm_lab.bench.material.protocols import REFERENCES, Looked, enrolled, probe
from hapticvlm_lab.bench.material.reading import load_sources, read_teaching
from hapticvlm_lab.bench.material.rows import Enrolment, Row
from hapticvlm_lab.bench.material.scores import Open, Rejection, open_score, rejection, score
from hapticvlm_lab.bench.material.timing import Cost, costs

NAME = "chart-material"


@dataclass(frozen=True, slots=True)
class Plan:
    """What to chart: pictures, further encoders, where results go, and whether to print tables."""

    where: Where
    variants: Path | None
    out: Path
    as_json: bool


def run(plan: Plan, wiring: Wiring) -> int:
    """Chart all that is there; 2 when there is no picture to chart on.

    Raises CaptureError, EncoderError, GalleryError, PictureError.
    """
    sources, skipped = load_sources(plan.where, wiring.labels)
    if not sources:
        print("\n".join(["no pictures to chart on:", *skipped]))
        return 2
    teaching = read_teaching(plan.where.data, wiring.labels)
    methods, missing = assemble(wiring, plan.where.data, plan.variants, teaching)
    skipped += missing
    stated = next((source for source in sources if source.stated), None)
    times = costs(for_source(methods, sources[0]), stated)
    rows: list[Row] = []
    for source in track(sources, "asking every method about each source"):
        rows += chart_source(source, for_source(methods, source), times)
        if not plan.as_json:
            tables.print_source(source, rows)
    files = plots.draw(rows, plan.out / NAME)
    figures = _figures(sources, rows, skipped) | {"files": [str(path) for path in files]}
    (plan.out / f"{NAME}.json").write_text(json.dumps(figures, indent=1) + "\n", encoding="utf-8")
    if plan.as_json:
        print(json.dumps(figures))
    else:
        tables.print_end(skipped, files)
    return 0


def chart_source(source: Source, methods: Sequence[Method], times: Mapping[str, Cost]) -> list[Row]:
    """Ask every method that fits the source; a look is taken once, however often it is used."""
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
    said = answer(method, source, embeddings)
    look = None
    if embeddings is not None and not method.rungs:
        sharpness = _sharpness(method)
        look = Looked(embeddings, source.truth, source.objects, sharpness, method.fused)
    views = len(source.views) / len(set(source.objects.tolist())) if method.fused else 1.0
    return Row(
        source=source.name,
        method=method.name,
        family=method.family,
        is_default=method.is_default,
        cut=method.cut or source.cut,
        views=round(views, 2),
        references=method.references if said is not None else "",
        four=None if said is None else score(said.four, said.truth, said.objects, FOUR),
        eleven=None if said is None else score(said.eleven, said.truth, said.objects, ELEVEN),
        open=None if said is None else _open(said),
        unknown=None if said is None else _rejection(said),
        enrolled={} if look is None else {str(k): _enrolment(look, k) for k in REFERENCES},
        probe=None if look is None else probe(look, FOUR),
        cost=cost,
    )


def _sharpness(method: Method) -> float:
    head = method.head
    return (
        head.gallery.calibration.sharpness if isinstance(head, GalleryHead) else NEAREST.sharpness
    )


def _open(said: Answers) -> Open | None:
    known = said.truth != materials.UNKNOWN
    if said.spoken is None or not known.any():
        return None
    return open_score(said.spoken[known], said.sure[known], said.truth[known], said.objects[known])


def _rejection(said: Answers) -> Rejection | None:
    if said.familiar is None:
        return None
    return rejection(said.familiar, said.truth != materials.UNKNOWN, said.objects)


def _enrolment(look: Looked, count: int) -> Enrolment:
    four, _ = enrolled(look, FOUR, count)
    eleven, unknown = enrolled(look, ELEVEN, count)
    return Enrolment(four, eleven, unknown)


def _figures(
    sources: Sequence[Source], rows: Sequence[Row], skipped: Sequence[str]
) -> dict[str, object]:
    return {
        "chart": "material",
        "version": __version__,
        "machine": platform.machine(),
        "python": platform.python_version(),
        "numpy": np.__version__,
        "floor": "decoding a 448 px JPEG",
        "chance": {"four": 1 / len(FOUR), "eleven": 1 / len(ELEVEN)},
        "sources": {
            one.name: {
                "pictures": len(one.views),
                "cut": one.cut,
                "note": one.note,
                "knee": tables.knee_sentence([row for row in rows if row.source == one.name]),
            }
            for one in sources
        },
        "rows": [asdict(row) for row in rows],
        "skipped": list(skipped),
    }
