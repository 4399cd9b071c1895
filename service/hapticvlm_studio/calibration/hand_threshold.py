"""The weakest vibration that a hand feels on its speaker, at four frequencies, by asking. Pure.

A trial is two moments of half a second; one of them vibrates, and the person says which, or that
neither was felt. It is felt with the probability

    lapse / 2 + (1 - lapse) Phi((level - threshold) / spread)

where `level` is the drive in dB of full scale and `threshold` is what is looked for. What is not
felt is guessed at with a probability that differs from person to person and is learned with the
rest: who always guesses is right half the time, who never does says that neither was felt. So
nobody gets a lower threshold by saying yes, as where one is only asked whether it vibrated. The
next level is the one whose answer is expected to inform most.

Speaker and hand are measured together: a drive that is not felt may be a speaker that hardly moves
or a hand that hardly feels, and what is needed is the same. So no accelerometer is needed, and the
result is a curve like that of `calibrate speaker`: how much more or less this pair gives than the
nominal one of `perception.drive_threshold_db`, levelled at 250 Hz.

Forty-eight answers of a simulated hand whose thresholds lie 8 dB (standard deviation) from what one
offset explains find each within 1.2 dB if it never guesses, 1.8 dB if it guesses half the time, and
2.8 dB if always (mean error, 60 seeds); the intervals hold 94 to 97 times of 100.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr, xlogy

from hapticvlm.devices.speaker.speaker_files import SpeakerResponse
from hapticvlm.perception import drive_threshold_db
from hapticvlm.rendering.vibration.vibration import RATE_HZ

FREQUENCIES_HZ = (40.0, 100.0, 250.0, 500.0)
TRIALS = 12  # at each frequency: three minutes for all four
LEVELS_DB = np.arange(-90.0, -5.0, 1.0)  # of full scale; half of it is the most that is played
APART_DB = 8.0  # of speakers and hands at one frequency beside the others; our choice
SPREAD_DB = 3.0  # of one comparison; our choice, as steep as 2AFC detection is usually found
GUESSES = (0.1, 0.5, 0.9)  # how often a person guesses rather than says that nothing was felt
LAPSE = 0.04  # of answers given without feeling; our choice
INTERVAL = 0.95
# What a rehearsal plants: a speaker weak at 40 Hz under a hand that feels 500 Hz well.
REHEARSED_DB = (-33.0, -44.0, -45.0, -28.0)
MOMENT_S = 0.5
GAP_S = 0.4
RAMP_S = 0.05  # so that no click gives the tone away

Answer = Literal["right", "wrong", "neither"]
ANSWERS: tuple[Answer, ...] = ("right", "wrong", "neither")
Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Estimate:
    """A threshold in dB of full scale with its interval, and the trials behind it."""

    frequency_hz: float
    threshold_db: float
    low_db: float
    high_db: float
    trials: int


class Hand:
    """What is known so far about one hand on one speaker.

    How strong a speaker is at all shifts its four thresholds together, so an answer at one
    frequency tells something of the others. Each threshold is the nominal one plus an offset that
    all share, and a deviation of its own of about APART_DB. Given the offset the four are
    independent: what three say about the fourth is a product of three sums, and no grid of five
    dimensions is needed.
    """

    def __init__(self) -> None:
        self._likelihoods = np.ones((len(GUESSES), len(FREQUENCIES_HZ), LEVELS_DB.size))
        self._trials = [0] * len(FREQUENCIES_HZ)

    def next_level_db(self, which: int) -> float:
        """Choose the level, at the frequency of this number, whose answer should inform most."""
        belief = self._belief(which)
        # (answer, level): what is expected of each, and how sure one would be knowing all
        expected = np.einsum("agts,gs->at", _CHANCES, belief)
        known = np.einsum("gts,gs->t", _DOUBTS, belief)
        return float(LEVELS_DB[int(np.argmax(_entropy(expected) - known))])

    def learn(self, which: int, level_db: float, answer: Answer) -> None:
        """Add one answer."""
        chances = answer_chances(level_db, LEVELS_DB[None, :], _GUESSES)[ANSWERS.index(answer)]
        self._likelihoods[:, which] *= chances
        self._trials[which] += 1

    def estimates(self) -> list[Estimate]:
        """Return the median of what is believed of each threshold, and the interval."""
        tail = (1.0 - INTERVAL) / 2.0
        found = []
        for which, hertz in enumerate(FREQUENCIES_HZ):
            below = np.cumsum(self._belief(which).sum(axis=0))
            low, middle, high = np.interp([tail, 0.5, 1.0 - tail], below, LEVELS_DB)
            trials = self._trials[which]
            found.append(Estimate(hertz, float(middle), float(low), float(high), trials))
        return found

    def _belief(self, which: int) -> Floats:
        """Return the probability of each guess and threshold at a frequency, (guesses, levels)."""
        said = np.einsum("fos,gfs->gfo", _PRIORS, self._likelihoods)
        others = np.prod(np.delete(said, which, axis=1), axis=1)  # (guesses, offsets)
        belief = (others @ _PRIORS[which]) * self._likelihoods[:, which]
        return np.asarray(belief / belief.sum())


def answer_chances(
    level_db: float | Floats, threshold_db: float | Floats, guesses: float | Floats
) -> tuple[Floats, Floats, Floats]:
    """Probability of each of ANSWERS, any shapes that broadcast."""
    by_db = np.asarray(level_db) - np.asarray(threshold_db)
    felt = LAPSE / 2.0 + (1.0 - LAPSE) * ndtr(by_db / SPREAD_DB)
    guessed = (1.0 - felt) * guesses
    return felt + guessed / 2.0, guessed / 2.0, np.asarray(1.0 - felt - guessed)


def course(trials: int, seed: int) -> list[tuple[int, bool]]:
    """Return each trial's frequency, as its number, and whether the first moment vibrates.

    Every round asks all frequencies once in an order of its own, so that no run of one tires skin.
    """
    rng = np.random.default_rng(seed)
    return [
        (int(which), bool(rng.random() < 0.5))
        for _ in range(trials)
        for which in rng.permutation(len(FREQUENCIES_HZ))
    ]


def moments(frequency_hz: float, level_db: float, *, is_first: bool) -> NDArray[np.float32]:
    """Make the two moments with the gap between them, (N,) float32 at RATE_HZ."""
    time_s = np.arange(int(MOMENT_S * RATE_HZ)) / RATE_HZ
    edge = np.minimum(time_s, MOMENT_S - time_s) / RAMP_S
    ramp = 0.5 - 0.5 * np.cos(np.pi * np.clip(edge, 0.0, 1.0))
    tone = 10.0 ** (level_db / 20.0) * ramp * np.sin(2.0 * math.pi * frequency_hz * time_s)
    gap = np.zeros(int(GAP_S * RATE_HZ))
    parts = (tone, gap, 0.0 * tone) if is_first else (0.0 * tone, gap, tone)
    return np.concatenate(parts).astype(np.float32)


def as_response(found: Sequence[Estimate], *, simulated: bool) -> SpeakerResponse:
    """Return what speaker and hand give together, as the curve that a service corrects."""
    hertz = np.array([one.frequency_hz for one in found])
    given_db = drive_threshold_db(hertz) - np.array([one.threshold_db for one in found])
    given_db -= np.interp(math.log(250.0), np.log(hertz), given_db)
    return SpeakerResponse(tuple(hertz.tolist()), tuple(given_db.tolist()), simulated)


class SimulatedHand:
    """Answers as a hand with planted thresholds would, by the same model: a simulation."""

    def __init__(self, thresholds_db: Sequence[float], guesses: float = 0.5, seed: int = 0) -> None:
        self._thresholds_db = tuple(thresholds_db)
        self._guesses = guesses
        self._rng = np.random.default_rng(seed)

    def answer(self, which: int, level_db: float) -> Answer:
        """Feel both moments at the frequency of this number."""
        chances = answer_chances(level_db, self._thresholds_db[which], self._guesses)
        return ANSWERS[int(self._rng.choice(3, p=[float(chance) for chance in chances]))]


def _entropy(chances: Floats) -> Floats:
    """Return the entropy over the answers, which are the first axis."""
    return np.asarray(-xlogy(chances, chances).sum(axis=0))


def _prior(hertz: float) -> Floats:
    """Return the probability of each threshold at each offset, (offsets, levels)."""
    nominal_db = float(drive_threshold_db(np.array([hertz]))[0])
    apart = (LEVELS_DB[None, :] - nominal_db - LEVELS_DB[:, None]) / APART_DB
    found = np.exp(-0.5 * apart**2) + 1e-4  # nobody is so unlike all others that no answer counts
    return np.asarray(found / found.sum(axis=1, keepdims=True))


_GUESSES = np.array(GUESSES)[:, None]
# (answer, guesses, level tried, threshold)
_CHANCES = np.stack(
    answer_chances(LEVELS_DB[None, :, None], LEVELS_DB[None, None, :], _GUESSES[:, :, None])
)
_DOUBTS = _entropy(_CHANCES)
_PRIORS = np.stack([_prior(hertz) for hertz in FREQUENCIES_HZ])
