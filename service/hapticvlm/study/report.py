"""The report of a study: one document of numbers, a text of it, pictures and a CSV."""

from __future__ import annotations

import json
from collections.abc import Iterable, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from hapticvlm.study import paper, plots, results, statistics
from hapticvlm.study.results import Cells, Results
from hapticvlm.study.statistics import Share
from hapticvlm.study.stimuli import StudyError
from hapticvlm.study.text import people, text_of

Document = dict[str, Any]


def report(folder: Path, out: Path | None, *, as_json: bool) -> str:
    """Evaluate the study in `folder`, write the files and return the text. Raises StudyError."""
    found = results.read(folder)
    if not found.counted:
        raise StudyError(f"{folder}: no trial is answered yet")
    document = evaluate(found)
    out = folder / "report" if out is None else out
    out.mkdir(parents=True, exist_ok=True)
    results.write_csv(out / "trials.csv", found.rows)
    _draw(out, document, [np.array(each["all_s"]) for each in document["reaction"]])
    return _finish(out, document, as_json=as_json)


def report_paper(out: Path | None, *, as_json: bool) -> str:
    """Evaluate the paper's counts; files only where `out` says."""
    document = evaluate_paper()
    if out is not None:
        out.mkdir(parents=True, exist_ok=True)
        _draw(out, document, None)
    return _finish(out, document, as_json=as_json)


def evaluate(found: Results) -> Document:
    """Turn a study's rows into numbers."""
    counts = results.confusion(found)
    names = [stimulus.name for stimulus in found.stimuli]
    factors = ([s.vibration for s in found.stimuli], [s.temperature for s in found.stimuli])
    by_person = _rights(found)
    document = _of_counts(counts, names, factors)
    document["simulated"] = found.simulated
    document["participants"] = len(found.participants)
    document["answered"], document["planned"] = len(found.rows), found.planned
    document["excluded"] = len(found.rows) - len(found.counted)
    document["repeated"] = sum(row.attempt > 1 for row in found.rows)
    document["silent"] = found.silent
    document["recognition"] = asdict(statistics.share_by_person(*_all(by_person)))
    for at, pattern in enumerate(document["patterns"]):
        pattern |= asdict(statistics.share_by_person(*_one(by_person, at)))
    document["reaction"] = [_reaction(found, name) for name in names]
    cells = results.cells(found)
    document["anova_missing"] = cells if isinstance(cells, str) else None
    return document if isinstance(cells, str) else document | _within(cells, factors, names)


def _within(cells: Cells, factors: tuple[list[str], list[str]], names: list[str]) -> Document:
    """Test within those people who felt every pattern."""
    vibrations, warmths = (list(dict.fromkeys(levels)) for levels in factors)
    places = [(vibrations.index(v), warmths.index(t)) for v, t in zip(*factors, strict=True)]
    flat = np.stack([cells.rates[:, i, j] for i, j in places], axis=1)
    ranks = (
        statistics.friedman(flat, "patterns"),
        statistics.friedman(cells.rates.mean(axis=2), "vibration"),
    )
    return {
        "complete": len(cells.rates),
        "incomplete": list(cells.left_out),
        "anova": [asdict(effect) for effect in statistics.anova(cells.rates)],
        "friedman": [asdict(found) for found in ranks if found is not None],
        "pairwise": [asdict(pair) for pair in statistics.pairwise_by_person(flat, names)],
        "pairwise_test": "paired t of each person's recognition"
        + (", of those who felt every pattern" if cells.left_out else ""),
    }


def evaluate_paper() -> Document:
    """Turn the paper's counts into the same numbers, as far as counts without people allow."""
    counts = paper.confusion()
    factors = (list(paper.VIBRATIONS) * 2, [t for t in paper.TEMPERATURES for _ in range(5)])
    document = _of_counts(counts, list(paper.CODES), factors)
    document |= {"simulated": False, "participants": paper.PARTICIPANTS, "notes": paper.NOTES}
    document |= {"answered": int(counts.sum()), "planned": int(counts.sum())}
    document |= {"excluded": 0, "repeated": None, "silent": None, "reaction": []}
    document["anova_missing"] = "single people's trials are unpublished"
    document["printed_anova"] = [
        {
            "as_printed": asdict(statistics.effect(name, f, df)),
            "two_way_df": asdict(statistics.effect(name, f, two_way)),
            "printed_p": p,
        }
        for name, f, df, two_way, p in paper.PRINTED
    ]
    return document


def _of_counts(
    counts: statistics.Counts, names: list[str], factors: tuple[list[str], list[str]]
) -> Document:
    """Tell what a confusion matrix tells by itself, trials taken for independent."""
    right, of = np.diag(counts).tolist(), counts.sum(axis=1).tolist()
    bits, bias = statistics.information_bits(counts)
    parts = []
    for factor, groups in zip(("vibration", "temperature"), factors, strict=True):
        levels, matrix = statistics.collapsed(counts, groups)
        share = statistics.share(int(np.trace(matrix)), int(matrix.sum()))
        rows = zip(levels, np.diag(matrix).tolist(), matrix.sum(axis=1).tolist(), strict=True)
        each = [{"name": name, **asdict(statistics.share(r, n))} for name, r, n in rows]
        parts.append(
            {
                "factor": factor,
                "levels": levels,
                "counts": matrix.tolist(),
                **asdict(share),
                "each": each,
            }
        )
    pairs = statistics.pairwise_pooled(right, of, names) if min(of) else []
    return {
        "names": names,
        "counts": counts.tolist(),
        "recognition": asdict(statistics.share(sum(right), sum(of))),
        "chance": 1 / len(names),
        "patterns": [
            {"name": name, **asdict(statistics.share(r, n))}
            for name, r, n in zip(names, right, of, strict=True)
        ],
        "axes": parts,
        "information": {"bits": bits, "bias": bias, "most": float(np.log2(len(names)))},
        "anova": [],
        "friedman": [],
        "complete": None,
        "incomplete": [],
        "pairwise": [asdict(pair) for pair in pairs],
        "pairwise_test": "Fisher's exact, trials of all people thrown together",
    }


def _rights(found: Results) -> list[list[tuple[int, int]]]:
    """Count (right, of) of each person and pattern, people first."""
    names = [stimulus.name for stimulus in found.stimuli]
    table = []
    for code in found.participants:
        mine = [row for row in found.counted if row.participant == code]
        each = [[row.correct for row in mine if row.presented == name] for name in names]
        table.append([(sum(right), len(right)) for right in each])
    return table


def _all(table: list[list[tuple[int, int]]]) -> tuple[list[int], list[int]]:
    rights = [sum(right for right, _ in person) for person in table]
    return rights, [sum(of for _, of in person) for person in table]


def _one(table: list[list[tuple[int, int]]], at: int) -> tuple[list[int], list[int]]:
    return [person[at][0] for person in table], [person[at][1] for person in table]


def _reaction(found: Results, name: str) -> Document:
    """Reaction times to one pattern, s, and the plate as its strokes began and ended, degC."""
    rows = [row for row in found.counted if row.presented == name]
    times = [row.reaction_s for row in rows]
    quartiles = np.percentile(times, [25, 50, 75]).tolist() if times else [None] * 3
    return {
        "name": name,
        "quartiles_s": quartiles,
        "onset_plate_c": _mean(row.onset_plate_c for row in rows),
        "plate_c": _mean(row.plate_c for row in rows),
        "all_s": times,
    }


def _mean(values: Iterable[float | None]) -> float | None:
    said = [value for value in values if value is not None]
    return float(np.mean(said)) if said else None


def _draw(out: Path, document: Document, times: Sequence[Any] | None) -> None:
    whole = (document["names"], np.array(document["counts"]))
    parts = [
        (f"{part['factor']} alone", (part["levels"], np.array(part["counts"])))
        for part in document["axes"]
    ]
    heading = f"{people(document['participants'])}, {document['answered']} trials"
    if document["simulated"]:
        heading += "; SIMULATED devices"
    plots.confusion(out / "confusion.png", heading, whole, parts)
    shares = [(each["name"], _share(each)) for each in document["patterns"]]
    plots.recognition(out / "recognition.png", heading, shares, times, document["chance"])


def _share(each: Document) -> Share:
    return Share(each["right"], each["of"], each["share"], each["wilson"], each["by_person"])


def _finish(out: Path | None, document: Document, *, as_json: bool) -> str:
    text, data = text_of(document), json.dumps(document)
    if out is not None:
        (out / "report.md").write_text(text + "\n", encoding="utf-8")
        (out / "report.json").write_text(data + "\n", encoding="utf-8")
        text += f"\n\nfiles in {out}"
    return data if as_json else text
