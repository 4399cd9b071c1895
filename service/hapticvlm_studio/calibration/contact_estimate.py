"""Estimates the contact resistance of one palm from which of two touches felt colder. Pure.

In each trial the palm touches A, a real object of known material at room temperature, and B, the
plate that renders the same object with a trial value of the contact resistance R'' (m2 K/W,
physics.md 1.1). The larger R'' is, the slower the skin cools. The person calls A colder with the
probability

    p(A colder) = lapse / 2 + (1 - lapse) Phi((T_B(trial) - T_A(palm)) / noise)

where T is the temperature of the skin surface JUDGED_S after contact, Phi the normal distribution
function, `noise` the standard deviation in degC of one comparison, and `lapse` the share of answers
given without attention. This is signal detection: each touch evokes a temperature plus Gaussian
noise, and the person compares the two. The answers are evenly divided where both touches cool the
skin alike, which is where the trial value equals the R'' of the palm. This point of subjective
equality is the point that the procedure converges to, and it does not depend on the noise; the
noise sets only how steep the transition around it is.

Nobody has measured the noise of this person either, so R'' and noise are estimated together: a
probability for each combination on a grid is multiplied by the formula after each answer. The next
trial value is the one whose answer has the greatest expected information about both. A staircase
with fixed steps converges to the same point, but it needs more answers and gives no interval.

The plate compensates its own contact with the palm, whose resistance is taken as known
(`calibrate plate` measures it). Fifteen answers of a simulated palm on the plant give R'' within
11 % where that value is right, and 0.3 to 0.7 of R'' where the palm has 5e-4 m2 K/W and is assumed
to have 2e-4. A second comparison, on wood of 5 degC, would give both only if R'' were the same on
wood and metal, which the fit of Ho and Jones contradicts; a longer touch of metal leaves the two
confounded (simulated). So no second comparison is made.

Fifteen answers of a simulated palm with 0.3 degC of noise on metal at 22 degC give R'' within 30 %
from 3e-4 to 6e-3 m2 K/W (20 seeds each), and within a factor of about two at 1e-4, where a smaller
contact resistance hardly changes the temperature of the skin. No person has been measured.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr, xlogy

from hapticvlm.materials import Thermal
from hapticvlm.rendering.heat.contact import skin_surface_c, thermal_contact

# m2 K/W, from pressed and moist to barely touching. Even steps of the logarithm, since what is
# felt depends on the ratio of R'' to the effusivities, and the prior is flat on this grid.
RESISTANCES = np.geomspace(3e-5, 1e-2, 141)
TRIAL_RESISTANCES = RESISTANCES[4:-4:4]
NOISES_C = np.array([0.15, 0.3, 0.6, 1.2, 2.4])  # degC of one comparison; thresholds are 0.1-0.2
LAPSE = 0.04  # our choice
JUDGED_S = 1.0  # after contact: hands name materials by temperature in about a second
TRIALS = 15
INTERVAL = 0.95

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Estimate:
    """Contact resistance in m2 K/W with its 95 % interval, noise in degC, number of trials."""

    contact_resistance: float
    low: float
    high: float
    noise_c: float
    trials: int


class ContactEstimator:
    """Probabilities of R'' and noise of one palm on one real object, given its answers so far."""

    def __init__(self, thermal: Thermal, ambient_c: float) -> None:
        """Begin with no answer. The object of this material is at `ambient_c`, degC."""
        self.thermal = thermal
        self.ambient_c = ambient_c
        self._real_c = np.array([self._skin_c(resistance) for resistance in RESISTANCES])
        trial_c = np.array([self._skin_c(resistance) for resistance in TRIAL_RESISTANCES])
        self._chances = self._chance(trial_c[:, None, None])  # (trial values, R'', noises)
        self._entropies = _entropy(self._chances)
        self._posterior = np.full((RESISTANCES.size, NOISES_C.size), 1.0)
        self._posterior /= self._posterior.sum()
        self._trials = 0

    def next_resistance(self) -> float:
        """Return the most informative R'' for B, m2 K/W."""
        # The expected information of a trial is the entropy of its predicted answer, less the
        # entropy that would remain if R'' and noise were known. Far from the palm's R'' the answer
        # is certain beforehand, and where the touches are alike whatever R'' is, it stays a coin
        # toss: neither teaches anything. The difference is greatest where the values of R'' that
        # are still plausible disagree about the answer.
        predicted = _entropy(np.tensordot(self._chances, self._posterior))
        remaining = np.tensordot(self._entropies, self._posterior)
        return float(TRIAL_RESISTANCES[int(np.argmax(predicted - remaining))])

    def learn(self, resistance: float, *, real_was_colder: bool) -> None:
        """Take one answer into account, to a B rendered with this R''."""
        chance = self._chance(self._skin_c(resistance))
        posterior = self._posterior * (chance if real_was_colder else 1.0 - chance)
        self._posterior = posterior / posterior.sum()
        self._trials += 1

    def estimate(self) -> Estimate:
        """Return the posterior median and 95 % interval of R'', and the geometric mean noise."""
        cumulative = np.cumsum(self._posterior.sum(axis=1))
        tail = (1.0 - INTERVAL) / 2.0
        quantiles = np.interp([tail, 0.5, 1.0 - tail], cumulative, np.log(RESISTANCES))
        low, median, high = (float(np.exp(quantile)) for quantile in quantiles)
        noise_c = float(np.exp(self._posterior.sum(axis=0) @ np.log(NOISES_C)))
        return Estimate(median, low, high, noise_c, self._trials)

    def _skin_c(self, resistance: float) -> float:
        contact = thermal_contact(
            self.thermal, self.ambient_c, contact_resistance=float(resistance)
        )
        return skin_surface_c(contact, JUDGED_S)

    def _chance(self, plate_c: float | Floats) -> Floats:
        """Return the probability that A is called colder, (..., RESISTANCES, NOISES_C)."""
        return colder_chance(plate_c - self._real_c[:, None], NOISES_C)


class SimulatedPalm:
    """Answers by the same formula with a planted R'' and noise: a simulation, not a person."""

    def __init__(self, resistance: float, noise_c: float = 0.3, seed: int = 0) -> None:
        self._resistance = resistance
        self._noise_c = noise_c
        self._rng = np.random.default_rng(seed)

    def is_real_colder(self, thermal: Thermal, ambient_c: float, trial_resistance: float) -> bool:
        """Return a random answer to A at `ambient_c` and B with this R''."""
        real_c, plate_c = (
            skin_surface_c(
                thermal_contact(thermal, ambient_c, contact_resistance=resistance), JUDGED_S
            )
            for resistance in (self._resistance, trial_resistance)
        )
        chance = colder_chance(np.array(plate_c - real_c), np.array(self._noise_c))
        return bool(self._rng.random() < chance)


def colder_chance(difference_c: Floats, noise_c: Floats) -> Floats:
    """Return the probability of calling A colder when it is, by T_B - T_A in degC (broadcasts)."""
    return np.asarray(LAPSE / 2.0 + (1.0 - LAPSE) * ndtr(difference_c / noise_c))


def _entropy(chance: Floats) -> Floats:
    """Return the entropy in nats of an answer that is one of two, for each probability."""
    return np.asarray(-xlogy(chance, chance) - xlogy(1.0 - chance, 1.0 - chance))
