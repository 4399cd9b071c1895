"""Turns a study's rows, or the paper's counts, into the document of report.json. Writes no file.

The paper publishes a confusion matrix alone, so its document holds what that allows; a study adds
everything that needs single people's trials. What is not known is None or an empty list, so one
text and one set of pictures serve both.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import asdict
from typing import Any

import numpy as np

from hapticvlm.errors import installing
from hapticvlm_studio.design import paper
from hapticvlm_studio.report import claims, results, statistics
from hapticvlm_studio.report.results import Cells, Results

Document = dict[str, Any]
FORMAT = 2  # of report.json; 2 added ratings, people's answers and claims
PAPER_TITLE = "The study of the HapticVLM paper, evaluated again"


def evaluate(study: Results) -> Document:
    """Return the document of a study."""
    counts = results.confusion(study)
    names = [stimulus.name for stimulus in study.stimuli]
    factors = ([s.vibration for s in study.stimuli], [s.temperature for s in study.stimuli])
    by_person = _rights(study)
    document = _of_counts(counts, names, factors)
    title = study.form.title.get(study.form.languages[0])
    document["title"] = f"Study report: {title}" if title else "Study report"
    document["simulated"], document["heard"] = study.simulated, study.heard
    document["people"], document["ratings"] = _people(study), _ratings(study)
    document["participants"] = len(study.participants)
    document["answered"], document["planned"] = len(study.rows), study.planned
    document["excluded"] = len(study.rows) - len(study.counted)
    document["repeated"] = sum(row.attempt > 1 for row in study.rows)
    document["silent"] = study.silent
    # Everything up to here comes from counts, with Wilson's intervals. Where single people's trials
    # are known, as here, each share gets its interval by person too, and the one for all replaces
    # the one from counts.
    document["recognition"] = asdict(statistics.share_by_person(*_all(by_person)))
    for at, pattern in enumerate(document["patterns"]):
        pattern |= asdict(statistics.share_by_person(*_of_pattern(by_person, at)))
    for part in document["axes"]:
        part |= asdict(statistics.share_by_person(*_level_rights(study, part["factor"])))
    document["reaction"] = [_reaction(study, name) for name in names]
    # A string says why there can be no test within people; the pooled tests of `_of_counts` then
    # stay in the document.
    cells = results.cells(study)
    document["anova_missing"] = cells if isinstance(cells, str) else None
    if not isinstance(cells, str):
        document |= _within(cells, factors, names)
    return _claimed(document)


def _within(cells: Cells, factors: tuple[list[str], list[str]], names: list[str]) -> Document:
    """Return the tests within people, of those who felt every pattern."""
    vibrations, warmths = (list(dict.fromkeys(levels)) for levels in factors)
    places = [(vibrations.index(v), warmths.index(t)) for v, t in zip(*factors, strict=True)]
    # The pairwise tests want (people, patterns) in the order of `names`, the ANOVA (people,
    # vibrations, temperatures).
    flat = np.stack([cells.rates[:, i, j] for i, j in places], axis=1)
    # Friedman's test has no second factor. It is run over all patterns, and over the vibrations
    # with each person's temperatures averaged; two temperatures would be too few levels for it.
    ranks = (
        statistics.friedman(flat, "patterns"),
        statistics.friedman(cells.rates.mean(axis=2), "vibration"),
    )
    return {
        "complete": len(cells.rates),
        "pair_spread": _spread(flat),
        "incomplete": list(cells.left_out),
        **_anova(cells),
        "friedman": [asdict(test) for test in ranks if test is not None],
        "pairwise": [asdict(pair) for pair in statistics.pairwise_by_person(flat, names)],
        "pairwise_test": "paired t of each person's recognition"
        + (", of those who felt every pattern" if cells.left_out else ""),
    }


def _anova(cells: Cells) -> Document:
    """Return the ANOVA, or what must be installed for it."""
    try:
        effects = statistics.anova(cells.rates)
    except ModuleNotFoundError as error:
        name = (error.name or "statsmodels").partition(".")[0]
        return {"anova": [], "anova_missing": f"it needs {name}: `{installing(name)}`"}
    return {"anova": [asdict(effect) for effect in effects]}


def _spread(rates: statistics.Rates) -> float:
    """Return the median standard deviation of people's differences between two patterns."""
    # It converts the difference that a test would find, which is in standard deviations, into
    # percentage points.
    first, second = np.triu_indices(rates.shape[1], 1)
    return float(np.median(np.std(rates[:, first] - rates[:, second], axis=0, ddof=1)))


def _claimed(document: Document) -> Document:
    return {**document, "may": claims.may(document), "may_not": claims.may_not(document)}


def _people(study: Results) -> list[Document]:
    """Summarise people's answers about themselves; free answers are only counted."""
    summaries = []
    for question in study.form.question:
        answers = [person.answers[question.name] for person in study.people]
        answered = [answer for answer in answers if answer is not None]
        summary: Document = {"name": question.name, "kind": question.kind, "answers": len(answered)}
        if question.kind == "number" and answered:
            values = np.array(answered, dtype=np.float64)
            summary["mean"], summary["ends"] = float(values.mean()), [values.min(), values.max()]
            summary["sd"] = float(values.std(ddof=1)) if len(answered) > 1 else None
        if question.kind == "choice":
            summary["counts"] = {each.value: answered.count(each.value) for each in question.choice}
        summaries.append(summary)
    return summaries


def _ratings(study: Results) -> list[Document]:
    """Return each rating's mean with its interval by person, overall and for each pattern."""
    table = []
    for rating in study.form.rating:
        rows = [
            (row.participant, row.presented, row.ratings[rating.name])
            for row in study.counted
            if row.ratings is not None
        ]
        by_pattern = [
            {"name": stimulus.name, **_rated([row for row in rows if row[1] == stimulus.name])}
            for stimulus in study.stimuli
        ]
        whole = _rated(rows)
        table.append({"name": rating.name, "steps": rating.steps, **whole, "patterns": by_pattern})
    return table


def _rated(rows: list[tuple[str, str, int]]) -> Document:
    """Return the mean of people's means of (person, pattern, rating) rows; `of` counts people."""
    # A person who rated more often must not count for more, so each is averaged first.
    people = dict.fromkeys(who for who, _, _ in rows)
    means = [float(np.mean([value for who, _, value in rows if who == each])) for each in people]
    if not means:
        return {"of": 0, "mean": None, "by_person": None}
    mean, by_person = statistics.mean_by_person(means)
    return {"of": len(means), "mean": mean, "by_person": by_person}


def evaluate_paper() -> Document:
    """Return the document of the paper, as far as its counts allow."""
    counts = paper.confusion()
    factors = (list(paper.VIBRATIONS) * 2, [t for t in paper.TEMPERATURES for _ in range(5)])
    document = _of_counts(counts, list(paper.CODES), factors)
    document |= {"title": PAPER_TITLE, "simulated": False, "key": paper.KEY}
    document["labels"] = [f"{v}, {t}" for v, t in zip(*factors, strict=True)]
    document |= {"participants": paper.PARTICIPANTS, "notes": paper.NOTES}
    document |= {"answered": int(counts.sum()), "planned": int(counts.sum())}
    document |= {"excluded": 0, "repeated": None, "silent": None, "reaction": []}
    # The paper prints F and its degrees of freedom, from which p follows. The degrees of freedom
    # fit one factor of ten levels, not the 5 x 2 design, so p is given for both (docs/physics.md
    # 6.2).
    document["anova_missing"] = "single people's trials are unpublished"
    document["printed_anova"] = [
        {
            "as_printed": asdict(statistics.effect(name, f, df)),
            "two_way_df": asdict(statistics.effect(name, f, two_way)),
            "printed_p": p,
        }
        for name, f, df, two_way, p in paper.PRINTED
    ]
    return _claimed(document)


def _of_counts(
    counts: statistics.Counts, names: list[str], factors: tuple[list[str], list[str]]
) -> Document:
    """Return what a confusion matrix alone shows, assuming independent trials."""
    right = np.diag(counts).tolist()
    of = counts.sum(axis=1).tolist()
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
    # Fisher's test compares shares, so every pattern needs at least one trial.
    pairs = statistics.pairwise_pooled(right, of, names) if min(of) else []
    return {
        "format": FORMAT,
        "names": names,
        "labels": names,
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
        "pair_spread": None,
        "heard": False,
        "people": [],
        "ratings": [],
        "incomplete": [],
        "pairwise": [asdict(pair) for pair in pairs],
        "pairwise_test": "Fisher's exact test, trials of all people pooled",
    }


def _rights(study: Results) -> list[list[tuple[int, int]]]:
    """Return (right, of) of each person and pattern, people first."""
    names = [stimulus.name for stimulus in study.stimuli]
    table = []
    for code in study.participants:
        rows = [row for row in study.counted if row.participant == code]
        each = [[row.correct for row in rows if row.presented == name] for name in names]
        table.append([(sum(right), len(right)) for right in each])
    return table


def _all(table: list[list[tuple[int, int]]]) -> tuple[list[int], list[int]]:
    rights = [sum(right for right, _ in person) for person in table]
    return rights, [sum(of for _, of in person) for person in table]


def _level_rights(study: Results, factor: str) -> tuple[list[int], list[int]]:
    """Return each person's number of answers with the right level of a factor, and of answers."""
    rights = []
    for code in study.participants:
        rows = [row for row in study.counted if row.participant == code]
        rights.append([getattr(row, factor) == getattr(row, f"answered_{factor}") for row in rows])
    return [sum(each) for each in rights], [len(each) for each in rights]


def _of_pattern(table: list[list[tuple[int, int]]], at: int) -> tuple[list[int], list[int]]:
    return [person[at][0] for person in table], [person[at][1] for person in table]


def _reaction(study: Results, name: str) -> Document:
    """Return reaction times to one pattern in s, and the plate at its begin and end in degC."""
    rows = [row for row in study.counted if row.presented == name]
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
    known = [value for value in values if value is not None]
    return float(np.mean(known)) if known else None
