"""`hapticvlm evaluate ambient`: a method against known temperatures, and against blind guesses."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path

from hapticvlm.commands.evaluate import plots, tables
from hapticvlm.commands.evaluate.asking import Ask, ask_all
from hapticvlm.commands.evaluate.grading import figures, grade
from hapticvlm.commands.evaluate.pictures import read_shots

NAME = "evaluate-ambient"


@dataclass(frozen=True, slots=True)
class Plan:
    """What to evaluate on, under which name, where plots go (None: none), and whether to talk."""

    file: Path
    method: str
    out: Path | None
    as_json: bool


def run(plan: Plan, ask: Ask) -> int:
    """Evaluate; 1 where nothing was answered. Raises ShotError."""
    answers = ask_all(ask, read_shots(plan.file))
    outcome = grade(answers)
    files: list[Path] = []
    if plan.out is not None:
        plan.out.mkdir(parents=True, exist_ok=True)
        files = plots.draw(outcome, plan.method, plan.out / NAME)
    if plan.as_json:
        report = figures(outcome, plan.method) | {"files": [str(path) for path in files]}
        print(json.dumps(report))
    else:
        tables.print_outcome(outcome, plan.method, files)
    return 0 if outcome.score is not None else 1
