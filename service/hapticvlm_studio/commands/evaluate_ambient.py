"""`hapticvlm evaluate ambient`: grades temperatures and prints the result."""

from __future__ import annotations

import json
from pathlib import Path

from hapticvlm.evidence.reading import COVERAGE
from hapticvlm_studio.evaluation.asking import Ask, ask_all
from hapticvlm_studio.evaluation.grades import Outcome, figures, grade
from hapticvlm_studio.evaluation.pictures import read_pictures
from hapticvlm_studio.evaluation.scores import PAPER, Score, Share, share

MAX_LINES = 40  # pictures listed


def run(file: Path, method: str, ask: Ask, *, as_json: bool) -> int:
    """Grade and print; return 1 where nothing was answered. Raises LabelledPictureError."""
    answers = ask_all(ask, read_pictures(file))
    outcome = grade(answers)
    if as_json:
        print(json.dumps(figures(outcome, method)))
    else:
        print_outcome(outcome, method)
    return 0 if outcome.score is not None else 1


def print_outcome(outcome: Outcome, method: str) -> None:
    """Print the outcome for a person."""
    _print_pictures(outcome)
    print(f"\n{'':<34}{'n':>5}  {'MAE, degC':<20}{'within 8 degC':<18}{'in interval':<18}width")
    _print_score(method, outcome.score)
    for rule, score in outcome.constants.items():
        mark = " (best)" if rule == outcome.best else ""
        _print_score(f"constant: {rule}{mark}", score)
    paper = share(*PAPER)
    print(
        f"{'the paper, on its own pictures':<34}{PAPER[1]:>5}  {'not stated':<20}{_percent(paper)}"
    )
    print(_verdict(outcome, method))


def _print_pictures(outcome: Outcome) -> None:
    print(f"\n{'picture':<34}{'truth':>7}{'guess':>7}  {'interval':<16}{'error':>7}")
    for answer in outcome.answers[:MAX_LINES]:
        name = answer.labelled.path.name[-33:]
        truth = answer.labelled.truth_c
        if answer.guess is None:
            print(f"{name:<34}{truth:>7.1f}{'-':>7}  {answer.why_not}")
            continue
        ends = f"{answer.guess.low_c:.1f} to {answer.guess.high_c:.1f}"
        columns = f"{answer.guess.value_c:>7.1f}  {ends:<16}{answer.guess.value_c - truth:>+7.1f}"
        print(f"{name:<34}{truth:>7.1f}{columns}")
    if len(outcome.answers) > MAX_LINES:
        print(f"... and {len(outcome.answers) - MAX_LINES} more; --json lists all")


def _print_score(title: str, score: Score | None) -> None:
    if score is None:
        print(f"{title:<34}{0:>5}  nothing was answered")
        return
    mean = f"{score.mae_c:.1f} [{score.mae_low_c:.1f}, {score.mae_high_c:.1f}]"
    shares = f"{_percent(score.within_8c):<18}{_percent(score.interval_coverage):<18}"
    print(f"{title:<34}{score.n:>5}  {mean:<20}{shares}{score.interval_width_c:.0f}")


def _percent(rate: Share) -> str:
    return f"{100 * rate.share:.0f} % [{100 * rate.low:.0f}, {100 * rate.high:.0f}]"


def _verdict(outcome: Outcome, method: str) -> str:
    asked = len(outcome.answers)
    reasons = [answer.why_not for answer in outcome.answers if answer.guess is None]
    missing = (
        f"; {len(reasons)} of {asked} not answered, the last: {reasons[-1]}" if reasons else ""
    )
    if outcome.gain_c is None:
        return f"\n{method} answered nothing{missing}"
    value, low, high = outcome.gain_c
    worth = "is better than" if low > 0 else "is worse than" if high < 0 else "does not differ from"
    side = f"its error is {abs(value):.1f} degC {'lower' if value >= 0 else 'higher'}"
    ends = f"[{low:.1f}, {high:.1f}]" if value >= 0 else f"[{-high:.1f}, {-low:.1f}]"
    return (
        f"\n{method} {worth} the best constant guess ({outcome.best}): {side} {ends}{missing}\n"
        f"Brackets: 95 % intervals. A stated interval should contain {100 * COVERAGE:.0f} %."
    )
