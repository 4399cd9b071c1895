"""What the machine observer makes of a set of patterns: a prediction, never a person's answer.

Its two noises are calibrated on a set like the paper's: that of heat so that hot and cold are taken
for each other as often as nine people took the paper's, that of vibration so that the whole is
recognised as often. What that proves: a set that this observer confuses leaves little in these
channels to tell its patterns apart by, and one set leaves more than another. What it does not: that
people reach the figure. The paper's recordings, levels and temperatures are unpublished, so the set
like it is a guess (`spread` tries others, each calibrated alike); channel slopes and the speaker's
level are partly unchecked (docs/physics.md 5); nothing is learnt, forgotten or pressed by mistake;
and rhythm is not counted.
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

RECORDED = (1,)  # the paper played recordings: one rendering, the same each time
CALIBRATION_SEED = 11
REPORT_SEED = 5
CALIBRATION_TRIALS = 10_000
FACTORS = (0.5, 0.6, 0.7, 0.85, 1.0, 1.2, 1.4, 1.7, 2.0)  # of the noise: two either way
# what a study may have used
HOT_C = (34.0, 40.0)
COLD_C = (23.0, 29.5)
LEAD_S = (0.25, 3.0)
GUESSES = 20
GUESS_TRIALS = 2000
GUESS_SEED = 23
_MOST_DRAWS = 3  # for every guess wanted; some let no noise give the paper's figures
_PAIRS_SHOWN = 10
_PAIR_FLOOR = 0.005

_Counts = NDArray[np.int64]


@dataclass(frozen=True, slots=True)
class Pair:
    """How often (0..1) a pattern presented is taken for another."""

    presented: str
    answered: str
    share: float


@dataclass(frozen=True, slots=True)
class Prediction:
    """What the observer does with one set at one noise; shares are 0..1.

    `palm_c` is skin on the simulated plate as each pattern's first stroke begins and its last ends.
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
    """The calibrated observer on the set like the paper's, beside the nine people.

    `order` is Spearman's correlation over the ten pairs of vibrations; `pairs` holds each pair with
    the people's and the observer's share of confusions, most confused by people first.
    """

    noise: Noise
    counts: _Counts
    order: float
    pairs: tuple[tuple[str, float, float], ...]
    temperature_slips: tuple[float, float]


def paper_noise() -> Noise:
    """Noise at which the set like the paper's is confused as often as the paper's was."""
    return calibrated(paper_like(), CALIBRATION_TRIALS)


def calibrated(guess: Sequence[Stimulus], trials: int) -> Noise:
    """Noise at which a guess of the paper's ten is confused as often as the paper's was.

    Raises ValueError when no noise does that.
    """
    features = percepts(guess, RECORDED)
    seed = CALIBRATION_SEED
    warm = features.only(HEAT)

    def warmth_recognised(heat: float) -> float:
        return 1.0 - _slips(answers.confusion(warm, heat, seed, trials))

    heat = answers.solve(warmth_recognised, 1.0 - _slips(paper.confusion()))

    def recognised(touch: float) -> float:
        scaled = weighed(features, Noise(touch, heat))
        return answers.recognised(answers.confusion(scaled, 1.0, seed, trials))

    return Noise(answers.solve(recognised, paper.RECOGNISED), heat)


def predict(stimuli: Sequence[Stimulus], noise: Noise) -> Prediction:
    """Predict how a set would be recognised and confused, with baselines beside it."""
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
    """Return the pairs that are confused at all, most first."""
    share = counts / counts.sum(axis=1, keepdims=True)
    pairs = [
        Pair(names[i], names[j], float(share[i, j]))
        for i, j in zip(*np.nonzero(share >= _PAIR_FLOOR), strict=True)
        if i != j
    ]
    return tuple(sorted(pairs, key=lambda pair: -pair.share)[:_PAIRS_SHOWN])


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
    """Share of all trials in which one vibration of a pair was taken for the other, by pair."""
    by_vibration = counts.reshape(2, 5, 2, 5).sum(axis=(0, 2)) / counts.sum()
    return {
        f"{paper.SHORT[i]}-{paper.SHORT[j]}": float(by_vibration[i, j] + by_vibration[j, i])
        for i in range(5)
        for j in range(i + 1, 5)
    }


def _slips(counts: _Counts) -> float:
    """Share of all trials in which hot was taken for cold or cold for hot."""
    by_temperature = counts.reshape(2, 5, 2, 5).sum(axis=(1, 3))
    return float(1.0 - np.trace(by_temperature) / counts.sum())


def _best_feature(features: Percepts) -> tuple[str, float]:
    shares = [_share(features.only([column])) for column in range(len(FEATURES))]
    best = int(np.argmax(shares))
    return FEATURES[best], shares[best]


def _share(features: Percepts) -> float:
    """Share recognised of patterns in units of the noise."""
    return answers.recognised(answers.confusion(features, 1.0, REPORT_SEED))


@dataclass(frozen=True, slots=True)
class Spread:
    """Shares recognised (0..1) of one set over `count` guesses; `unfit` ones fitted no noise."""

    count: int
    unfit: int
    lowest: float
    tenth: float
    median: float
    ninetieth: float
    highest: float


def spread(stimuli: Sequence[Stimulus], count: int = GUESSES) -> Spread | None:
    """Predict the set with every guess's noise; None where no guess can be calibrated."""
    raw = percepts(stimuli)
    rng = np.random.default_rng(GUESS_SEED)
    shares: list[float] = []
    unfit = 0
    while len(shares) < count and len(shares) + unfit < _MOST_DRAWS * count:
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
    """Draw ten patterns that the paper's might have been. Raises StudyError if none can be so."""
    hot_c, cold_c, lead_s = (float(rng.uniform(*ends)) for ends in (HOT_C, COLD_C, LEAD_S))
    strokes = [row[int(rng.integers(len(row)))] for row in patterns.candidates()]
    ten = patterns.hot_and_cold(strokes)
    setpoints = {"hot": hot_c, "cold": cold_c}
    return checked(
        dataclasses.replace(stimulus, setpoint_c=setpoints[stimulus.temperature], lead_s=lead_s)
        for stimulus in ten
    )
