"""Reduces patterns to the features that the machine observer compares. Pure; a model, not a person.

Vibration gives the levels of `channels`, in Weber steps. Heat gives two features: the early rate of
change of the skin's temperature in degC/s, and its change at the end in degC, both with their sign
(negative is colder). A value x becomes the number n of steps that lead to it from a floor x0,

    (1 + WEBER)^n = 1 + |x| / x0        n = sign(x) ln(1 + |x| / x0) / ln(1 + WEBER)

so steps are even up to the floor, where thresholds are absolute, and proportional beyond it, where
Weber's law holds.

WEBER is the Weber fraction of the rate at which heat is extracted, which decides more than the end
temperature does (Bergmann Tiest and Kappers 2009, physics.md 1.3). The end temperature gets the
same step: people distinguished 3 from 6 degC of a thermal icon in only 73 % of cases (Wilson,
Brewster), which a noise of 0.2 degC on an even scale would have made certain.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from hapticvlm.perception import NEUTRAL_C, THERMAL_FLOOR_C
from hapticvlm.rendering.vibration.vibration import RATE_HZ
from hapticvlm_studio.design.stimuli import Stimulus
from hapticvlm_studio.observer import presented
from hapticvlm_studio.observer.channels import CHANNELS, WINDOWS_S, vibration_steps

RENDERINGS = tuple(range(1, 7))  # seeds; a study renders a pattern again for every trial
WEBER = 0.43
EARLY_S = 0.5  # s from the plate's start, about a cold reaction time (docs/physics.md 1.3)
RATE_FLOOR_C_PER_S = 0.1  # below it thresholds rise steeply (physics.md 1.3)
_CACHE_SIZE = 4096
_MIN_NOISE = 1e-6  # Weber steps: no noise at all, but a number that can be divided by
_Floats = NDArray[np.float64]
_STROKES = ("speed_mps", "force_n", "seconds", "repeats")


@dataclass(frozen=True, slots=True)
class Percepts:
    """Features of a set of patterns; `steps` is (patterns, renderings, features) in Weber steps."""

    names: tuple[str, ...]
    steps: _Floats

    def only(self, columns: slice | list[int]) -> Percepts:
        """Return the same patterns with some features only."""
        return Percepts(self.names, self.steps[:, :, columns])

    @property
    def templates(self) -> _Floats:
        """The memory of the observer: each pattern's mean rendering, (patterns, features)."""
        return np.asarray(self.steps.mean(axis=1))


@dataclass(frozen=True, slots=True)
class Noise:
    """Standard deviations of the observer's noise, in Weber steps: vibration and heat."""

    touch: float
    heat: float

    def scaled(self, by: float) -> Noise:
        """Return both noises multiplied by `by`."""
        return Noise(by * self.touch, by * self.heat)


def _windows() -> tuple[str, ...]:
    ms = [f"{1000 * begin:.0f}-{1000 * end:.0f} ms" for begin, end in WINDOWS_S[:-1]]
    return (*ms, f"from {1000 * WINDOWS_S[-1][0]:.0f} ms")


FEATURES = (
    *(f"{channel}, {window}" for channel in CHANNELS for window in _windows()),
    "early rate",
    "end temperature",
)
TOUCH = slice(0, len(FEATURES) - 2)
HEAT = slice(len(FEATURES) - 2, len(FEATURES))


def percepts(stimuli: Sequence[Stimulus], seeds: Sequence[int] = RENDERINGS) -> Percepts:
    """Present every pattern once for each seed and return its features in Weber steps."""
    rows = [[_steps(stimulus, seed) for seed in seeds] for stimulus in stimuli]
    return Percepts(tuple(stimulus.name for stimulus in stimuli), np.array(rows))


def touch(stimulus: Stimulus, seed: int) -> NDArray[np.float64]:
    """Return the vibration's features alone in Weber steps, (TOUCH,)."""
    # Rendering takes most of the time, and neither names nor heat change the vibration: with those
    # replaced, the cache serves the hot and the cold pattern of one vibration.
    same = Stimulus("any", "any", "any", stimulus.material, stimulus.interaction, NEUTRAL_C)
    strokes = {name: getattr(stimulus, name) for name in _STROKES}
    return _touch(dataclasses.replace(same, **strokes), seed)


def weighed(features: Percepts, noise: Noise) -> Percepts:
    """Divide features by their noise, so that every feature has a noise of 1."""
    units = np.empty(len(FEATURES))
    units[TOUCH], units[HEAT] = noise.touch, noise.heat
    units = np.maximum(units, _MIN_NOISE)
    return Percepts(features.names, features.steps / units)


def palm_c(stimulus: Stimulus) -> tuple[float, float]:
    """Return the skin on the simulated plate as the first stroke begins and the last ends, degC."""
    skin_c = _skin_c(stimulus)
    return float(skin_c[presented.lead_steps(stimulus)]), float(skin_c[-1])


def _steps(stimulus: Stimulus, seed: int) -> NDArray[np.float64]:
    return np.concatenate((touch(stimulus, seed), _heat(stimulus)))


@lru_cache(maxsize=_CACHE_SIZE)
def _touch(stimulus: Stimulus, seed: int) -> NDArray[np.float64]:
    return vibration_steps(presented.wave(stimulus, seed), RATE_HZ)


def _heat(stimulus: Stimulus) -> NDArray[np.float64]:
    return warmth_steps(_skin_c(stimulus), presented.STEP_S)


@lru_cache(maxsize=_CACHE_SIZE)
def _skin_c(stimulus: Stimulus) -> NDArray[np.float64]:
    return presented.skin_c(stimulus)


def warmth_steps(skin_c: NDArray[np.float64], step_s: float) -> NDArray[np.float64]:
    """Return early rate and end temperature in Weber steps, (2,).

    `skin_c` is (n,) in degC, sampled every `step_s` seconds; its first sample is the skin at rest.
    """
    early = min(max(round(EARLY_S / step_s), 1), skin_c.size - 1)
    rate = (skin_c[early] - skin_c[0]) / (early * step_s)
    change_c = skin_c[-1] - skin_c[0]
    return np.array(
        [_weber_steps(rate / RATE_FLOOR_C_PER_S), _weber_steps(change_c / THERMAL_FLOOR_C)]
    )


def _weber_steps(floors: float) -> float:
    """Return the signed number of Weber steps of a value in units of its floor."""
    return math.copysign(math.log1p(abs(floors)) / math.log1p(WEBER), floors)
