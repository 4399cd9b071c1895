"""Predicts how a set of patterns is recognised. The observer is a model; no person answered.

Its two noises are calibrated on a set like the paper's, one after the other. First the noise of
heat is set so that hot and cold are mistaken for each other as often as the paper's nine people
mistook them (4.2 %), looking at heat alone. Then the noise of vibration is set so that, with that
noise of heat, the whole set is recognised as often as by these people (84.67 %). Two figures fix
two numbers; the order in which pairs are confused is left over and is compared (`check`).

A prediction supports two statements: a set that this observer confuses has little in these channels
that could tell its patterns apart, and one set has more than another. It does not support that
people reach the figure:
- The paper's recordings, levels and temperatures are unpublished, so the set like it is a guess.
  `spread` tries other guesses, each calibrated in the same way.
- Channel slopes and the level of the speaker are partly unchecked (docs/physics.md 5).
- The observer neither learns nor forgets, presses no wrong key, and does not feel rhythm.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.stats import spearmanr

from hapticvlm_studio.design import paper, patterns
from hapticvlm_studio.design.patterns import paper_like
from hapticvlm_studio.design.stimuli import Stimulus, StudyError, checked
from hapticvlm_studio.observer import answers
from hapticvlm_studio.observer.percepts import (
    FEATURES,
    HEAT,
    TOUCH,
    Noise,
    Percepts,
    palm_c,
    percepts,
    weighed,
)

RECORDED = (1,)  # one rendering: the paper played recordings, the same each time
CALIBRATION_SEED = 11
REPORT_SEED = 5
CALIBRATION_TRIALS = 10_000
FACTORS = (0.5, 0.6, 0.7, 0.85, 1.0, 1.2, 1.4, 1.7, 2.0)  # of the noise, half to twice
# From what range the paper's temperatures and leads are guessed.
HOT_C = (34.0, 40.0)
COLD_C = (23.0, 29.5)
LEAD_S = (0.25, 3.0)
GUESSES = 20
GUESS_TRIALS = 2000
GUESS_SEED = 23
_MAX_DRAWS = 3  # for every guess wanted; for some guesses no noise gives the paper's figures
_MAX_PAIRS = 10
_MIN_SHARE = 0.005

_Counts = NDArray[np.int64]


@dataclass(frozen=True, slots=True)
class Pair:
    """The share (0..1) of a pattern's trials in which it is answered as another."""

    presented: str
    answered: str
    share: float


@dataclass(frozen=True, slots=True)
class Prediction:
    """The observer's answers to one set at one noise; shares are 0..1.

    `counts` is (patterns, patterns), presented in rows. Beside `recognised` stand what less would
    reach: `constant`, always the same answer; `one_feature`, the best single feature and its share;
    `touch_only` and `heat_only`. `curve` has (factor of the noise, share recognised). `palm_c` is
    the skin on the simulated plate as each pattern's first stroke begins and its last ends.
    """

    names: tuple[str, ...]
    noise: Noise
    recognised: float
    counts: _Counts
    pairs: tuple[Pair, ...]
    constant: float
    one_feature: tuple[str, float]
    touch_only: float
    heat_only: float
    curve: tuple[tuple[float, float], ...]
    palm_c: tuple[tuple[float, float], ...]


@dataclass(frozen=True, slots=True)
class PaperCheck:
    """The calibrated observer on the set like the paper's, beside the paper's nine people.

    `order` is Spearman's correlation over the ten pairs of vibrations. `pairs` holds each pair with
    the people's and the observer's share of confusions, the pair most confused by people first.
    `temperature_slips` are the people's and the observer's shares of hot-cold confusions.
    """

    noise: Noise
    counts: _Counts
    order: float
    pairs: tuple[tuple[str, float, float], ...]
    temperature_slips: tuple[float, float]


def paper_noise() -> Noise:
    """Return the noise at which the shipped set like the paper's gives the paper's figures."""
    return calibrated(paper_like(), CALIBRATION_TRIALS)


def calibrated(guess: Sequence[Stimulus], trials: int) -> Noise:
    """Return the noise at which a guess of the paper's ten patterns gives the paper's figures.

    Raises ValueError when there is no such noise.
    """
    features = percepts(guess, RECORDED)
    seed = CALIBRATION_SEED
    heat_features = features.only(HEAT)

    # Every call uses the same seed, so the share is a deterministic, falling function of the noise,
    # and bisection does not chase random fluctuations.
    def temperature_recognised(heat: float) -> float:
        return 1.0 - _slips(answers.confusion(heat_features, heat, seed, trials))

    heat = answers.solve(temperature_recognised, 1.0 - _slips(paper.confusion()))

    def recognised(touch: float) -> float:
        scaled = weighed(features, Noise(touch, heat))
        return answers.recognised(answers.confusion(scaled, 1.0, seed, trials))

    return Noise(answers.solve(recognised, paper.RECOGNISED), heat)


def predict(stimuli: Sequence[Stimulus], noise: Noise) -> Prediction:
    """Predict how a set is recognised and confused, with simpler baselines beside it."""
    raw = percepts(stimuli)
    features = weighed(raw, noise)
    counts = answers.confusion(features, 1.0, REPORT_SEED)
    return Prediction(
        features.names,
        noise,
        answers.recognised(counts),
        counts,
        confused(counts, features.names),
        1.0 / len(features.names),
        _best_feature(features),
        _share(features.only(TOUCH)),
        _share(features.only(HEAT)),
        tuple((factor, _share(weighed(raw, noise.scaled(factor)))) for factor in FACTORS),
        tuple(palm_c(stimulus) for stimulus in stimuli),
    )


def confused(counts: _Counts, names: Sequence[str]) -> tuple[Pair, ...]:
    """Return the pairs confused in at least 0.5 % of trials, most first, ten at most."""
    share = counts / counts.sum(axis=1, keepdims=True)
    pairs = [
        Pair(names[i], names[j], float(share[i, j]))
        for i, j in zip(*np.nonzero(share >= _MIN_SHARE), strict=True)
        if i != j
    ]
    return tuple(sorted(pairs, key=lambda pair: -pair.share)[:_MAX_PAIRS])


def check(noise: Noise) -> PaperCheck:
    """Compare the observer's confusions of the set like the paper's with the people's."""
    features = weighed(percepts(paper_like(), RECORDED), noise)
    counts = answers.confusion(features, 1.0, REPORT_SEED)
    people = _by_pair(paper.confusion())
    machine = _by_pair(counts)
    rank = float(spearmanr(list(people.values()), list(machine.values())).statistic)
    rows = sorted(((name, people[name], machine[name]) for name in people), key=lambda row: -row[1])
    slips = _slips(paper.confusion()), _slips(counts)
    return PaperCheck(noise, counts, rank, tuple(rows), slips)


def _by_pair(counts: _Counts) -> dict[str, float]:
    """Return the share of all trials in which a pair of vibrations was confused, either way."""
    # Rows and columns are (temperature, vibration): summing over temperature leaves vibrations.
    by_vibration = counts.reshape(2, 5, 2, 5).sum(axis=(0, 2)) / counts.sum()
    return {
        f"{paper.SHORT[i]}-{paper.SHORT[j]}": float(by_vibration[i, j] + by_vibration[j, i])
        for i in range(5)
        for j in range(i + 1, 5)
    }


def _slips(counts: _Counts) -> float:
    """Return the share of all trials in which hot was answered as cold or cold as hot."""
    by_temperature = counts.reshape(2, 5, 2, 5).sum(axis=(1, 3))
    return float(1.0 - np.trace(by_temperature) / counts.sum())


def _best_feature(features: Percepts) -> tuple[str, float]:
    shares = [_share(features.only([column])) for column in range(len(FEATURES))]
    best = int(np.argmax(shares))
    return FEATURES[best], shares[best]


def _share(features: Percepts) -> float:
    """Return the share recognised, of features in units of their noise."""
    return answers.recognised(answers.confusion(features, 1.0, REPORT_SEED))


@dataclass(frozen=True, slots=True)
class Spread:
    """Shares recognised (0..1) of one set over `count` guesses; `unfit` guesses had no noise."""

    count: int
    unfit: int
    lowest: float
    tenth: float
    median: float
    ninetieth: float
    highest: float


def spread(stimuli: Sequence[Stimulus], count: int = GUESSES) -> Spread | None:
    """Predict the set with the noise of each guess; None where no guess can be calibrated."""
    raw = percepts(stimuli)
    rng = np.random.default_rng(GUESS_SEED)
    shares: list[float] = []
    unfit = 0
    while len(shares) < count and len(shares) + unfit < _MAX_DRAWS * count:
        try:
            noise = calibrated(guess(rng), GUESS_TRIALS)
        except (ValueError, StudyError):
            unfit += 1
            continue
        counts = answers.confusion(weighed(raw, noise), 1.0, REPORT_SEED, GUESS_TRIALS)
        shares.append(answers.recognised(counts))
    if not shares:
        return None
    return Spread(len(shares), unfit, *np.percentile(shares, (0, 10, 50, 90, 100)).tolist())


def guess(rng: np.random.Generator) -> tuple[Stimulus, ...]:
    """Draw ten patterns that may have been the paper's. Raises StudyError if they are invalid."""
    hot_c, cold_c, lead_s = (float(rng.uniform(*ends)) for ends in (HOT_C, COLD_C, LEAD_S))
    strokes = [row[int(rng.integers(len(row)))] for row in patterns.candidates()]
    ten = patterns.hot_and_cold(strokes)
    setpoints = {"hot": hot_c, "cold": cold_c}
    return checked(
        dataclasses.replace(stimulus, setpoint_c=setpoints[stimulus.temperature], lead_s=lead_s)
        for stimulus in ten
    )
