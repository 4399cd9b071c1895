"""The machine observer: what it cannot feel, it cannot tell apart, and nothing else is a secret."""

from __future__ import annotations

import dataclasses
import itertools
import json

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hapticvlm.commands.main import main
from hapticvlm.perception import FULL_SCALE_DB, drive_threshold_db, threshold_db
from hapticvlm_studio.design import paper, patterns
from hapticvlm_studio.design.patterns import paper_like
from hapticvlm_studio.design.stimuli import StudyError, checked
from hapticvlm_studio.observer import answers, channels, predict, presented
from hapticvlm_studio.observer.percepts import (
    FEATURES,
    HEAT,
    RENDERINGS,
    WEBER,
    Noise,
    Percepts,
    percepts,
    warmth_steps,
    weighed,
)

RATE_HZ = 48_000


def tone(frequency_hz: float, level: float, seconds: float = 1.0) -> np.ndarray:
    time_s = np.arange(round(seconds * RATE_HZ)) / RATE_HZ
    return level * np.sin(2.0 * np.pi * frequency_hz * time_s)


def set_of(*rows: np.ndarray) -> Percepts:
    names = tuple(f"p{i}" for i in range(len(rows)))
    return Percepts(names, np.array(rows)[:, None, :])


def steps_between(first: np.ndarray, second: np.ndarray) -> float:
    felt = [channels.vibration_steps(wave, RATE_HZ) for wave in (first, second)]
    return float(np.linalg.norm(felt[0] - felt[1]))


# Channels


def test_the_best_channel_at_each_frequency_is_the_palm_s_own_threshold():
    frequency_hz = np.arange(1.0, 1001.0)
    best = channels.channel_threshold_db(frequency_hz).min(axis=0)

    assert best == pytest.approx(threshold_db(frequency_hz), abs=1e-9)


def test_fine_vibration_stirs_the_pacinian_channel_and_slow_vibration_np_i():
    fast = channels.levels_db(tone(250.0, 0.1), RATE_HZ)[:, -1]
    slow = channels.levels_db(tone(20.0, 0.1), RATE_HZ)[:, -1]

    assert channels.CHANNELS[int(fast.argmax())] == "P"
    assert channels.CHANNELS[int(slow.argmax())] == "NP I"


def test_a_full_scale_sine_at_250_hz_is_45_db_above_threshold():
    level = channels.levels_db(tone(260.0, 1.0), RATE_HZ)[0, -1]

    assert level == pytest.approx(FULL_SCALE_DB, abs=2.0)


def test_a_vibration_is_felt_in_the_windows_it_fills():
    wave = np.concatenate((np.zeros(round(0.15 * RATE_HZ)), tone(200.0, 0.3, 0.35)))
    levels = channels.levels_db(wave, RATE_HZ)[0]

    assert levels[:2] == pytest.approx([0.0, 0.0], abs=0.1)
    assert levels[2] > 20.0
    assert levels[3] == 0.0


def test_what_is_below_threshold_is_not_felt_at_all():
    assert channels.levels_db(tone(200.0, 1e-4), RATE_HZ).max() < 0.2
    assert not channels.levels_db(np.zeros(10), RATE_HZ).any()


def test_a_weak_neighbour_of_a_strong_tone_is_masked_and_a_far_one_is_not():
    frequency_hz = np.arange(20.0, 1001.0, 20.0)
    level_db = np.full(frequency_hz.size, -200.0)
    level_db[frequency_hz == 200.0] = 0.0
    mask_db = channels.masked_db(level_db, frequency_hz)

    assert mask_db[frequency_hz == 220.0] > -6.0
    alone_db = drive_threshold_db(frequency_hz) - FULL_SCALE_DB
    assert mask_db[-20:] == pytest.approx(alone_db[-20:], abs=0.1), "far off only the threshold"
    assert mask_db[frequency_hz == 200.0] < 0.0, "a peak must not hide itself"


def test_low_frequencies_a_fifth_apart_differ_by_more_than_a_step():
    # People need 18-30 % (docs/physics.md 4.2); drive is equally strong from 40 to 250 Hz.
    assert steps_between(tone(100.0, 0.3), tone(120.0, 0.3)) > 1.0


@given(st.floats(-8.0, 8.0))
@pytest.mark.slow
@pytest.mark.nightly
def test_equal_gain_far_above_threshold_moves_a_distance_by_less_than_one_step(gain_db):
    first, second = tone(100.0, 0.3, 0.6), tone(220.0, 0.25, 0.6)
    gain = 10.0 ** (gain_db / 20.0)

    before = channels.levels_db(first, RATE_HZ)[0] - channels.levels_db(second, RATE_HZ)[0]
    after = (
        channels.levels_db(gain * first, RATE_HZ)[0] - channels.levels_db(gain * second, RATE_HZ)[0]
    )
    assert np.abs(before - after).max() / channels.WEBER_DB[0] < 1.0


def test_more_gain_can_be_reckoned_from_the_levels_alone():
    wave = tone(130.0, 0.05, 0.7)
    louder = channels.levels_db(wave * 10.0 ** (6.0 / 20.0), RATE_HZ)
    reckoned = channels.louder_db(channels.levels_db(wave, RATE_HZ), np.array(6.0))

    assert reckoned[0] == pytest.approx(louder[0], abs=0.2)


# Warmth


def test_warm_is_positive_cold_is_negative_and_neutral_is_nothing():
    ramp = np.linspace(0.0, 5.0, 101)

    assert (warmth_steps(32.0 + ramp, 0.02) > 0.0).all()
    assert warmth_steps(32.0 - ramp, 0.02) == pytest.approx(-warmth_steps(32.0 + ramp, 0.02))
    assert not warmth_steps(np.full(101, 32.0), 0.02).any()


def test_a_rate_of_43_percent_more_is_one_step_more():
    ramp = np.linspace(0.0, 4.0, 101)
    felt = [warmth_steps(32.0 - scale * ramp, 0.02)[0] for scale in (1.0, 1.0 + WEBER)]

    assert felt[0] - felt[1] == pytest.approx(1.0, abs=0.05)


# Observer


def test_identical_patterns_are_guessed_at_chance():
    same = set_of(*[np.ones(6)] * 10)
    counts = answers.confusion(same, 1.0, seed=1)

    assert answers.recognised(counts) == pytest.approx(0.1, abs=0.01)
    assert np.diag(counts) / counts.sum(axis=1) == pytest.approx(np.full(10, 0.1), abs=0.03)


def test_without_noise_every_difference_is_enough():
    rng = np.random.default_rng(3)
    counts = answers.confusion(set_of(*rng.normal(size=(10, 6))), 0.0, seed=1, trials=50)

    assert (counts == 50 * np.eye(10)).all()


@pytest.mark.nightly
@given(st.integers(0, 1000))
@pytest.mark.slow
def test_more_noise_never_helps(seed):
    patterns_ = set_of(*np.random.default_rng(seed).normal(size=(5, 4)))
    shares = [
        answers.recognised(answers.confusion(patterns_, noise, seed, trials=2000))
        for noise in (0.0, 0.2, 0.5, 1.0, 2.0, 5.0)
    ]

    assert shares[0] == 1.0
    assert all(later <= earlier + 0.02 for earlier, later in itertools.pairwise(shares))


def test_two_patterns_of_known_distance_are_told_apart_as_theory_says():
    # d' = 2 between two equally likely Gaussians: Phi(1) = 84.13 %.
    counts = answers.confusion(set_of(np.zeros(1), np.full(1, 2.0)), 1.0, seed=4, trials=40_000)

    assert answers.recognised(counts) == pytest.approx(0.8413, abs=0.005)


def test_calibration_finds_the_noise_of_a_known_distance():
    def share(percepts, noise, seed):
        return answers.recognised(answers.confusion(percepts, noise, seed))

    apart, alike = set_of(np.zeros(1), np.full(1, 6.0)), set_of(np.zeros(2), np.zeros(2))
    noise = answers.solve(lambda noise: share(apart, noise, 4), 0.8413)

    assert noise == pytest.approx(3.0, abs=0.1)
    with pytest.raises(ValueError, match="no noise"):
        answers.solve(lambda noise: share(alike, noise, 1), 0.8)


def test_the_same_seed_gives_the_same_answers():
    some = set_of(np.zeros(2), np.ones(2))

    assert (answers.confusion(some, 1.0, 7) == answers.confusion(some, 1.0, 7)).all()
    assert (answers.confusion(some, 1.0, 7) != answers.confusion(some, 1.0, 8)).any()


# Patterns


def test_what_is_presented_begins_with_the_contact_and_is_silent_after_the_release():
    glass = next(one for one in patterns.ours() if one.interaction == "tap")
    wave = presented.wave(glass, seed=1)
    skin_c = presented.skin_c(glass)

    assert np.abs(wave[: round(0.03 * RATE_HZ)]).max() > 0.02
    assert wave.size == round((glass.seconds + 2 * presented.STEP_S) * RATE_HZ)
    assert np.abs(wave).max() <= 1.0
    assert not wave[-round(0.01 * RATE_HZ) :].any()
    assert skin_c[0] == pytest.approx(32.0, abs=0.1)
    assert skin_c[-1] > 35.0


@pytest.mark.parametrize("warmth", ["hot", "cold"])
def test_a_pattern_is_as_warm_as_it_gets_for_the_whole_of_its_strokes(warmth):
    for pattern in patterns.ours():
        if pattern.temperature != warmth:
            continue
        felt_c = presented.skin_c(pattern)[presented.lead_steps(pattern) :]

        assert np.ptp(felt_c) < 0.65, pattern.name
        assert np.abs(felt_c - pattern.setpoint_c).max() < 1.1, pattern.name


def test_repeated_strokes_bring_the_same_heat_as_one():
    glass = next(one for one in patterns.ours() if one.interaction == "tap")
    assert glass.repeats > 1
    once = presented.skin_c(dataclasses.replace(glass, repeats=1))

    assert presented.skin_c(glass) == pytest.approx(once, abs=0.02)


def test_a_hand_that_waits_for_the_plate_is_silent():
    for pattern in patterns.ours():
        steps, still = [], []
        for step, part, motion in presented._hand(pattern):
            if part is not None and part.is_still and step < presented.lead_steps(pattern):
                steps.append(part.phase)
                still.append(presented._touch(pattern, part, motion, 0.0))

        assert len(steps) == presented.lead_steps(pattern)
        assert set(steps) == {"approach", "slide"}
        assert all(touch.speed_mps == touch.force_n == 0.0 for touch in still)


def test_a_held_tap_does_not_rub():
    glass = next(one for one in paper_like() if one.interaction == "tap")
    wave = presented.wave(dataclasses.replace(glass, repeats=1), seed=1)

    assert not wave[round(0.6 * RATE_HZ) :].any()


def test_our_ten_patterns_are_the_paper_s_five_vibrations_hot_and_cold_within_limits():
    ten = checked(patterns.ours())

    assert tuple(one.vibration for one in ten[:5]) == paper.VIBRATIONS
    assert [one.temperature for one in ten] == ["hot"] * 5 + ["cold"] * 5
    assert all(18.0 <= one.setpoint_c <= 40.0 for one in ten)
    assert len(checked(patterns.twenty())) == 20


def test_strokes_were_chosen_on_other_renderings_than_those_reported():
    assert not set(answers.SEEDS) & set(RENDERINGS)
    assert predict.CALIBRATION_SEED != predict.REPORT_SEED


def test_the_search_keeps_apart_what_loudness_alone_would_tell_apart():
    loud, soft = np.full((1, 16), 30.0), np.full((1, 16), 25.0)
    other = np.concatenate((np.full((1, 8), 30.0), np.full((1, 8), 15.0)), axis=1)

    assert answers.distances(loud, soft)[0, 0] < 1.0
    assert answers.distances(loud, other)[0, 0] > 5.0
    assert answers.distances(soft, loud) == pytest.approx(answers.distances(loud, soft).T, abs=1e-6)


@pytest.fixture(scope="module")
def noise() -> Noise:
    return predict.paper_noise()


@pytest.mark.nightly
def test_calibrated_on_the_paper_our_ten_reach_the_goal(noise):
    found = predict.predict(patterns.ours(), noise)

    assert found.recognised >= 0.95
    assert found.constant == 0.1
    assert max(found.one_feature[1], found.heat_only) < 0.6 < found.touch_only + 0.2
    shares = [share for _, share in found.curve]
    assert shares == sorted(shares, reverse=True)
    assert (found.counts.sum(axis=1) == answers.TRIALS).all()


@pytest.mark.nightly
@pytest.mark.slow
def test_the_calibrated_observer_confuses_most_what_people_confused_most(noise):
    found = predict.check(noise)

    assert answers.recognised(found.counts) == pytest.approx(paper.RECOGNISED, abs=0.01)
    assert found.pairs[0][0] == max(found.pairs, key=lambda pair: pair[2])[0] == "FR-MW"
    assert found.order > 0.3
    assert found.temperature_slips[1] == pytest.approx(found.temperature_slips[0], abs=0.005)


@pytest.mark.nightly
def test_other_guesses_of_the_paper_s_stimuli_give_other_figures_and_the_same_seed_the_same():
    ten = patterns.ours()
    found = predict.spread(ten, 4)

    assert found is not None
    assert found == predict.spread(ten, 4)
    assert found.count == 4
    assert 0.5 < found.lowest < found.median < found.highest < 1.0
    assert found.lowest <= found.tenth <= found.median <= found.ninetieth <= found.highest


def test_a_guess_has_the_paper_s_five_vibrations_hot_and_cold_with_one_lead():
    ten = predict.guess(np.random.default_rng(1))

    assert tuple(one.vibration for one in ten[:5]) == paper.VIBRATIONS
    assert len({(one.temperature, one.setpoint_c) for one in ten}) == 2
    assert len({one.lead_s for one in ten}) == 1


@pytest.mark.slow
@pytest.mark.nightly
def test_features_in_units_of_their_noise_are_told_apart_as_with_that_noise():
    some = percepts(patterns.ours())
    halved = weighed(some, Noise(2.0, 4.0))

    assert halved.steps[..., HEAT] == pytest.approx(some.steps[..., HEAT] / 4.0)
    alike = weighed(some, Noise(2.0, 2.0))
    assert (answers.confusion(alike, 1.0, 3) == answers.confusion(some, 2.0, 3)).all()
    assert np.isfinite(weighed(some, Noise(0.0, 0.0)).steps).all()


@pytest.mark.nightly
def test_hot_and_cold_of_one_vibration_differ_by_heat_alone():
    hot, _, _, _, _, cold, *_ = percepts(patterns.ours()).steps
    heat = len(FEATURES) - 2

    assert hot[:, :heat] == pytest.approx(cold[:, :heat])
    assert (hot[:, heat:] > 0.0).all()
    assert (cold[:, heat:] < 0.0).all()


# Command


def test_predict_prints_one_json_document_that_says_what_it_is(capsys):
    assert main(["study", "predict", "--noise", "2", "--json"]) == 0
    document = json.loads(capsys.readouterr().out)

    assert "not people" in document["what"]
    assert np.array(document["counts"]).shape == (10, 10)
    assert "paper_check" not in document
    assert document["noise"] == {"touch": 2.0, "heat": 2.0}
    assert all(begin > 34.9 for begin, _ in document["palm_c"][:5])


def test_predict_says_in_one_line_what_is_wrong(tmp_path, capsys):
    file = tmp_path / "patterns.toml"
    file.write_text('[[pattern]]\nname = "a"\n')

    assert main(["study", "predict", "--patterns", str(file)]) == 2
    assert capsys.readouterr().err.count("\n") == 1
    with pytest.raises(SystemExit):
        main(["study", "predict", "--noise", "nan"])
    with pytest.raises(StudyError):
        checked(patterns.ours() * 2)
