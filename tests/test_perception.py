"""Tests vibrotactile thresholds against their published figures."""

from __future__ import annotations

import numpy as np
import pytest

from hapticvlm.perception import drive_threshold_db, threshold_db


@pytest.mark.parametrize(
    ("frequency_hz", "decibels"),
    [(40, 12.0), (60, 4.7), (80, -0.3), (100, -4.1), (125, -8.0), (160, -12.3), (250, -20.0)],
)
def test_the_curve_passes_through_the_reference_points(
    frequency_hz: float, decibels: float
) -> None:
    assert threshold_db(frequency_hz) == pytest.approx(decibels, abs=0.01)


def test_the_curve_falls_12_db_per_octave_from_40_to_250_hz() -> None:
    for frequency_hz in (40.0, 55.0, 80.0, 110.0, 125.0):
        fall_db = threshold_db(frequency_hz) - threshold_db(2 * frequency_hz)
        assert fall_db == pytest.approx(12.0, abs=0.5)


def test_touch_is_best_near_250_hz_and_flat_below_40() -> None:
    curve = threshold_db(np.arange(1.0, 1001.0))

    assert np.argmin(curve) + 1 == 250
    assert np.ptp(curve[:40]) == pytest.approx(0.0, abs=1e-9)
    assert threshold_db(1000.0) > threshold_db(40.0)


def test_numbers_and_arrays_agree_also_outside_the_band() -> None:
    frequencies_hz = np.array([0.0, 1.0, 39.0, 333.0, 1000.0, 20_000.0])

    assert isinstance(threshold_db(333.0), float)
    assert np.allclose(threshold_db(frequencies_hz), [threshold_db(f) for f in frequencies_hz])


def test_an_accelerating_speaker_needs_the_same_drive_from_40_to_250_hz() -> None:
    needed_db = drive_threshold_db(np.array([20.0, 40.0, 80.0, 160.0, 250.0]))

    assert np.all(np.abs(needed_db) < 0.6)
    assert drive_threshold_db(np.array([500.0]))[0] > 20.0
