"""What a hand feels of its speaker, found by asking: a curve that the service corrects."""

import io
import json
import sys

import numpy as np
import pytest
from in_process import hapticvlm

from hapticvlm.devices.speaker.speaker_files import read_response
from hapticvlm.perception import drive_threshold_db
from hapticvlm.rendering.vibration.vibration import RATE_HZ
from hapticvlm_studio.calibration import hand_threshold as threshold

NOMINAL_DB = drive_threshold_db(np.array(threshold.FREQUENCIES_HZ))
SEEDS = range(20)


def planted(seed):
    """Thresholds of one speaker under one hand."""
    rng = np.random.default_rng(seed)
    return np.clip(NOMINAL_DB + rng.uniform(-65.0, -25.0) + rng.normal(0.0, 8.0, 4), -88.0, -8.0)


def estimated(answerer, trials=threshold.TRIALS, seed=0):
    hand = threshold.ThresholdEstimator()
    for index, _ in threshold.trial_order(trials, seed):
        level_db = hand.next_level_db(index)
        hand.learn(index, level_db, answerer(index, level_db))
    return hand.estimates()


@pytest.fixture
def calibrate(monkeypatch):
    """Run the calibration with these answers and so many trials of each frequency."""

    def run(*arguments, answers="", trials=threshold.TRIALS):
        monkeypatch.setattr(threshold, "TRIALS", trials)
        monkeypatch.setattr(sys, "stdin", io.StringIO(answers))
        return hapticvlm("calibrate", "speaker", "--by-hand", *arguments)

    return run


@pytest.mark.parametrize(("guess_rate", "most_db"), [(0.0, 1.6), (0.5, 2.3), (1.0, 3.6)])
def test_planted_thresholds_are_found_however_often_a_person_guesses(guess_rate, most_db):
    errors, held = [], []
    for seed in SEEDS:
        truth_db = planted(seed)
        estimates = estimated(threshold.SimulatedHand(truth_db, guess_rate, seed).answer, seed=seed)
        errors += [one.threshold_db - true for one, true in zip(estimates, truth_db, strict=True)]
        held += [one.low_db <= t <= one.high_db for one, t in zip(estimates, truth_db, strict=True)]
    assert np.mean(np.abs(errors)) < most_db
    assert abs(np.mean(errors)) < 1.0  # who guesses does not seem to feel more
    assert np.mean(held) > 0.9


def test_a_hand_that_feels_nothing_is_taken_for_no_better_and_stays_in_bounds():
    (*_, at_500_hz) = estimated(lambda *_: "neither")
    assert at_500_hz.high_db == pytest.approx(threshold.LEVELS_DB[-1], abs=1.0)
    assert at_500_hz.threshold_db <= threshold.LEVELS_DB[-1]


def test_every_frequency_is_asked_equally_often_and_either_moment_about_half_the_time():
    planned = threshold.trial_order(12, seed=3)
    assert sorted(which for which, _ in planned) == sorted([*range(4)] * 12)
    assert 15 <= sum(is_first for _, is_first in planned) <= 33
    assert planned != threshold.trial_order(12, seed=4)


@pytest.mark.parametrize("is_first", [True, False])
def test_one_moment_vibrates_at_its_level_and_frequency_and_the_other_is_silent(is_first):
    wave = threshold.moments(100.0, -20.0, is_first=is_first)
    size = int(threshold.MOMENT_S * RATE_HZ)
    first, second = wave[:size], wave[-size:]
    tone, silence = (first, second) if is_first else (second, first)
    assert not silence.any()
    assert np.abs(tone).max() == pytest.approx(0.1, rel=0.01)
    spectrum = np.abs(np.fft.rfft(tone))
    hertz = np.fft.rfftfreq(size, 1.0 / RATE_HZ)
    assert hertz[spectrum.argmax()] == pytest.approx(100.0, abs=2.0)
    apart = spectrum[np.abs(hertz - 100.0) > 60.0].max() / spectrum.max()
    assert 20.0 * np.log10(apart) < -50.0  # a click would be heard, and felt elsewhere


def test_no_level_is_asked_above_half_of_full_scale():
    assert threshold.LEVELS_DB.max() <= -6.0


def test_what_a_hand_feels_less_of_is_driven_harder(calibrate, tmp_path):
    said = calibrate("--simulate", "--json", "--out", str(tmp_path / "hand.toml"), trials=30)
    assert said.code == 0, said.err
    told = json.loads(said.out)
    assert told["simulated"] is True
    found = read_response(tmp_path / "hand.toml")
    assert found.simulated
    assert found.full_scale_db == pytest.approx(-threshold.SIMULATED_THRESHOLDS_DB[2], abs=3.0)
    assert found.playback().full_scale_db == found.full_scale_db
    gains = found.correction()
    planted_db = np.array(threshold.SIMULATED_THRESHOLDS_DB) - NOMINAL_DB
    wanted_db = planted_db - planted_db[2]
    for hertz, db in zip(threshold.FREQUENCIES_HZ, wanted_db, strict=True):
        assert 20.0 * np.log10(gains.gain(hertz)) == pytest.approx(np.clip(db, -12, 12), abs=3.0)


def test_a_person_is_led_through_the_trials_and_told_where_more_are_needed(calibrate):
    said = calibrate("--speaker", "simulated", answers="\n1\nwhat\n2\n0\n1\n", trials=1)
    assert said.code == 0, said.err
    assert "trial 4 of 4" in said.err
    assert said.out.count("\n") == 7
    assert "a rehearsal" in said.out
    assert "measure it again" in said.out


@pytest.mark.parametrize(
    ("answers", "complaint"),
    [("\n1\nq\n", "each frequency needs at least one"), ("\n1\n", "no more answers")],
)
def test_a_calibration_that_was_left_writes_no_curve(calibrate, tmp_path, answers, complaint):
    out = tmp_path / "hand.toml"
    said = calibrate("--speaker", "simulated", "--out", str(out), answers=answers)
    assert said.code == 2
    assert complaint in said.err
    assert not out.exists()
