"""Computes probabilities of the distributions of tests. Pure.

Formulas after W. H. Press et al., Numerical Recipes (2007), chapter 6. The tests compare each with
scipy, which is three times as large as all else that a report needs.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from statistics import NormalDist

TURNS = 300  # of the continued fraction, at most
ENDED = 1e-15  # change of a turn at which it has converged
CELLS = 4000  # of an integral
FAR = 40.0  # standard deviations of what it is over


def beta_share(a: float, b: float, x: float) -> float:
    """Return the regularised incomplete beta function I_x(a, b)."""
    if not 0.0 < x < 1.0:
        return float(x >= 1.0)
    if x > (a + 1.0) / (a + b + 2.0):  # the fraction converges fast below
        return 1.0 - beta_share(b, a, 1.0 - x)
    logs = math.lgamma(a + b) - math.lgamma(a) - math.lgamma(b)
    front = math.exp(logs + a * math.log(x) + b * math.log1p(-x)) / a
    d = 1.0 / (1.0 - (a + b) * x / (a + 1.0))
    c, fraction = 1.0, d
    for m in range(1, TURNS):
        even = m * (b - m) * x / ((a + 2 * m - 1) * (a + 2 * m))
        odd = -(a + m) * (a + b + m) * x / ((a + 2 * m) * (a + 2 * m + 1))
        for term in (even, odd):
            d = 1.0 / (1.0 + term * d)
            c = 1.0 + term / c
            fraction *= c * d
        if abs(c * d - 1.0) < ENDED:
            break
    return front * fraction


def root(rises: Callable[[float], float], low: float, high: float) -> float:
    """Return where a rising function is 0, between two places, by halving."""
    while high - low > 1e-13 * max(abs(low), abs(high)):
        middle = (low + high) / 2.0
        if middle in (low, high):
            break
        low, high = (low, middle) if rises(middle) > 0.0 else (middle, high)
    return (low + high) / 2.0


def f_above(f: float, df: float, df_error: float) -> float:
    """Return the probability that F is above a value."""
    return beta_share(df_error / 2.0, df / 2.0, df_error / (df_error + df * f))


def t_outside(t: float, df: float) -> float:
    """Return the probability that Student's |t| is above a value."""
    return f_above(t * t, 1.0, df)


def t_limit(confidence: float, df: float) -> float:
    """Return the value that Student's |t| exceeds with the probability 1 - confidence."""
    x = root(lambda x: beta_share(df / 2.0, 0.5, x) - (1.0 - confidence), 0.0, 1.0)
    return math.sqrt(df * (1.0 - x) / x)


def t_above(t: float, df: int, shift: float) -> float:
    """Return the probability that noncentral t is above a value: (Z + shift) / s above t."""
    # s is the root of chi squared over df, whose density is integrated.
    logs = math.log(2.0) + df / 2.0 * math.log(df / 2.0) - math.lgamma(df / 2.0)
    normal = NormalDist()
    width = min(FAR, 1.0 + FAR / math.sqrt(2.0 * df)) / CELLS
    total = 0.0
    for cell in range(CELLS):
        s = (cell + 0.5) * width
        density = math.exp(logs + (df - 1.0) * math.log(s) - df * s * s / 2.0)
        total += density * normal.cdf(shift - t * s)
    return total * width


def chi2_above(chi2: float, df: int) -> float:
    """Return the probability that chi squared is above a value."""
    half = chi2 / 2.0
    term = 2.0 * math.sqrt(half / math.pi) * math.exp(-half) if df % 2 else math.exp(-half)
    total, first = (math.erfc(math.sqrt(half)), 3) if df % 2 else (0.0, 2)
    for n in range(first, df + 1, 2):
        total += term
        term *= half / (n / 2.0)
    return total


def fisher(first: tuple[int, int], second: tuple[int, int]) -> float:
    """Return two-sided p of Fisher's exact test of two rows of counts (right, wrong)."""
    right, of, among = first[0] + second[0], sum(first), sum(first) + sum(second)
    least, most = max(0, right + of - among), min(right, of)
    ways = {k: math.comb(of, k) * math.comb(among - of, right - k) for k in range(least, most + 1)}
    bound = ways[first[0]]  # whole numbers: equal tables are equal
    return sum(count for count in ways.values() if count <= bound) / math.comb(among, right)
