"""What the machine observer makes of a set of patterns: a prediction, never a person's answer.

Its noise is calibrated so that a set like the paper's is recognised as often as nine people
recognised the paper's. What that proves: a set that this observer confuses leaves little in these
channels to tell its patterns apart by, and one set leaves more than another. What it does not:
that people reach the figure. The paper's recordings, levels and temperatures are unpublished, so
the set like it is a guess; channel slopes and the speaker's level are partly from memory; nothing
is learnt, forgotten or pressed by mistake; and rhythm is not counted.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.stats import spearmanr

from hapticvlm.study import observer, paper
from hapticvlm.study.observer import Percepts
from hapticvlm.study.percepts import FEATURES, HEAT, TOUCH, percepts
from hapticvlm.study.stimuli import Stimulus, paper_like

CALIBRATION_SEED, REPORT_SEED = 11, 5
CALIBRATION_TRIALS = 10_000
FACTORS = (0.5, 0.6, 0.7, 0.85, 1.0, 1.2, 1.4, 1.7, 2.0)  # of the noise: two either way
_PAIRS_SHOWN, _PAIR_FLOOR = 10, 0.005

_Counts = NDArray[np.int64]


@dataclass(frozen=True, slots=True)
class Pair:
    """How often (0..1) a pattern presented is taken for another."""

    presented: str
    answered: str
    share: float


@dataclass(frozen=True, slots=True)
class Prediction:
    """What the observer does with one set at one noise (Weber steps); shares are 0..1."""

    names: tuple[str, ...]
    noise: float
    recognised: float
    counts: _Counts
    pairs: tuple[Pair, ...]
    constant: float
    one_feature: tuple[str, float]
    touch_only: float
    heat_only: float
    curve: tuple[tuple[float, float], ...]


@dataclass(frozen=True, slots=True)
class PaperCheck:
    """The calibrated observer on the set like the paper's, beside the nine people.

    `order` is Spearman's correlation over the ten pairs of vibrations; `pairs` holds each pair with
    the people's and the observer's share of confusions, most confused by people first.
    """

    noise: float
    counts: _Counts
    order: float
    pairs: tuple[tuple[str, float, float], ...]
    temperature_slips: tuple[float, float]


def paper_noise() -> float:
    """Noise in Weber steps at which a set like the paper's is recognised as the paper's was."""
    return observer.calibrate(
        percepts(paper_like()), paper.RECOGNISED, CALIBRATION_SEED, CALIBRATION_TRIALS
    )


def predict(stimuli: Sequence[Stimulus], noise: float) -> Prediction:
    """Predict how a set would be recognised and confused, with baselines beside it."""
    felt = percepts(stimuli)
    counts = observer.confusion(felt, noise, REPORT_SEED)
    return Prediction(
        felt.names,
        noise,
        observer.recognised(counts),
        counts,
        confused(counts, felt.names),
        1.0 / len(felt.names),
        _best_feature(felt, noise),
        _share(felt.only(TOUCH), noise),
        _share(felt.only(HEAT), noise),
        tuple((factor, _share(felt, factor * noise)) for factor in FACTORS),
    )


def confused(counts: _Counts, names: Sequence[str]) -> tuple[Pair, ...]:
    """List the pairs that are confused at all, most first."""
    share = counts / counts.sum(axis=1, keepdims=True)
    pairs = [
        Pair(names[i], names[j], float(share[i, j]))
        for i, j in zip(*np.nonzero(share >= _PAIR_FLOOR), strict=True)
        if i != j
    ]
    return tuple(sorted(pairs, key=lambda pair: -pair.share)[:_PAIRS_SHOWN])


def check(noise: float) -> PaperCheck:
    """Put the observer's confusions of the set like the paper's beside the people's."""
    counts = observer.confusion(percepts(paper_like()), noise, REPORT_SEED)
    people, machine = _by_pair(paper.confusion()), _by_pair(counts)
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


def _best_feature(felt: Percepts, noise: float) -> tuple[str, float]:
    shares = [_share(felt.only([column]), noise) for column in range(len(FEATURES))]
    best = int(np.argmax(shares))
    return FEATURES[best], shares[best]


def _share(felt: Percepts, noise: float) -> float:
    return observer.recognised(observer.confusion(felt, noise, REPORT_SEED))
