"""Reads a study's folder into one row per answered trial, and rows into counts. No statistics.

A participant's file is a log of events in the order in which they happened; a row joins those of
one trial: its answer, what the devices reported of its pattern, its ratings, and whether something
spoiled it. Rows contain participants' codes only, so the CSV of trials may be published as it is.
What people answered about themselves is written to another file.
"""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, fields, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from hapticvlm import documents
from hapticvlm_studio.design.design import Design, read_design
from hapticvlm_studio.design.form import Answer, Form
from hapticvlm_studio.design.stimuli import Stimulus
from hapticvlm_studio.trials.player import is_silence
from hapticvlm_studio.trials.progress import Event
from hapticvlm_studio.trials.record import events

# A pause or stop after the answer: the pattern had been presented, so the trial counts.
INTERRUPTED = "interrupted"


@dataclass(frozen=True, slots=True)
class Row:
    """One answered trial; times in s, plate in degC, None where not known.

    `onset_plate_c` is the plate when the first stroke began, `plate_c` when the last one ended.
    """

    participant: str
    trial: int
    block: int
    attempt: int
    vibration: str
    temperature: str
    presented: str
    answered: str
    answered_vibration: str
    answered_temperature: str
    correct: bool
    reaction_s: float
    onset_plate_c: float | None = None
    plate_c: float | None = None
    setpoint_c: float | None = None
    limited_by: str | None = None
    spoiled: str | None = None
    ratings: Mapping[str, int] | None = None

    @property
    def counts(self) -> bool:
        """Whether the devices presented the pattern as intended."""
        return self.spoiled in (None, INTERRUPTED)


@dataclass(frozen=True, slots=True)
class Person:
    """One participant's answers about themselves; an answer that was not given is None."""

    participant: str
    language: str
    answers: Mapping[str, Answer | None]


@dataclass(frozen=True, slots=True)
class Results:
    """All rows of a study.

    `simulated`: at least one device was simulated at some time, so nothing may be claimed about
    people. `heard`: a pilot in which a page played the vibration. `silent` counts the
    presentations, answered or not, in which the speaker played nothing. `planned` is the number of
    trials of all participants.
    """

    stimuli: tuple[Stimulus, ...]
    rows: tuple[Row, ...]
    participants: tuple[str, ...]
    planned: int
    simulated: bool
    silent: int
    form: Form
    people: tuple[Person, ...]
    heard: bool

    @property
    def counted(self) -> tuple[Row, ...]:
        """The rows that enter the statistics."""
        return tuple(row for row in self.rows if row.counts)


def read(folder: Path) -> Results:
    """Read a study's folder, without participants who answered nothing. Raises StudyError."""
    design = read_design(folder)
    files = {code: events(folder, code) for code in design.participants}
    rows = [row for code, file in files.items() for row in _rows(design, code, file)]
    simulated = any(
        event["event"] == "opened" and any(d["simulated"] for d in event["devices"].values())
        for file in files.values()
        for event in file
    )
    # Planned trials count everyone in the design, present or not: a report that forgot those who
    # have not begun would look complete too soon.
    present = tuple(
        code for code in design.participants if any(r.participant == code for r in rows)
    )
    planned = sum(len(names) for names in design.trials.values())
    silent = sum(
        event["event"] == "spoiled" and is_silence(event["why"])
        for file in files.values()
        for event in file
    )
    people = tuple(_person(design, code, files[code]) for code in present)
    heard = any(e["event"] == "opened" and e.get("hear") for f in files.values() for e in f)
    return Results(
        design.stimuli, tuple(rows), present, planned, simulated, silent, design.form, people, heard
    )


def _person(design: Design, code: str, file: Iterable[Event]) -> Person:
    language = design.form.languages[0]
    answers: dict[str, Answer | None] = {each.name: None for each in design.form.question}
    for event in file:
        if event["event"] == "agreed":
            language = event["language"]
        elif event["event"] == "told":
            answers |= event["answers"]
    return Person(code, language, answers)


def _rows(design: Design, code: str, file: Iterable[Event]) -> Iterable[Row]:
    """Join the events of each answered trial into a row.

    Events of trials that were presented but not answered are dropped: such a trial is presented
    again, and its answer then makes the row.
    """
    rows: dict[int, Row] = {}
    for event in file:
        trial = event.get("trial")
        # A trial is answered once, and what else is known of it may follow in any order: the
        # pattern may still be playing when its answer comes. Events of an attempt that was not
        # answered find no row here and are dropped.
        if event["event"] == "answered":
            rows[event["trial"]] = _row(design, code, event)
        elif event["event"] == "played" and trial in rows:
            names = ("onset_plate_c", "plate_c", "setpoint_c", "limited_by")
            reported: Event = {name: event.get(name) for name in names}
            rows[trial] = replace(rows[trial], **reported)
        elif event["event"] == "rated" and trial in rows:
            rows[trial] = replace(rows[trial], ratings=event["ratings"])
        elif event["event"] == "spoiled" and trial in rows:
            rows[trial] = replace(rows[trial], spoiled=event["why"])
    return rows.values()


def _row(design: Design, code: str, event: Event) -> Row:
    presented = design.stimulus(event["pattern"])
    answered = design.stimulus(event["answered"])
    return Row(
        participant=code,
        trial=event["trial"],
        block=event["trial"] // len(design.stimuli),
        attempt=event["attempt"],
        vibration=presented.vibration,
        temperature=presented.temperature,
        presented=presented.name,
        answered=answered.name,
        answered_vibration=answered.vibration,
        answered_temperature=answered.temperature,
        correct=presented.name == answered.name,
        reaction_s=event["reaction_s"],
    )


def write_csv(path: Path, results: Results, *, decimal_comma: bool = False) -> None:
    """Write one line per trial, with a header; missing values are empty. Raises OSError.

    `decimal_comma`: as a spreadsheet opens it where the decimal mark is a comma.
    """
    columns = [field.name for field in fields(Row) if field.name != "ratings"]
    names = [rating.name for rating in results.form.rating]
    lines = []
    for row in results.rows:
        rated = row.ratings or {}
        values = {**asdict(row), "correct": int(row.correct)}
        lines.append([*(values[name] for name in columns), *(rated.get(name) for name in names)])
    header = [*columns, *(f"rating_{name}" for name in names)]
    _write(path, header, lines, decimal_comma=decimal_comma)


def write_people(path: Path, results: Results, *, decimal_comma: bool = False) -> None:
    """Write one line per participant, with their answers about themselves. Raises OSError.

    `decimal_comma`: as in `write_csv`.
    """
    names = [question.name for question in results.form.question]
    rows = [
        [person.participant, person.language, *(person.answers[name] for name in names)]
        for person in results.people
    ]
    _write(path, ["participant", "language", *names], rows, decimal_comma=decimal_comma)


def _write(
    path: Path, header: Sequence[str], lines: Iterable[Sequence[object]], *, decimal_comma: bool
) -> None:
    # Excel takes a CSV file without a byte-order mark for the machine's old code page.
    table = io.StringIO(newline="")
    csv.writer(table, delimiter=";" if decimal_comma else ",").writerows(
        [_cell(cell, decimal_comma=decimal_comma) for cell in line] for line in (header, *lines)
    )
    documents.replace_file(path, table.getvalue().encode("utf-8-sig"))


def _cell(value: object, *, decimal_comma: bool) -> object:
    if decimal_comma and isinstance(value, float):
        return str(value).replace(".", ",")
    return documents.spreadsheet_cell(value)


def confusion(results: Results) -> NDArray[np.int64]:
    """Count how often each pattern (rows) was answered as each (columns), (n, n), design order."""
    at = {stimulus.name: i for i, stimulus in enumerate(results.stimuli)}
    counts = np.zeros((len(at), len(at)), dtype=np.int64)
    for row in results.counted:
        counts[at[row.presented], at[row.answered]] += 1
    return counts


@dataclass(frozen=True, slots=True)
class Cells:
    """Shares recognised, (people, vibrations, temperatures), of those who felt every pattern."""

    rates: NDArray[np.float64]
    left_out: tuple[str, ...]  # codes of the others


def cells(results: Results) -> Cells | str:
    """Return the shares recognised of everyone who felt every pattern, or why there are none.

    A repeated-measures ANOVA needs every person in every cell, so people with a missing cell are
    left out and named; filling the cell in would invent data.
    """
    vibrations, temperatures = levels(results.stimuli)
    if (
        len(vibrations) * len(temperatures) != len(results.stimuli)
        or min(len(vibrations), len(temperatures)) < 2
    ):
        return "the patterns are not every vibration at every temperature"
    # Cells begin as NaN, so that a cell without a trial differs from one without a correct answer.
    rates = np.full((len(results.participants), len(vibrations), len(temperatures)), np.nan)
    rights: dict[tuple[str, str, str], list[bool]] = {}
    for row in results.counted:
        key = (row.participant, row.vibration, row.temperature)
        rights.setdefault(key, []).append(row.correct)
    for (code, vibration, temperature), right in rights.items():
        place = vibrations.index(vibration), temperatures.index(temperature)
        rates[results.participants.index(code), *place] = sum(right) / len(right)
    is_complete = ~np.isnan(rates).any(axis=(1, 2))
    if is_complete.sum() < 2:
        return "it needs at least two participants who felt every pattern"
    others = zip(results.participants, is_complete, strict=True)
    return Cells(rates[is_complete], tuple(code for code, complete in others if not complete))


def levels(stimuli: Sequence[Stimulus]) -> tuple[list[str], list[str]]:
    """Return the levels of both factors, in order of appearance."""
    vibrations = dict.fromkeys(stimulus.vibration for stimulus in stimuli)
    return list(vibrations), list(dict.fromkeys(stimulus.temperature for stimulus in stimuli))
