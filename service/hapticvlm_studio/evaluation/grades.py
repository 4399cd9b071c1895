"""Grades a method's answers and compares them with constants on the same pictures. Pure.

A picture without an answer is counted as such and enters no grade: it is not an error of 0 degC,
and constants are graded on the answered pictures too, so that both faced the same ones.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any, get_args

from hapticvlm import __version__
from hapticvlm_studio.evaluation.asking import Answered
from hapticvlm_studio.evaluation.scores import (
    PAPER,
    Guess,
    Rule,
    Score,
    constant,
    gain,
    score,
    share,
)


@dataclass(frozen=True, slots=True)
class Outcome:
    """Scores of a method and of the constants over the answered pictures.

    Where nothing was answered, the constants are graded on all pictures. `gain_c` is by how much
    the method's mean absolute error is below the best constant's, (value, low, high).
    """

    answers: Sequence[Answered]
    score: Score | None
    constants: dict[Rule, Score]
    best: Rule
    gain_c: tuple[float, float, float] | None


def grade(answers: Sequence[Answered]) -> Outcome:
    """Return the outcome of all answers."""
    guesses = [answer.guess for answer in answers if answer.guess is not None]
    asked = [answer for answer in answers if answer.guess is not None] or answers
    truths = [answer.labelled.truth_c for answer in asked]
    blind: dict[Rule, list[Guess]] = {}
    for rule in get_args(Rule):
        constants = constant(rule, truths)
        if constants is not None:
            blind[rule] = constants
    graded = {rule: _graded(constants, truths) for rule, constants in blind.items()}
    best = min(graded, key=lambda rule: graded[rule].mae_c)
    return Outcome(
        answers=answers,
        score=score(guesses, truths),
        constants=graded,
        best=best,
        gain_c=gain(guesses, blind[best], truths) if guesses else None,
    )


def figures(outcome: Outcome, method: str) -> dict[str, Any]:
    """Return everything as one map for JSON; a figure that does not exist is None."""
    return {
        "evaluate": "ambient",
        "version": __version__,
        "method": method,
        "asked": len(outcome.answers),
        **_flat(outcome.score),
        "constant": {"guess": outcome.best, **_flat(outcome.constants[outcome.best])},
        "constants": {rule: _flat(graded) for rule, graded in outcome.constants.items()},
        "gain_c": outcome.gain_c,
        "paper": {"n": PAPER[1], "within_8c": asdict(share(*PAPER))},
        "images": [_image(answer) for answer in outcome.answers],
    }


def _graded(guesses: Sequence[Guess], truths: Sequence[float]) -> Score:
    result = score(guesses, truths)
    assert result is not None  # there is at least one picture
    return result


def _flat(score: Score | None) -> dict[str, Any]:
    """Return a score with plain shares and their intervals as separate entries."""
    if score is None:
        return {"n": 0, "mae_c": None, "within_8c": None, "interval_coverage": None}
    within = score.within_8c
    coverage = score.interval_coverage
    return asdict(score) | {
        "within_8c": within.share,
        "within_8c_interval": (within.low, within.high),
        "interval_coverage": coverage.share,
        "interval_coverage_interval": (coverage.low, coverage.high),
    }


def _image(answer: Answered) -> dict[str, Any]:
    guess = (
        asdict(answer.guess) if answer.guess else {"value_c": None, "low_c": None, "high_c": None}
    )
    return {
        "image": answer.labelled.path.name,
        "temperature_c": answer.labelled.truth_c,
        **guess,
        "seconds": round(answer.seconds, 4),
        "why_not": answer.why_not or None,
    }
