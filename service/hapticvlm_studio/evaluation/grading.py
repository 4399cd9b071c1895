"""Grades of what was answered, beside constants graded on the same pictures. Pure.

What was not answered is counted and graded nowhere.
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
    calibration,
    constant,
    gain,
    score,
    share,
)


@dataclass(frozen=True, slots=True)
class Outcome:
    """Grades of a method and of the constants over what was answered, or asked where nothing was.

    sources: the method and the best constant on each source. gain_c: (value, low, high) by which
    the method's mean absolute error is below the best constant's.
    """

    answers: Sequence[Answered]
    score: Score | None
    constants: dict[Rule, Score]
    best: Rule
    sources: dict[str, tuple[Score, Score]]
    calibration: Sequence[tuple[float, float]]
    gain_c: tuple[float, float, float] | None


def grade(answers: Sequence[Answered]) -> Outcome:
    """Grade what was answered."""
    answered = [(answer, answer.guess) for answer in answers if answer.guess is not None]
    guesses = [guess for _, guess in answered]
    asked = [answer.labelled for answer, _ in answered] or [answer.labelled for answer in answers]
    truths = [labelled.truth_c for labelled in asked]
    blind: dict[Rule, list[Guess]] = {}
    for rule in get_args(Rule):
        found = constant(rule, truths)
        if found is not None:
            blind[rule] = found
    graded = {rule: _graded(found, truths) for rule, found in blind.items()}
    best = min(graded, key=lambda rule: graded[rule].mae_c)
    sources = {}
    for source in dict.fromkeys(answer.labelled.source for answer, _ in answered):
        at = [place for place, labelled in enumerate(asked) if labelled.source == source]
        true = [truths[place] for place in at]
        ours, theirs = ([all_[place] for place in at] for all_ in (guesses, blind[best]))
        sources[source] = _graded(ours, true), _graded(theirs, true)
    return Outcome(
        answers=answers,
        score=score(guesses, truths),
        constants=graded,
        best=best,
        sources=sources,
        calibration=calibration(guesses, truths) if guesses else [],
        gain_c=gain(guesses, blind[best], truths) if guesses else None,
    )


def figures(outcome: Outcome, method: str) -> dict[str, Any]:
    """Return everything as one JSON object; figures that there are none of are null."""
    return {
        "evaluate": "ambient",
        "version": __version__,
        "method": method,
        "asked": len(outcome.answers),
        **_flat(outcome.score),
        "constant": {"guess": outcome.best, **_flat(outcome.constants[outcome.best])},
        "constants": {rule: _flat(graded) for rule, graded in outcome.constants.items()},
        "gain_c": outcome.gain_c,
        "calibration": outcome.calibration,
        "sources": {
            name: {**_flat(ours), "constant": _flat(theirs)}
            for name, (ours, theirs) in outcome.sources.items()
        },
        "paper": {"n": PAPER[1], "within_8c": asdict(share(*PAPER))},
        "images": [_image(answer) for answer in outcome.answers],
    }


def _graded(guesses: Sequence[Guess], truths: Sequence[float]) -> Score:
    found = score(guesses, truths)
    assert found is not None
    return found


def _flat(score: Score | None) -> dict[str, Any]:
    """Spell a score with plain shares, their intervals beside them."""
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
        "source": answer.labelled.source,
        "temperature_c": answer.labelled.truth_c,
        **guess,
        "seconds": round(answer.seconds, 4),
        "why_not": answer.why_not or None,
    }
