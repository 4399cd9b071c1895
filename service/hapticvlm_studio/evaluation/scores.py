"""Grades estimated temperatures and their intervals against guesses that use no picture. Pure.

Pictures of one collection tend to show one climate, so a method that always answers 20 degC may
look good. A method is worth only what it gains over such a constant: the service's default, or the
median of the other pictures' true temperatures (leave-one-out, so the constant never sees the truth
that it is graded on).

Figures have 95 % intervals: for means by the bootstrap over pictures, for shares exact (Clopper and
Pearson). Both assume that pictures are independent. Several pictures of one place are not, and make
the intervals too narrow.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from hapticvlm.evidence.ambient import DEFAULT_C, DEFAULT_HIGH_C, DEFAULT_LOW_C
from hapticvlm.evidence.reading import COVERAGE
from hapticvlm_studio.evaluation.distributions import beta_share, root

TOLERANCE_C = 8.0  # the paper's rule: correct within 8 degC
PAPER = (13, 15)  # correct by that rule, and of how many; HapticVLM, arXiv 2505.02569
RESAMPLES = 4000
SEED = 5

Doubles = NDArray[np.float64]
Rule = Literal["default", "leave-one-out median"]


@dataclass(frozen=True, slots=True)
class Guess:
    """A temperature in degC and the interval that should contain it with probability COVERAGE."""

    value_c: float
    low_c: float
    high_c: float


@dataclass(frozen=True, slots=True)
class Share:
    """A share, 0..1, with its exact 95 % interval."""

    share: float
    low: float
    high: float


@dataclass(frozen=True, slots=True)
class Score:
    """Figures over n pictures, in degC where named so.

    Mean absolute error with its interval, mean error (`bias_c`), the shares within TOLERANCE_C and
    inside the stated interval, and the mean width of the latter.
    """

    n: int
    mae_c: float
    mae_low_c: float
    mae_high_c: float
    bias_c: float
    within_8c: Share
    interval_coverage: Share
    interval_width_c: float


def share(hits: int, n: int) -> Share:
    """Return the share of hits in n > 0 trials with its exact interval."""

    def end(below: int, chance: float) -> float:
        return root(lambda p: beta_share(below + 1, n - below, p) - chance, 0.0, 1.0)

    low = end(hits - 1, 0.025) if hits else 0.0
    return Share(hits / n, low, end(hits, 0.975) if hits < n else 1.0)


def score(guesses: Sequence[Guess], truths: Sequence[float]) -> Score | None:
    """Return the score of guesses against true temperatures in degC; None where there are none."""
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
    """Return the guess of a rule for each picture; None where it has nothing to guess from.

    The median is that of all other pictures, and its interval their central COVERAGE.
    """
    if rule == "default":
        return [Guess(DEFAULT_C, DEFAULT_LOW_C, DEFAULT_HIGH_C) for _ in truths]
    if len(truths) < 2:
        return None
    tail = 100 * (1 - COVERAGE) / 2
    guesses = []
    for left_out in range(len(truths)):
        others = np.delete(np.asarray(truths, dtype=np.float64), left_out)
        low, value, high = np.percentile(others, [tail, 50, 100 - tail])
        guesses.append(Guess(float(value), float(low), float(high)))
    return guesses


def gain(
    guesses: Sequence[Guess], rivals: Sequence[Guess], truths: Sequence[float]
) -> tuple[float, float, float]:
    """Return how far a method's mean absolute error is below a rival's, (value, low, high) degC.

    Both are compared on the same picture before pictures are resampled, so what makes a picture
    difficult for both cancels and does not widen the interval.
    """
    truth = np.asarray(truths, dtype=np.float64)
    ours = _columns(guesses)[0]
    theirs = _columns(rivals)[0]
    saved = np.abs(theirs - truth) - np.abs(ours - truth)
    return float(saved.mean()), *bootstrap(saved)


def bootstrap(values: Doubles) -> tuple[float, float]:
    """Return the 95 % interval of the mean of values, (n,), by the percentile bootstrap."""
    # The mean of n values drawn with replacement varies as the mean of another n pictures would.
    rng = np.random.default_rng(SEED)
    means = [values[rng.integers(0, values.size, values.size)].mean() for _ in range(RESAMPLES)]
    low, high = np.percentile(means, [2.5, 97.5])
    return float(low), float(high)


def _columns(guesses: Sequence[Guess]) -> tuple[Doubles, Doubles, Doubles]:
    table = np.array([(guess.value_c, guess.low_c, guess.high_c) for guess in guesses])
    return table[:, 0], table[:, 1], table[:, 2]
