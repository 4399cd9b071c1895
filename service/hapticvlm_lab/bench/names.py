"""Material from names alone: coverage, accuracy, calibration and confusion of `evidence.names`.

The word lists were committed before the names of pbr, ambientcg_tiles and pb_renders were read, but
for a first glance ("Wood001", "aluminum", "beryllium"), so these sets are held back; the author
knew those of models and caltech101. Textures are numbered variants of few words, so every figure is
also given over distinct words ("Wood001" and "Wood002" count once). Their labels were derived from
their names, so they test spelling more than judgement.

Calibration asks whether a confidence of 0.8 is right in 80 % of the cases: names are sorted into
bins by confidence, and the error is the mean distance between confidence and share right, weighted
by the size of the bins.
"""

from __future__ import annotations

import csv
import json
import re
import time
from collections import Counter, defaultdict
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np

from hapticvlm import materials
from hapticvlm.evidence.ladder import KNOWN, SURE, Evidence
from hapticvlm.evidence.names import from_name
from hapticvlm.statistics import wilson
from hapticvlm_lab.training import sources

SETS = ("models", "caltech101", "pbr", "ambientcg_tiles", "pb_renders")
SEEN = ("models", "caltech101")
SIBLING = Path(__file__).parents[4] / "shared" / "data"
EDGES = (0.0, 0.5, 0.7, 0.8, 0.9, 1.0)


@dataclass(frozen=True, slots=True)
class Name:
    """A name and its true material (UNKNOWN: none of the table)."""

    text: str
    truth: str


@dataclass(frozen=True, slots=True)
class Score:
    """Figures of one set; shares 0..1, with 95 % Wilson intervals where n allows."""

    set: str
    held_back: bool
    n: int
    coverage: float
    accuracy: float | None
    low: float
    high: float
    known: float
    balanced: float
    sure: float
    sure_accuracy: float | None
    calibration_error: float | None
    majority: float
    class_word: float
    any_word: float


def run(data: Path | None, as_json: bool) -> int:
    """Print tables or JSON; return 2 when there is no data."""
    folder = data or SIBLING
    if not (folder / "labels.csv").is_file():
        print(f"{folder} has no labels.csv: give a folder of labelled pictures with --data")
        return 2
    report = []
    for source in SETS:
        names = read_names(folder, source)
        distinct = sorted(set(map(_without_number, names)), key=lambda name: name.text)
        for title, chosen in ((source, names), (f"{source}, distinct words", distinct)):
            report.append(evaluate(title, chosen, held_back=source not in SEEN))
            if not as_json:
                _print_score(report[-1], chosen)
    timing = _microseconds([name.text for name in read_names(folder, "models")])
    if as_json:
        scores = [asdict(score) for score in report]
        result = {"measure": "names", "median_us": timing[0], "p99_us": timing[1], "sets": scores}
        print(json.dumps(result))
    else:
        print(f"one name: median {timing[0]:.0f} us, p99 {timing[1]:.0f} us")
    return 0


def read_names(data: Path, source: str) -> list[Name]:
    """List a set's names as a developer sees them: file stem, or folder for maps in folders."""
    with (data / "labels.csv").open(newline="", encoding="utf-8") as file:
        rows = [row for row in csv.DictReader(file) if row["path"].startswith(f"{source}/")]
    names = []
    for row in rows:
        path = Path(row["path"])
        text = path.parent.name if path.stem == "albedo" else path.stem
        names.append(Name(text, sources.material_of(row["class"])))
    return names


def evaluate(title: str, names: Sequence[Name], *, held_back: bool) -> Score:
    """Score one list of names; "known" are those that the ladder would not call unknown."""
    evidence = [from_name(name.text) for name in names]
    spoke = [(n, e) for n, e in zip(names, evidence, strict=True) if e is not None and e.material]
    right = [e.material == n.truth for n, e in spoke]
    sure = [(n, e) for n, e in spoke if e.confidence >= SURE]
    known = [(n, e) for n, e in spoke if e.confidence >= KNOWN]
    # Wilson's interval, since shares near 100 % of a few dozen names have no symmetric one.
    low, high = wilson(sum(right), len(right))
    counts = Counter(name.truth for name in names)
    per_class = [
        sum(e is not None and e.material == truth and e.confidence >= KNOWN for e in group)
        / len(group)
        for truth, group in _by_truth(names, evidence).items()
    ]
    return Score(
        set=title,
        held_back=held_back,
        n=len(names),
        coverage=len(spoke) / len(names),
        accuracy=_share(right),
        low=low,
        high=high,
        known=len(known) / len(names),
        balanced=float(np.mean(per_class)),
        sure=len(sure) / len(names),
        sure_accuracy=_share([e.material == n.truth for n, e in sure]),
        calibration_error=_calibration_error(spoke),
        majority=max(counts.values()) / len(names),
        class_word=_baseline(names, lambda material: (material.name,)),
        any_word=_baseline(names, lambda material: material.words),
    )


def _without_number(name: Name) -> Name:
    return Name(re.sub(r"[\d_]+[A-Z]?$|_(arnold|cycles|unreal)$", "", name.text), name.truth)


def _by_truth(
    names: Sequence[Name], evidence_of: Sequence[Evidence | None]
) -> dict[str, list[Evidence | None]]:
    groups: dict[str, list[Evidence | None]] = defaultdict(list)
    for name, evidence in zip(names, evidence_of, strict=True):
        if name.truth != materials.UNKNOWN:
            groups[name.truth].append(evidence)
    return groups


def _share(hits: Sequence[bool]) -> float | None:
    return sum(hits) / len(hits) if hits else None


def _baseline(names: Sequence[Name], words: Callable[[materials.Material], Sequence[str]]) -> float:
    """Return the share right if the first class with such a word inside the name is taken."""

    def guess(text: str) -> str:
        table = materials.MATERIALS.values()
        matches = (m.name for m in table if any(word in text.lower() for word in words(m)))
        return next(matches, materials.UNKNOWN)

    return sum(guess(name.text) == name.truth for name in names) / len(names)


def _bins(spoke: Sequence[tuple[Name, Evidence]]) -> list[tuple[int, float, float]]:
    """Return (n, mean confidence, share right) between EDGES."""
    rows = []
    for low, high in pairwise(EDGES):
        inside = [(n, e) for n, e in spoke if low <= e.confidence < high]
        if inside:
            mean = float(np.mean([e.confidence for _, e in inside]))
            rows.append(
                (len(inside), mean, sum(e.material == n.truth for n, e in inside) / len(inside))
            )
    return rows


def _calibration_error(spoke: Sequence[tuple[Name, Evidence]]) -> float | None:
    rows = _bins(spoke)
    if not rows:
        return None
    return sum(n * abs(believed - right) for n, believed, right in rows) / sum(
        n for n, _, _ in rows
    )


def _print_score(score: Score, names: Sequence[Name]) -> None:
    kind = "held back" if score.held_back else "known while the word lists were written"
    print(f"\n== {score.set}: n = {score.n}, {kind}")
    print(f"named {score.coverage:.1%}; right among these {_percent(score.accuracy)}", end="")
    print(f" [{score.low:.1%}, {score.high:.1%}]; sure of {score.sure:.1%}", end="")
    print(f", right among these {_percent(score.sure_accuracy)}")
    print(
        f"right of all, balanced over classes {score.balanced:.1%}; majority {score.majority:.1%}",
        end="",
    )
    print(f"; class name inside {score.class_word:.1%}; any class word inside {score.any_word:.1%}")
    evidence = [from_name(name.text) for name in names]
    spoke = [(n, e) for n, e in zip(names, evidence, strict=True) if e is not None]
    for n, mean, right in _bins(spoke):
        print(f"  confidence {mean:.2f}: right {right:.2f} (n = {n})")
    _print_confusion(names, evidence)


def _percent(share: float | None) -> str:
    return "-" if share is None else f"{share:.1%}"


def _print_confusion(names: Sequence[Name], evidence: Sequence[Evidence | None]) -> None:
    """Print truth by row, answer by column; "-" is silence or a confidence below KNOWN."""
    answers = [e.material if e and e.confidence >= KNOWN else "-" for e in evidence]
    cells = Counter((n.truth, a) for n, a in zip(names, answers, strict=True))
    rows = [
        name
        for name in (*materials.MATERIALS, materials.UNKNOWN)
        if any(t == name for t, _ in cells)
    ]
    columns = [name for name in (*materials.MATERIALS, "-") if any(a == name for _, a in cells)]
    print(f"{'truth':>10} |" + "".join(f"{column[:7]:>8}" for column in columns))
    for row in rows:
        print(f"{row:>10} |" + "".join(f"{cells[row, column]:>8}" for column in columns))


def _microseconds(texts: Sequence[str]) -> tuple[float, float]:
    """Return median and 99th percentile of from_name, us."""
    times = []
    for text in list(texts) * 40:
        start = time.perf_counter()
        from_name(text)
        times.append((time.perf_counter() - start) * 1e6)
    return float(np.median(times)), float(np.percentile(times, 99))
