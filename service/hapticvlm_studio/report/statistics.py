"""Statistics of a forced-choice study. Pure: counts and trials in, numbers out.

Tests come from statsmodels and scipy; what is computed here is what they lack: the interval by
person, information transmitted, and Greenhouse and Geisser's correction of degrees of freedom. Only
the ANOVA loads statsmodels, so that the paper's data need no more than what is installed.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from hapticvlm.statistics import wilson

CONFIDENCE = 0.95
Counts = NDArray[np.int64]
Rates = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Share:
    """A share of trials with its 95 % interval; `by_person` is None with fewer than two people."""

    right: int
    of: int
    share: float | None
    wilson: tuple[float, float] | None
    by_person: tuple[float, float] | None = None


@dataclass(frozen=True, slots=True)
class Effect:
    """One line of an ANOVA; `p_corrected` after Greenhouse and Geisser, None where F is."""

    name: str
    df: int
    df_error: int
    f: float | None
    p: float | None
    partial_eta2: float | None
    epsilon: float | None = None
    p_corrected: float | None = None


@dataclass(frozen=True, slots=True)
class Ranks:
    """Friedman's test that people rank all of so many levels alike; Kendall's W is 0..1."""

    name: str
    df: int
    chi2: float
    p: float
    w: float


@dataclass(frozen=True, slots=True)
class Pair:
    """Two patterns compared; `p` uncorrected, `p_holm` for all pairs tested together."""

    first: str
    second: str
    difference: float
    p: float
    p_holm: float


def share(right: int, of: int) -> Share:
    """Return a share with Wilson's interval, which takes trials for independent."""
    if of == 0:
        return Share(right, of, None, None)
    return Share(right, of, right / of, wilson(right, of))


def share_by_person(right: Sequence[int], of: Sequence[int]) -> Share:
    """Return the share of all trials; `by_person` takes people, not trials, for independent.

    It is Student's t on the logit of the share, with half a trial added to either answer. Its
    standard error is that of the ratio of sums over people, and never less than that of independent
    trials, so people who all do alike do not make it vanish. Covers 95 % with nine people
    (docs/physics.md 6.3).
    """
    total = share(sum(right), sum(of))
    people = sum(count > 0 for count in of)
    if people < 2 or total.share is None:
        return total
    middle = (total.right + 0.5) / (total.of + 1.0)
    strayed = np.array(right) - total.share * np.array(of)
    between = people / (people - 1) * float((strayed**2).sum()) / total.of**2
    variance = max(between, middle * (1.0 - middle) / total.of)
    half = stats.t.ppf(0.5 + CONFIDENCE / 2, people - 1) * math.sqrt(variance)
    half /= middle * (1.0 - middle)
    logit = math.log(middle / (1.0 - middle))
    low, high = (1.0 / (1.0 + math.exp(-logit - side * half)) for side in (-1.0, 1.0))
    return Share(total.right, total.of, total.share, total.wilson, (low, high))


def mean_by_person(means: Sequence[float]) -> tuple[float, tuple[float, float] | None]:
    """Return the mean of people's means and its 95 % interval (Student's t), None below two."""
    middle = float(np.mean(means))
    if len(means) < 2:
        return middle, None
    half = float(stats.t.ppf(0.5 + CONFIDENCE / 2, len(means) - 1) * stats.sem(means))
    return middle, (middle - half, middle + half)


def information_bits(counts: Counts) -> tuple[float, float]:
    """Information from presented (rows) to answered (columns), bits, and its bias to be taken off.

    The bias is Miller and Madow's (rows - 1)(columns - 1) / (2 N ln 2), of the columns in use.
    """
    total = counts.sum()
    if total == 0:
        return 0.0, 0.0
    joint = counts / total
    expected = joint.sum(axis=1, keepdims=True) * joint.sum(axis=0, keepdims=True)
    used = joint > 0
    bits = float((joint[used] * np.log2(joint[used] / expected[used])).sum())
    rows, columns = (int((counts.sum(axis=axis) > 0).sum()) for axis in (1, 0))
    return bits, (rows - 1) * (columns - 1) / (2 * float(total) * math.log(2))


def collapsed(counts: Counts, groups: Sequence[str]) -> tuple[list[str], Counts]:
    """Add up rows and columns of one group each, groups in order of appearance."""
    names = list(dict.fromkeys(groups))
    member = np.array([[group == name for group in groups] for name in names], dtype=np.int64)
    return names, member @ counts @ member.T


def anova(rates: Rates) -> list[Effect]:
    """Two-way repeated-measures ANOVA of rates (people, vibrations, temperatures), by AnovaRM.

    Degrees of freedom of levels a and b among n people: (a-1) over (a-1)(n-1), and so on. Without
    spread among people F is not defined and None.
    """
    import pandas as pd
    from statsmodels.stats.anova import AnovaRM

    people, a, b = rates.shape
    factors = ["vibration", "temperature"]
    cells = [
        (person, f"{i:02d}", f"{j:02d}", rates[person, i, j])
        for person, i, j in itertools.product(range(people), range(a), range(b))
    ]
    frame = pd.DataFrame(cells, columns=["person", *factors, "rate"])
    with np.errstate(divide="ignore", invalid="ignore"):
        table = AnovaRM(frame, "rate", "person", within=factors).fit().anova_table
    found = []
    for (name, row), epsilon in zip(table.iterrows(), _epsilons(rates), strict=True):
        f = math.nan if epsilon is None else float(row["F Value"])
        df = round(row["Num DF"])
        error = round(row["Den DF"])
        found.append(effect(str(name).replace(":", " x "), f, (df, error), epsilon))
    return found


def effect(name: str, f: float, df: tuple[int, int], epsilon: float | None = None) -> Effect:
    """Return the line of an ANOVA that an F on these degrees of freedom makes."""
    if not math.isfinite(f) or f < 0:
        return Effect(name, *df, None, None, None)
    p = float(stats.f.sf(f, *df))
    corrected = None
    if epsilon is not None:
        corrected = float(stats.f.sf(f, epsilon * df[0], epsilon * df[1]))
    return Effect(name, *df, f, p, f * df[0] / (f * df[0] + df[1]), epsilon, corrected)


def friedman(rates: Rates, name: str) -> Ranks | None:
    """Test rates (people, levels) by their ranks; None below three levels or where nobody differs.

    Ranks need no normal distribution, which shares of a few trials near the ceiling have not.
    """
    people, levels = rates.shape
    if levels < 3 or people < 2 or not np.ptp(rates, axis=1).any():
        return None
    found = stats.friedmanchisquare(*rates.T)
    chi2 = float(found.statistic)
    return Ranks(name, levels - 1, chi2, float(found.pvalue), chi2 / (people * (levels - 1)))


def pairwise_by_person(rates: Rates, names: Sequence[str]) -> list[Pair]:
    """Paired t-tests of rates (people, patterns), every pattern with every other."""
    found = []
    for i, j in itertools.combinations(range(len(names)), 2):
        difference = rates[:, i] - rates[:, j]
        found.append((names[i], names[j], float(difference.mean()), _paired_p(difference)))
    return _holm(found)


def pairwise_pooled(right: Sequence[int], of: Sequence[int], names: Sequence[str]) -> list[Pair]:
    """Fisher's exact test of every two patterns, with the trials of all people thrown together."""
    found = []
    for i, j in itertools.combinations(range(len(names)), 2):
        table = [[right[k], of[k] - right[k]] for k in (i, j)]
        difference = right[i] / of[i] - right[j] / of[j]
        found.append((names[i], names[j], difference, float(stats.fisher_exact(table).pvalue)))
    return _holm(found)


def _paired_p(difference: NDArray[np.float64]) -> float:
    """P of a paired t-test; where all people differ alike t is undefined and signs decide."""
    if np.ptp(difference) < 1e-12:
        return 1.0 if abs(float(difference[0])) < 1e-12 else 2.0 ** (1 - difference.size)
    return float(stats.ttest_1samp(difference, 0.0).pvalue)


def _holm(found: list[tuple[str, str, float, float]]) -> list[Pair]:
    """Correct each p by Holm's steps: the smallest times all tests, the next times one fewer."""
    pairs: list[Pair] = []
    least = 0.0
    for at, each in enumerate(sorted(found, key=lambda pair: pair[3])):
        least = min(max(least, (len(found) - at) * each[3]), 1.0)
        pairs.append(Pair(*each, least))
    return pairs


def _epsilons(rates: Rates) -> list[float | None]:
    """Greenhouse and Geisser's epsilon of both main effects and their interaction."""
    _, a, b = rates.shape
    first = _contrasts(a)
    second = _contrasts(b)
    mean_a = np.full((1, a), 1 / a)
    mean_b = np.full((1, b), 1 / b)
    spans = (np.kron(first, mean_b), np.kron(mean_a, second), np.kron(first, second))
    flat = rates.reshape(rates.shape[0], a * b)
    return [_epsilon(flat @ span.T) for span in spans]


def _contrasts(levels: int) -> Rates:
    """Orthonormal contrasts of so many levels, (levels - 1, levels)."""
    columns = np.column_stack([np.ones(levels), np.eye(levels)[:, : levels - 1]])
    return np.linalg.qr(columns)[0].T[1:]


def _epsilon(scores: Rates) -> float | None:
    """Return tr(S)^2 / (d tr(S S)) of the covariance S of scores (people, d); None without any."""
    width = scores.shape[1]
    covariance = np.atleast_2d(np.cov(scores, rowvar=False))
    spread = float((covariance * covariance).sum())
    return float(np.trace(covariance) ** 2 / (width * spread)) if spread > 1e-18 else None
