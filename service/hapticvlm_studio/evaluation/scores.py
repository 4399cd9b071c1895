"""What temperatures with intervals are worth, beside a guess that uses no picture. Pure.

A picture shows a climate rather than a number, so a method is only worth what it is better by than
one number for every picture: the default, or the median of the other pictures' truths.
Intervals of figures are 95 %: by bootstrap over pictures for means, exact (Clopper and Pearson) for
shares. Pictures of one place count as independent, which makes them too narrow where there are any.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from hapticvlm.evidence.ambient import DEFAULT_C, DEFAULT_HIGH_C, DEFAULT_LOW_C
from hapticvlm.evidence.reading import COVERAGE

TOLERANCE_C = 8.0  # the paper's rule: right when within 8 degC
PAPER = (13, 15)  # right by that rule, of how many; HapticVLM, arXiv 2505.02569
RESAMPLES = 4000
SEED = 5
LEVELS = (0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 0.95)  # stated, of the calibration curve

Doubles = NDArray[np.float64]
Rule = Literal["default", "leave-one-out median"]


@dataclass(frozen=True, slots=True)
class Guess:
    """A temperature and the interval believed to hold COVERAGE of it, degC."""

    value_c: float
    low_c: float
    high_c: float


@dataclass(frozen=True, slots=True)
class Share:
    """A share 0..1 with its exact 95 % interval."""

    share: float
    low: float
    high: float


@dataclass(frozen=True, slots=True)
class Score:
    """Over n pictures: mean absolute error with interval and mean error, degC, and shares."""

    n: int
    mae_c: float
    mae_low_c: float
    mae_high_c: float
    bias_c: float
    within_8c: Share
    interval_coverage: Share
    interval_width_c: float


def share(hits: int, n: int) -> Share:
    """Return a share of n > 0 trials with its exact interval."""
    from scipy.stats import binomtest

    ends = binomtest(hits, n).proportion_ci(0.95)
    return Share(hits / n, float(ends.low), float(ends.high))


def score(guesses: Sequence[Guess], truths: Sequence[float]) -> Score | None:
    """Grade guesses; None where there are none."""
    if not guesses:
        return None
    values, lows, highs = _columns(guesses)
    truth = np.asarray(truths, dtype=np.float64)
    errors = values - truth
    low, high = bootstrap(np.abs(errors))
    held = int(((lows <= truth) & (truth <= highs)).sum())
    near = int((np.abs(errors) <= TOLERANCE_C).sum())
    return Score(
        n=len(guesses),
        mae_c=float(np.abs(errors).mean()),
        mae_low_c=low,
        mae_high_c=high,
        bias_c=float(errors.mean()),
        within_8c=share(near, len(guesses)),
        interval_coverage=share(held, len(guesses)),
        interval_width_c=float((highs - lows).mean()),
    )


def constant(rule: Rule, truths: Sequence[float]) -> list[Guess] | None:
    """Guess without looking, a guess a picture; None where there is nothing to guess from.

    The median is of all other pictures, its interval their middle COVERAGE.
    """
    if rule == "default":
        return [Guess(DEFAULT_C, DEFAULT_LOW_C, DEFAULT_HIGH_C) for _ in truths]
    if len(truths) < 2:
        return None
    tail = 100 * (1 - COVERAGE) / 2
    found = []
    for left_out in range(len(truths)):
        others = np.delete(np.asarray(truths, dtype=np.float64), left_out)
        low, value, high = np.percentile(others, [tail, 50, 100 - tail])
        found.append(Guess(float(value), float(low), float(high)))
    return found


def gain(
    guesses: Sequence[Guess], rivals: Sequence[Guess], truths: Sequence[float]
) -> tuple[float, float, float]:
    """By how much a method's mean absolute error is below a rival's, with interval; degC.

    Pictures are resampled in pairs, so what makes a picture hard for both cancels.
    """
    truth = np.asarray(truths, dtype=np.float64)
    ours = _columns(guesses)[0]
    theirs = _columns(rivals)[0]
    saved = np.abs(theirs - truth) - np.abs(ours - truth)
    return float(saved.mean()), *bootstrap(saved)


def bootstrap(values: Doubles) -> tuple[float, float]:
    """95 % interval of a mean by resampling values (n,)."""
    rng = np.random.default_rng(SEED)
    means = [values[rng.integers(0, values.size, values.size)].mean() for _ in range(RESAMPLES)]
    low, high = np.percentile(means, [2.5, 97.5])
    return float(low), float(high)


def calibration(guesses: Sequence[Guess], truths: Sequence[float]) -> list[tuple[float, float]]:
    """Pair each of LEVELS with the share of truths inside the interval of that level.

    One interval is known a guess; others are it, each side scaled as a normal law's would be.
    """
    from scipy.stats import norm

    values, lows, highs = _columns(guesses)
    truth = np.asarray(truths, dtype=np.float64)
    known = norm.ppf(0.5 + COVERAGE / 2)
    curve = []
    for level in LEVELS:
        scale = norm.ppf(0.5 + level / 2) / known
        inside = values - scale * (values - lows) <= truth
        inside &= truth <= values + scale * (highs - values)
        curve.append((level, float(inside.mean())))
    return curve


def _columns(guesses: Sequence[Guess]) -> tuple[Doubles, Doubles, Doubles]:
    table = np.array([(guess.value_c, guess.low_c, guess.high_c) for guess in guesses])
    return table[:, 0], table[:, 1], table[:, 2]
