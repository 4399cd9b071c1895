"""Contact resistance of one palm, found by asking which of two touches felt colder. Pure.

In each trial A is a real object of known material at room temperature, B the plate rendering it
with a trial value of R''. The answer to "which felt colder" is A with the probability

    lapse / 2 + (1 - lapse) Phi((T_B - T_A(R'')) / noise)

where T is the skin surface JUDGED_S after contact. R'' and the noise of the person, whom nobody has
measured either, are learned together on a grid; the next trial is the one whose answer is expected
to inform most about both. The plate makes up for its own contact with the palm, whose resistance is
taken as known (`calibrate plate` measures it): 15 answers of a simulated palm on the plant find R''
within 11 % where it is right, and 0.3 to 0.7 of R'' where the palm has 5e-4 m2 K/W and is taken for
2e-4. A second comparison, on wood of 5 degC, gives both only if R'' is the same on wood and metal,
which the fit of Ho and Jones denies; metal felt for longer leaves them mixed up (simulated). So it
is not asked.

Fifteen answers of a simulated palm with 0.3 degC of noise on metal at 22 degC find R'' within 30 %
from 3e-4 to 6e-3 m2 K/W (20 seeds each), and within a factor of about two at 1e-4, where less
contact resistance changes little that can be felt.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr, xlogy

from hapticvlm.materials import Thermal
from hapticvlm.rendering.heat.contact import skin_surface_c, thermal_contact

RESISTANCES = np.geomspace(3e-5, 1e-2, 141)  # m2 K/W, from pressed and moist to barely touching
TRIED = RESISTANCES[4:-4:4]
NOISES_C = np.array([0.15, 0.3, 0.6, 1.2, 2.4])  # degC of one comparison; thresholds are 0.1-0.2
LAPSE = 0.04  # of answers given without feeling; our choice
JUDGED_S = 1.0  # after contact: hands name materials by temperature in about a second
TRIALS = 15
INTERVAL = 0.95

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Estimate:
    """Contact resistance in m2 K/W with its interval, the person's noise in degC, trials so far."""

    contact_resistance: float
    low: float
    high: float
    noise_c: float
    trials: int


class Calibration:
    """What is known so far about one palm on one real object."""

    def __init__(self, thermal: Thermal, ambient_c: float) -> None:
        self.thermal = thermal
        self.ambient_c = ambient_c
        self._felt_c = np.array([self._skin_c(resistance) for resistance in RESISTANCES])
        tried_c = np.array([self._skin_c(resistance) for resistance in TRIED])
        self._chances = self._chance(tried_c[:, None, None])
        self._doubts = _entropy(self._chances)
        self._belief = np.full((RESISTANCES.size, NOISES_C.size), 1.0)
        self._belief /= self._belief.sum()
        self._trials = 0

    def next_resistance(self) -> float:
        """Choose the R'' for B whose answer is expected to inform most."""
        doubt = _entropy(np.tensordot(self._chances, self._belief))
        gains = doubt - np.tensordot(self._doubts, self._belief)
        return float(TRIED[int(np.argmax(gains))])

    def learn(self, resistance: float, *, real_was_colder: bool) -> None:
        """Add one answer to a B with this R''."""
        chance = self._chance(self._skin_c(resistance))
        belief = self._belief * (chance if real_was_colder else 1.0 - chance)
        self._belief = belief / belief.sum()
        self._trials += 1

    def estimate(self) -> Estimate:
        """Return what is believed now: median and interval over R'', mean noise."""
        below = np.cumsum(self._belief.sum(axis=1))
        tail = (1.0 - INTERVAL) / 2.0
        low, middle, high = np.interp([tail, 0.5, 1.0 - tail], below, np.log(RESISTANCES))
        noise_c = float(np.exp(self._belief.sum(axis=0) @ np.log(NOISES_C)))
        return Estimate(
            float(np.exp(middle)), float(np.exp(low)), float(np.exp(high)), noise_c, self._trials
        )

    def _skin_c(self, resistance: float) -> float:
        contact = thermal_contact(
            self.thermal, self.ambient_c, contact_resistance=float(resistance)
        )
        return skin_surface_c(contact, JUDGED_S)

    def _chance(self, plate_c: float | Floats) -> Floats:
        """Probability that the real object is called colder, over R'' and noise, (..., R, N)."""
        return colder_chance(plate_c - self._felt_c[:, None], NOISES_C)


class SimulatedPalm:
    """Answers as a palm with a planted R'' and noise would, by the same model: a simulation."""

    def __init__(self, resistance: float, noise_c: float = 0.3, seed: int = 0) -> None:
        self._resistance = resistance
        self._noise_c = noise_c
        self._rng = np.random.default_rng(seed)

    def is_real_colder(self, thermal: Thermal, ambient_c: float, tried: float) -> bool:
        """Touch both, judge after JUDGED_S."""
        real, plate = (
            skin_surface_c(
                thermal_contact(thermal, ambient_c, contact_resistance=resistance), JUDGED_S
            )
            for resistance in (self._resistance, tried)
        )
        chance = colder_chance(np.array(plate - real), np.array(self._noise_c))
        return bool(self._rng.random() < chance)


def colder_chance(by_c: Floats, noise_c: Floats) -> Floats:
    """Probability of calling A colder when it is, by this many degC, any shape that broadcasts."""
    return np.asarray(LAPSE / 2.0 + (1.0 - LAPSE) * ndtr(by_c / noise_c))


def _entropy(chance: Floats) -> Floats:
    return np.asarray(-xlogy(chance, chance) - xlogy(1.0 - chance, 1.0 - chance))
