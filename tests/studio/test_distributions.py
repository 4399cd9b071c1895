"""Probabilities of tests are those of scipy, which no report needs."""

import pytest
from each_case import each_row
from scipy import stats

from hapticvlm_studio.evaluation import distributions
from hapticvlm_studio.evaluation.scores import share


@each_row(("f", "df", "error"), [(0.3, 1, 8), (4.1, 2, 16), (9.7, 3.4, 27.2), (80.0, 9, 72)])
def test_tails_of_f(f: float, df: float, error: float) -> None:
    expected = stats.f.sf(f, df, error)
    assert distributions.f_above(f, df, error) == pytest.approx(expected, rel=1e-10)


@each_row(("t", "df"), [(0.1, 1), (2.3, 8), (-5.0, 8), (4.0, 40), (1.0, 500)])
def test_tails_and_limits_of_students_t(t: float, df: int) -> None:
    outside = 2.0 * stats.t.sf(abs(t), df)
    assert distributions.t_outside(t, df) == pytest.approx(outside, rel=1e-10)
    assert distributions.t_limit(1.0 - outside, df) == pytest.approx(abs(t), rel=1e-6)


@each_row(("df", "shift"), [(1, 0.5), (2, 0.0), (8, 2.9), (30, 4.0), (400, 1.0)])
def test_power_of_a_t_test(df: int, shift: float) -> None:
    expected = stats.nct.sf(2.3, df, shift)
    assert distributions.t_above(2.3, df, shift) == pytest.approx(expected, rel=1e-4)


@each_row(("chi2", "df"), [(0.0, 2), (3.0, 1), (3.0, 2), (21.0, 9), (140.0, 10)])
def test_tails_of_chi_squared(chi2: float, df: int) -> None:
    expected = stats.chi2.sf(chi2, df)
    assert distributions.chi2_above(chi2, df) == pytest.approx(expected, rel=1e-10)


@each_row(("first", "second"), [((40, 5), (31, 14)), ((45, 0), (45, 0)), ((3, 1), (1, 3))])
def test_fishers_exact_test(first: tuple[int, int], second: tuple[int, int]) -> None:
    expected = stats.fisher_exact([first, second]).pvalue
    assert distributions.fisher(first, second) == pytest.approx(expected, rel=1e-10)


@each_row(("hits", "n"), [(0, 15), (13, 15), (15, 15), (1, 1), (200, 900)])
def test_the_exact_interval_of_a_share(hits: int, n: int) -> None:
    expected = stats.binomtest(hits, n).proportion_ci(0.95)
    found = share(hits, n)
    assert (found.low, found.high) == pytest.approx((expected.low, expected.high), abs=1e-9)
