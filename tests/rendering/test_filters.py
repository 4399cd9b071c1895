"""Waves at another rate and in the band of touch are what scipy makes of them."""

import numpy as np
import pytest
from each_case import each, each_row
from scipy import signal

from hapticvlm.rendering.vibration.filters import low_passed, resample


@each_row(
    ("count", "up", "down"),
    [(4_800, 1, 6), (44_101, 160, 147), (2_000, 24, 1), (500, 1_999, 2_000), (3, 2, 4), (5, 1, 1)],
)
def test_a_wave_at_another_rate_is_what_scipy_makes_of_it(count: int, up: int, down: int) -> None:
    wave = np.random.default_rng(1).normal(size=count)
    expected = signal.resample_poly(wave, up, down)
    assert resample(wave, up, down) == pytest.approx(expected, abs=1e-12)


@each(rate_hz=(8_000, 44_100, 48_000))
def test_what_lies_above_the_edge_is_removed_as_by_scipys_elliptic_filter(rate_hz: int) -> None:
    wave = np.random.default_rng(2).normal(size=rate_hz // 2)
    sections = signal.ellip(7, 0.5, 70.0, 800.0, fs=rate_hz, output="sos")
    expected = signal.sosfilt(sections, wave)
    assert low_passed(wave, 800.0, rate_hz) == pytest.approx(expected, abs=1e-9)
