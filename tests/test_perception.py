"""Vibrotactile thresholds against the figures they were taken from."""

from __future__ import annotations

import numpy as np
import pytest

from hapticvlm.perception import (
    drive_threshold_db,
    felt_difference_db,
    masked_threshold_db,
    model_threshold_db,
    threshold_db,
)


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


def test_the_models_threshold_has_its_published_values() -> None:
    hertz = np.array(
        [0.0, 20.0, 40.0, 60.0, 100.0, 150.0, 200.0, 250.0, 300.0, 400.0, 500.0, 700.0]
    )
    published_db = [0, -5, -13.5, -20.6, -31.2, -39.5, -43.8, -45, -44, -37, -26, 0]
    assert np.allclose(model_threshold_db(hertz), published_db, atol=0.6)


def test_a_peak_masks_what_is_near_it_and_not_what_is_far() -> None:
    hertz = np.arange(0.0, 1001.0, 5.0)
    level_db = np.full(hertz.size, -120.0)
    plain_db = masked_threshold_db(hertz, level_db)
    assert np.allclose(plain_db, model_threshold_db(hertz))
    level_db[hertz == 200.0] = -10.0
    masked_db = masked_threshold_db(hertz, level_db)
    assert masked_db[hertz == 200.0][0] == pytest.approx(-10 - 5 + 5 / 1400 * 200, abs=0.1)
    assert masked_db[hertz == 240.0][0] > plain_db[hertz == 240.0][0] + 20.0
    assert masked_db[hertz == 500.0][0] == pytest.approx(plain_db[hertz == 500.0][0], abs=0.1)


def test_equal_vibrations_differ_by_nothing_and_a_louder_one_by_its_gain() -> None:
    hertz = np.arange(0.0, 1001.0, 2.0)
    level_db = -20.0 - 0.5 * ((hertz - 150.0) / 20.0) ** 2
    assert felt_difference_db(hertz, level_db, level_db) == 0.0
    assert felt_difference_db(hertz, level_db, level_db + 3.0) == pytest.approx(3.0, abs=0.2)
    quiet_db = np.full(hertz.size, -140.0)
    assert felt_difference_db(hertz, quiet_db, quiet_db + 20.0) < 0.01  # nobody feels either
