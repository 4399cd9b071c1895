"""Tests confidence intervals of shares, also at their ends."""

from hapticvlm.statistics import wilson


def test_no_interval_leaves_0_to_1_and_none_is_shown_as_minus_nothing():
    for n in range(1, 500):
        low, high = wilson(0, n)
        assert low >= 0.0
        assert f"{low:.0%}" == "0%"
        assert high < 1.0
        assert wilson(n, n)[1] <= 1.0
