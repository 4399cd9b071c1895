"""Estimates the weakest vibration that a hand feels on its speaker, at four frequencies. Pure.

A trial is a forced choice between two moments of half a second, of which one vibrates. The person
names one of them, or says that neither was felt. The vibration is felt with the probability

    p(felt) = lapse / 2 + (1 - lapse) Phi((level - threshold) / spread)            (1)

where Phi is the normal distribution function, `level` the drive in dB of full scale, `spread` the
width of the transition, and `lapse` the share of answers that are given without attention. At
`level = threshold` the vibration is felt in half of the trials; this is the convergence point, the
level that the procedure looks for. A person who did not feel it guesses a moment with the
probability `guess` and is then right half of the time, and otherwise says "neither":

    p(right)   = p(felt) + (1 - p(felt)) guess / 2
    p(wrong)   =           (1 - p(felt)) guess / 2                                  (2)
    p(neither) =           (1 - p(felt)) (1 - guess)

Equation (2) separates what is felt from the willingness to say so. A person who always guesses and
one who never does get the same threshold, whereas a yes-no question ("did it vibrate?") would give
the more generous person a lower one. `guess` differs from person to person, so it is estimated
together with the thresholds.

The procedure is Bayesian and adaptive: it keeps a probability for every combination of threshold
and guess rate on a grid, multiplies it by (2) after each answer, and presents next the level whose
answer has the greatest expected information (mutual information between answer and unknowns).
Unlike a staircase, which moves by fixed steps, it uses every answer so far and gives an interval.

Speaker and hand are measured together: a drive that is not felt may mean that the speaker hardly
moves or that the hand hardly feels, and the correction is the same. So no accelerometer is needed,
and the result is a curve like that of `calibrate speaker`: how much more or less this pair gives
than the nominal one of `perception.drive_threshold_db`, set to 0 dB at 250 Hz.

Forty-eight answers of a simulated hand whose thresholds lie 8 dB (standard deviation) from what one
common offset explains give each threshold within 1.2 dB if the hand never guesses, 1.8 dB if it
guesses half of the time and 2.8 dB if it always does (mean error, 60 seeds); the 95 % intervals
contain the planted value in 94 to 97 % of cases. No person has been measured (physics.md 4.1).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from statistics import NormalDist
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from hapticvlm.devices.speaker.speaker_files import SpeakerResponse
from hapticvlm.perception import drive_threshold_db
from hapticvlm.rendering.vibration.vibration import RATE_HZ

FREQUENCIES_HZ = (40.0, 100.0, 250.0, 500.0)
TRIALS = 12  # at each frequency: three minutes for all four
LEVELS_DB = np.arange(-90.0, -5.0, 1.0)  # of full scale, so at most half of it is played
DEVIATION_DB = 8.0  # of one frequency from the offset that all share; our choice
SPREAD_DB = 3.0  # in (1); our choice, as steep as detection is usually found to be
GUESS_RATES = (0.1, 0.5, 0.9)  # grid of `guess` in (2)
LAPSE = 0.04  # in (1); our choice
INTERVAL = 0.95
# Planted by --simulate: a speaker that is weak at 40 Hz under a hand that feels 500 Hz well.
SIMULATED_THRESHOLDS_DB = (-33.0, -44.0, -45.0, -28.0)
MOMENT_S = 0.5
GAP_S = 0.4
RAMP_S = 0.05  # so that no click gives the tone away

Answer = Literal["right", "wrong", "neither"]
ANSWERS: tuple[Answer, ...] = ("right", "wrong", "neither")
Floats = NDArray[np.float64]

TINY = 1e-300  # keeps the logarithm of 0 finite
_normal = np.vectorize(NormalDist().cdf, otypes=[np.float64])


@dataclass(frozen=True, slots=True)
class Estimate:
    """A threshold in dB of full scale, the ends of its 95 % interval, and the trials behind it."""

    frequency_hz: float
    threshold_db: float
    low_db: float
    high_db: float
    trials: int


class ThresholdEstimator:
    """Probabilities of the four thresholds of one hand on one speaker, given its answers so far.

    The strength of the speaker shifts all four thresholds together, so an answer at one frequency
    is informative about the others. The prior says so: each threshold is the nominal one plus an
    offset that all four share, plus a deviation of its own (normal, DEVIATION_DB). Given the offset
    and the guess rate the four thresholds are independent. A grid over all unknowns would have six
    dimensions; this factorisation needs four grids of (offset, threshold) instead, and the sum over
    the others is a product of three sums.
    """

    def __init__(self) -> None:
        # Likelihood of all answers so far, (guess rates, frequencies, thresholds).
        self._likelihoods = np.ones((len(GUESS_RATES), len(FREQUENCIES_HZ), LEVELS_DB.size))
        self._trials = [0] * len(FREQUENCIES_HZ)

    def next_level_db(self, index: int) -> float:
        """Return the most informative level for FREQUENCIES_HZ[index], dB of full scale."""
        posterior = self._posterior(index)
        # The expected information of a trial is the entropy of its predicted answer, less the
        # entropy that would remain if threshold and guess rate were known. The first is high where
        # the answer is uncertain for any reason; the second removes the part that is mere chance,
        # which no amount of knowledge could predict.
        predicted = np.einsum("agts,gs->at", _ANSWER_CHANCES, posterior)  # (answers, levels)
        remaining = np.einsum("gts,gs->t", _ANSWER_ENTROPIES, posterior)  # (levels,)
        return float(LEVELS_DB[int(np.argmax(_entropy(predicted) - remaining))])

    def learn(self, index: int, level_db: float, answer: Answer) -> None:
        """Take one answer at FREQUENCIES_HZ[index] into account."""
        chances = answer_chances(level_db, LEVELS_DB[None, :], _GUESS_COLUMN)
        self._likelihoods[:, index] *= chances[ANSWERS.index(answer)]
        self._trials[index] += 1

    def estimates(self) -> list[Estimate]:
        """Return the posterior median of each threshold, with its 95 % interval."""
        tail = (1.0 - INTERVAL) / 2.0
        estimates = []
        for index, frequency_hz in enumerate(FREQUENCIES_HZ):
            # The guess rate is summed out, so its uncertainty widens the interval as it should.
            cumulative = np.cumsum(self._posterior(index).sum(axis=0))
            low, median, high = np.interp([tail, 0.5, 1.0 - tail], cumulative, LEVELS_DB)
            trials = self._trials[index]
            estimates.append(Estimate(frequency_hz, float(median), float(low), float(high), trials))
        return estimates

    def _posterior(self, index: int) -> Floats:
        """Return the probability of each guess rate and threshold, (guess rates, thresholds)."""
        # evidence[g, f, o]: probability of all answers at frequency f for guess rate g and offset
        # o, whatever the threshold at f is. The answers at the other three frequencies bear on
        # this one only through the offset and the guess rate, so their product is all that is
        # needed of them; summing it over the offset prior gives the prior of this threshold.
        evidence = np.einsum("fos,gfs->gfo", _PRIORS, self._likelihoods)
        others = np.prod(np.delete(evidence, index, axis=1), axis=1)  # (guess rates, offsets)
        posterior = (others @ _PRIORS[index]) * self._likelihoods[:, index]
        return np.asarray(posterior / posterior.sum())


def answer_chances(
    level_db: float | Floats, threshold_db: float | Floats, guess_rate: float | Floats
) -> tuple[Floats, Floats, Floats]:
    """Return the probability of each of ANSWERS by (1) and (2), for shapes that broadcast."""
    above_db = np.asarray(level_db) - np.asarray(threshold_db)
    felt = LAPSE / 2.0 + (1.0 - LAPSE) * _normal(above_db / SPREAD_DB)
    guessed = (1.0 - felt) * guess_rate
    return felt + guessed / 2.0, guessed / 2.0, np.asarray(1.0 - felt - guessed)


def trial_order(trials: int, seed: int) -> list[tuple[int, bool]]:
    """Return (index of the frequency, whether the first moment vibrates) of every trial.

    Every round presents all frequencies once, in an order of its own: skin adapts to a vibration
    that is repeated, and a run of one frequency would raise its threshold.
    """
    rng = np.random.default_rng(seed)
    return [
        (int(index), bool(rng.random() < 0.5))
        for _ in range(trials)
        for index in rng.permutation(len(FREQUENCIES_HZ))
    ]


def moments(frequency_hz: float, level_db: float, *, is_first: bool) -> NDArray[np.float32]:
    """Return the two moments with the gap between them, (N,) float32 at RATE_HZ, full scale 1."""
    time_s = np.arange(int(MOMENT_S * RATE_HZ)) / RATE_HZ
    # A tone that starts abruptly has energy at all frequencies, and the most sensitive channel
    # would feel it as a click. A raised cosine of RAMP_S keeps the tone's energy 60 Hz away from it
    # 50 dB down.
    edge = np.minimum(time_s, MOMENT_S - time_s) / RAMP_S
    ramp = 0.5 - 0.5 * np.cos(np.pi * np.clip(edge, 0.0, 1.0))
    tone = 10.0 ** (level_db / 20.0) * ramp * np.sin(2.0 * math.pi * frequency_hz * time_s)
    gap = np.zeros(int(GAP_S * RATE_HZ))
    parts = (tone, gap, 0.0 * tone) if is_first else (0.0 * tone, gap, tone)
    return np.concatenate(parts).astype(np.float32)


def as_response(estimates: Sequence[Estimate], *, simulated: bool) -> SpeakerResponse:
    """Return the response of speaker and hand together, the curve that the service corrects.

    A threshold that is 5 dB above the nominal one means that this pair gives 5 dB less. Only the
    shape matters to a correction, so the response is 0 dB at 250 Hz (interpolated over log
    frequency). The threshold there says how far full scale lies above it.
    """
    frequency_hz = np.array([estimate.frequency_hz for estimate in estimates])
    threshold_db = np.array([estimate.threshold_db for estimate in estimates])
    response_db = drive_threshold_db(frequency_hz) - threshold_db
    response_db -= np.interp(math.log(250.0), np.log(frequency_hz), response_db)
    full_scale_db = -float(np.interp(math.log(250.0), np.log(frequency_hz), threshold_db))
    return SpeakerResponse(
        tuple(frequency_hz.tolist()), tuple(response_db.tolist()), simulated, full_scale_db
    )


class SimulatedHand:
    """Answers by (1) and (2) with planted thresholds: a simulation, not a person."""

    def __init__(
        self, thresholds_db: Sequence[float], guess_rate: float = 0.5, seed: int = 0
    ) -> None:
        self._thresholds_db = tuple(thresholds_db)
        self._guess_rate = guess_rate
        self._rng = np.random.default_rng(seed)

    def answer(self, index: int, level_db: float) -> Answer:
        """Return a random answer at FREQUENCIES_HZ[index]."""
        chances = answer_chances(level_db, self._thresholds_db[index], self._guess_rate)
        return ANSWERS[int(self._rng.choice(3, p=[float(chance) for chance in chances]))]


def _entropy(chances: Floats) -> Floats:
    """Return the entropy in nats over the answers, which are the first axis."""
    # 0 log 0 is 0.
    return np.asarray(-(chances * np.log(np.maximum(chances, TINY))).sum(axis=0))


def _prior(frequency_hz: float) -> Floats:
    """Return the probability of each threshold given each offset, (offsets, thresholds).

    Both axes are LEVELS_DB: an offset of -40 dB is a speaker that needs 40 dB less drive than full
    scale at 250 Hz.
    """
    nominal_db = float(drive_threshold_db(np.array([frequency_hz]))[0])
    deviation = (LEVELS_DB[None, :] - nominal_db - LEVELS_DB[:, None]) / DEVIATION_DB
    # The floor keeps every threshold possible. Under the bare normal law a hand that differs by
    # 40 dB at one frequency would be ruled out before it was asked, and its answers ignored.
    prior = np.exp(-0.5 * deviation**2) + 1e-4
    return np.asarray(prior / prior.sum(axis=1, keepdims=True))


# These tables depend on no answer, so they are computed once.
_GUESS_COLUMN = np.array(GUESS_RATES)[:, None]
# (answers, guess rates, level tried, threshold)
_ANSWER_CHANCES = np.stack(
    answer_chances(LEVELS_DB[None, :, None], LEVELS_DB[None, None, :], _GUESS_COLUMN[:, :, None])
)
_ANSWER_ENTROPIES = _entropy(_ANSWER_CHANCES)
_PRIORS = np.stack([_prior(frequency_hz) for frequency_hz in FREQUENCIES_HZ])
