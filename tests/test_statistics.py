"""Tests percentiles, and confidence intervals of shares, also at their ends."""

import numpy as np

from hapticvlm.statistics import percentile, wilson


def test_no_interval_leaves_0_to_1_and_none_is_shown_as_minus_nothing():
    for n in range(1, 500):
        low, high = wilson(0, n)
        assert low >= 0.0
        assert f"{low:.0%}" == "0%"
        assert high < 1.0
        assert wilson(n, n)[1] <= 1.0


def test_percentiles_are_those_of_numpy():
    rng = np.random.default_rng(0)
    for values in (rng.integers(0, 256, 301).astype(np.uint8), rng.random((20, 3)), np.ones(1)):
        for percent in (0.0, 1.0, 50.0, 99.0, 100.0):
            expected = np.percentile(values, percent, axis=0)
            np.testing.assert_allclose(percentile(values, percent), expected)
