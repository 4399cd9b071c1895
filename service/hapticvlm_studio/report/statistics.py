"""Computes the statistics of a forced-choice study from counts of trials. Pure.

The unit of these statistics is the person, not the trial. Trials of one person are alike: a person
who finds a pattern easy once finds it easy again. Treating 450 trials of nine people as 450
independent observations (pseudo-replication) gives intervals that are too narrow and p-values that
are too small, as if 450 people had been asked. So intervals are given by person wherever single
people's trials are known, and differences are tested within people (repeated measures): each person
is compared with themselves, and how good they are in general cancels.

Only the ANOVA imports statsmodels, so the paper's data can be evaluated without it; `distributions`
has the probabilities.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hapticvlm.statistics import wilson
from hapticvlm_studio.evaluation import distributions

CONFIDENCE = 0.95
Counts = NDArray[np.int64]
Rates = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Share:
    """A share of trials, 0..1, with two 95 % intervals.

    `wilson` assumes independent trials and `by_person` independent people; the latter is None for
    fewer than two people. Without trials (`of` is 0) all three are None.
    """

    right: int
    of: int
    share: float | None
    wilson: tuple[float, float] | None
    by_person: tuple[float, float] | None = None


@dataclass(frozen=True, slots=True)
class Effect:
    """One line of an ANOVA; `p_corrected` is after Greenhouse and Geisser.

    Where F is not defined, it and all that follows from it are None.
    """

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
    """Friedman's test of whether people rank the levels of a factor consistently.

    `w` is Kendall's W, 0 (rankings unrelated) to 1 (everybody ranks alike).
    """

    name: str
    df: int
    chi2: float
    p: float
    w: float


@dataclass(frozen=True, slots=True)
class Pair:
    """Two patterns compared: `p` is uncorrected, `p_holm` corrected for all pairs tested."""

    first: str
    second: str
    difference: float
    p: float
    p_holm: float


def share(right: int, of: int) -> Share:
    """Return a share of `of` trials with Wilson's interval, which assumes independent trials."""
    if of == 0:
        return Share(right, of, None, None)
    return Share(right, of, right / of, wilson(right, of))


def share_by_person(right: Sequence[int], of: Sequence[int]) -> Share:
    """Return the share of all trials, with an interval that assumes independent people.

    `right` and `of` hold one count for each person. The share p = sum(right) / sum(of) is a ratio
    of two sums over people, whose variance is (n people, e_i = right_i - p of_i)

        var p = n / (n - 1) sum(e_i^2) / sum(of)^2                                  (1)

    The interval is Student's t with n - 1 degrees of freedom on the logit ln(p / (1 - p)), whose
    standard error is sqrt(var p) / (p (1 - p)), transformed back. On the logit it cannot leave
    0..1 and may be longer towards the middle than towards the edge, as it has to near 100 %. With
    nine people it contains the true share in 93.4 to 98.5 % of studies (docs/physics.md 6.2).
    """
    total = share(sum(right), sum(of))
    people = sum(count > 0 for count in of)
    if people < 2 or total.share is None:
        return total
    # Half a trial is added to either answer, so that the logit of 0 or 100 % is finite.
    middle = (total.right + 0.5) / (total.of + 1.0)
    residuals = np.array(right) - total.share * np.array(of)
    between = people / (people - 1) * float((residuals**2).sum()) / total.of**2
    # If all people happen to do equally well, (1) is 0; their trials still scatter by chance. So
    # the variance is at least that of independent trials, p (1 - p) / N.
    variance = max(between, middle * (1.0 - middle) / total.of)
    half = distributions.t_limit(CONFIDENCE, people - 1) * math.sqrt(variance)
    half /= middle * (1.0 - middle)
    logit = math.log(middle / (1.0 - middle))
    low, high = (1.0 / (1.0 + math.exp(-logit - side * half)) for side in (-1.0, 1.0))
    return Share(total.right, total.of, total.share, total.wilson, (low, high))


def mean_by_person(means: Sequence[float]) -> tuple[float, tuple[float, float] | None]:
    """Return the mean of people's means and its 95 % interval by Student's t.

    The interval is None for fewer than two people.
    """
    middle = float(np.mean(means))
    if len(means) < 2:
        return middle, None
    error = float(np.std(means, ddof=1)) / math.sqrt(len(means))
    half = distributions.t_limit(CONFIDENCE, len(means) - 1) * error
    return middle, (middle - half, middle + half)


def information_bits(counts: Counts) -> tuple[float, float]:
    """Return the information transmitted from pattern to answer, in bits, and its bias.

    `counts` is (presented, answered). The information is

        I = sum p(i, j) log2(p(i, j) / (p(i) p(j)))

    which is log2 of the number of patterns for perfect answers and 0 for answers that do not depend
    on the pattern. Estimated from few trials it is too large on average, because chance makes the
    cells differ: by (rows - 1)(columns - 1) / (2 N ln 2) bits (Miller and Madow), over the rows and
    columns in use. Subtract the bias to correct it.
    """
    total = counts.sum()
    if total == 0:
        return 0.0, 0.0
    joint = counts / total
    expected = joint.sum(axis=1, keepdims=True) * joint.sum(axis=0, keepdims=True)
    used = joint > 0
    # Cells without a trial are left out: p log p goes to 0 with p.
    bits = float((joint[used] * np.log2(joint[used] / expected[used])).sum())
    rows, columns = (int((counts.sum(axis=axis) > 0).sum()) for axis in (1, 0))
    return bits, (rows - 1) * (columns - 1) / (2 * float(total) * math.log(2))


def collapsed(counts: Counts, groups: Sequence[str]) -> tuple[list[str], Counts]:
    """Sum the rows and columns that share a group; return the groups in order of appearance.

    Turns the matrix of patterns into that of one factor, such as hot and cold.
    """
    names = list(dict.fromkeys(groups))
    member = np.array([[group == name for group in groups] for name in names], dtype=np.int64)
    return names, member @ counts @ member.T


def anova(rates: Rates) -> list[Effect]:
    """Return a two-way repeated-measures ANOVA of rates, (people, vibrations, temperatures).

    Each effect is tested against its own interaction with people: F is how much the levels differ
    on average, over how much people disagree about that difference. With a and b levels and n
    people the degrees of freedom are (a-1, (a-1)(n-1)), (b-1, (b-1)(n-1)) and, for the interaction,
    ((a-1)(b-1), (a-1)(b-1)(n-1)).

    F has the distribution that it is tested against only if all differences between levels vary
    equally among people (sphericity). Shares near the ceiling violate that, so `p_corrected`
    multiplies both degrees of freedom by epsilon (Greenhouse and Geisser, `_epsilon`). Where people
    do not disagree at all, F is not defined and None. Raises ModuleNotFoundError without
    statsmodels.
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
    effects = []
    for (name, row), epsilon in zip(table.iterrows(), _epsilons(rates), strict=True):
        f = math.nan if epsilon is None else float(row["F Value"])
        df = round(row["Num DF"])
        error = round(row["Den DF"])
        effects.append(effect(str(name).replace(":", " x "), f, (df, error), epsilon))
    return effects


def effect(name: str, f: float, df: tuple[int, int], epsilon: float | None = None) -> Effect:
    """Return the line of an ANOVA for an F on (effect, error) degrees of freedom.

    Partial eta squared is the effect's share of the variation that is the effect's or its error's,
    which follows from F: F df / (F df + df_error).
    """
    if not math.isfinite(f) or f < 0:
        return Effect(name, *df, None, None, None)
    p = distributions.f_above(f, *df)
    corrected = None
    if epsilon is not None:
        corrected = distributions.f_above(f, epsilon * df[0], epsilon * df[1])
    return Effect(name, *df, f, p, f * df[0] / (f * df[0] + df[1]), epsilon, corrected)


def friedman(rates: Rates, name: str) -> Ranks | None:
    """Return Friedman's test of rates, (people, levels), by each person's ranks of the levels.

    Ranks do not assume a normal distribution, which shares of a few trials near the ceiling do not
    have. None for fewer than three levels or two people, or where no person's rates differ.
    """
    people, levels = rates.shape
    if levels < 3 or people < 2 or not np.ptp(rates, axis=1).any():
        return None
    below = (rates[:, :, None] > rates[:, None, :]).sum(axis=2)
    alike = (rates[:, :, None] == rates[:, None, :]).sum(axis=2)
    ranks = below + (alike + 1) / 2.0  # equal rates share the mean of their places
    between = float(((ranks.mean(axis=0) - (levels + 1) / 2.0) ** 2).sum())
    # Of people whose rates are all different the variance of ranks is levels (levels + 1) / 12.
    chi2 = (levels - 1) * people**2 * between / float(((ranks - (levels + 1) / 2.0) ** 2).sum())
    p = distributions.chi2_above(chi2, levels - 1)
    return Ranks(name, levels - 1, chi2, p, chi2 / (people * (levels - 1)))


def pairwise_by_person(rates: Rates, names: Sequence[str]) -> list[Pair]:
    """Return paired t-tests of rates, (people, patterns), of every two patterns."""
    comparisons = []
    for i, j in itertools.combinations(range(len(names)), 2):
        difference = rates[:, i] - rates[:, j]
        comparisons.append((names[i], names[j], float(difference.mean()), _paired_p(difference)))
    return _holm(comparisons)


def pairwise_pooled(right: Sequence[int], of: Sequence[int], names: Sequence[str]) -> list[Pair]:
    """Return Fisher's exact test of every two patterns, all people's trials pooled.

    Pooling assumes independent trials; it is used only where single people's trials are unknown.
    """
    comparisons = []
    for i, j in itertools.combinations(range(len(names)), 2):
        first, second = ((right[k], of[k] - right[k]) for k in (i, j))
        difference = right[i] / of[i] - right[j] / of[j]
        p = distributions.fisher(first, second)
        comparisons.append((names[i], names[j], difference, p))
    return _holm(comparisons)


def _paired_p(difference: NDArray[np.float64]) -> float:
    """Return p of a paired t-test of people's differences, (people,)."""
    # Differences that are all equal have no deviation, and t would be a division by zero. If all
    # are zero there is no evidence; otherwise n people agree in sign, which happens by chance with
    # the probability 2 (1/2)^n (sign test).
    if np.ptp(difference) < 1e-12:
        return 1.0 if abs(float(difference[0])) < 1e-12 else 2.0 ** (1 - difference.size)
    error = float(np.std(difference, ddof=1)) / math.sqrt(difference.size)
    return distributions.t_outside(float(difference.mean()) / error, difference.size - 1)


def _holm(comparisons: list[tuple[str, str, float, float]]) -> list[Pair]:
    """Return the comparisons (first, second, difference, p), smallest p first, corrected by Holm.

    Among 45 tests about two have p < 0.05 by chance alone. Holm's correction keeps the probability
    of any false finding among m tests below 5 %: the smallest p is multiplied by m, the next by
    m - 1 and so on. It is valid whatever the tests have in common, and it finds more than
    Bonferroni's, which multiplies every p by m.
    """
    pairs: list[Pair] = []
    corrected = 0.0
    for rank, comparison in enumerate(sorted(comparisons, key=lambda each: each[3])):
        # A corrected p is never below that of a smaller p: once one is not significant, none of the
        # following is.
        corrected = min(max(corrected, (len(comparisons) - rank) * comparison[3]), 1.0)
        pairs.append(Pair(*comparison, corrected))
    return pairs


def _epsilons(rates: Rates) -> list[float | None]:
    """Return Greenhouse and Geisser's epsilon of both main effects and their interaction."""
    # Each effect has its contrasts: those of one factor averaged over the other, and for the
    # interaction the products of both. Applied to a person's rates they give that person's scores.
    _, a, b = rates.shape
    first = _contrasts(a)
    second = _contrasts(b)
    mean_a = np.full((1, a), 1 / a)
    mean_b = np.full((1, b), 1 / b)
    contrasts = (np.kron(first, mean_b), np.kron(mean_a, second), np.kron(first, second))
    flat = rates.reshape(rates.shape[0], a * b)
    return [_epsilon(flat @ contrast.T) for contrast in contrasts]


def _contrasts(levels: int) -> Rates:
    """Return orthonormal contrasts of levels, (levels - 1, levels); each row sums to 0."""
    # QR of (ones, unit vectors): the first column spans the mean, the others what is orthogonal to
    # it. Epsilon does not depend on which basis that is.
    columns = np.column_stack([np.ones(levels), np.eye(levels)[:, : levels - 1]])
    return np.linalg.qr(columns)[0].T[1:]


def _epsilon(scores: Rates) -> float | None:
    """Return epsilon = tr(S)^2 / (d tr(S S)), S the covariance of scores (people, d).

    It is 1 if all contrasts vary equally and independently (sphericity), and 1 / d if all people
    differ along a single one. None where people do not differ.
    """
    width = scores.shape[1]
    covariance = np.atleast_2d(np.cov(scores, rowvar=False))
    spread = float((covariance * covariance).sum())
    return float(np.trace(covariance) ** 2 / (width * spread)) if spread > 1e-18 else None
