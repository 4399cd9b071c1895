"""From patterns to what the machine observer takes from them: presented, sensed, kept. Pure.

Vibration is counted in Weber steps by channels.py. Of a plate it takes which way, how fast and how
far: early rate and end temperature, with their sign, on a scale that is even up to a floor and
logarithmic beyond it. One step is WEBER of the rate at which heat is extracted, which decides more
than the end temperature does (Bergmann Tiest and Kappers 2009); the temperature gets the same step
because people told 3 from 6 degC of a thermal icon in 73 % of cases only (Wilson, Brewster), which
0.2 degC of noise would make certain. The sign needs no feature of its own: it is theirs.
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

RENDERINGS = tuple(range(1, 7))  # seeds; a study's pattern is rendered anew each time
WEBER = 0.43
EARLY_S = 0.5  # s from the plate's start, about a cold reaction time (docs/physics.md 1.3)
RATE_FLOOR_C_PER_S = 0.1  # below it thresholds rise steeply (physics.md 1.3)
_KEPT = 4096
_LEAST_NOISE = 1e-6  # Weber steps: none at all, yet no unit to divide by
_Floats = NDArray[np.float64]
_STROKES = ("speed_mps", "force_n", "seconds", "repeats")


@dataclass(frozen=True, slots=True)
class Percepts:
    """What a set of patterns does to the observer: (patterns, renderings, features), in steps."""

    names: tuple[str, ...]
    steps: _Floats

    def only(self, columns: slice | list[int]) -> Percepts:
        """Return some features only."""
        return Percepts(self.names, self.steps[:, :, columns])

    @property
    def templates(self) -> _Floats:
        """Each pattern as the observer remembers it, (patterns, features)."""
        return np.asarray(self.steps.mean(axis=1))


@dataclass(frozen=True, slots=True)
class Noise:
    """Standard deviation of what is felt, in Weber steps of vibration and of heat."""

    touch: float
    heat: float

    def scaled(self, by: float) -> Noise:
        """Return so many times the noise."""
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
    """Present every pattern once per seed; the steps of FEATURES, (patterns, seeds, features)."""
    rows = [[_steps(stimulus, seed) for seed in seeds] for stimulus in stimuli]
    return Percepts(tuple(stimulus.name for stimulus in stimuli), np.array(rows))


def touch(stimulus: Stimulus, seed: int) -> NDArray[np.float64]:
    """Return the steps of the vibration alone, (TOUCH,), which neither name nor heat changes."""
    same = Stimulus("any", "any", "any", stimulus.material, stimulus.interaction, NEUTRAL_C)
    strokes = {name: getattr(stimulus, name) for name in _STROKES}
    return _touch(dataclasses.replace(same, **strokes), seed)


def weighed(features: Percepts, noise: Noise) -> Percepts:
    """Convert features to units of their noise, so that each has a noise of 1."""
    units = np.empty(len(FEATURES))
    units[TOUCH], units[HEAT] = noise.touch, noise.heat
    units = np.maximum(units, _LEAST_NOISE)
    return Percepts(features.names, features.steps / units)


def palm_c(stimulus: Stimulus) -> tuple[float, float]:
    """Skin on the simulated plate as the first stroke begins and as the last ends, degC."""
    skin_c = _skin_c(stimulus)
    return float(skin_c[presented.lead_steps(stimulus)]), float(skin_c[-1])


def _steps(stimulus: Stimulus, seed: int) -> NDArray[np.float64]:
    return np.concatenate((touch(stimulus, seed), _heat(stimulus)))


@lru_cache(maxsize=_KEPT)
def _touch(stimulus: Stimulus, seed: int) -> NDArray[np.float64]:
    return vibration_steps(presented.wave(stimulus, seed), RATE_HZ)


def _heat(stimulus: Stimulus) -> NDArray[np.float64]:
    return warmth_steps(_skin_c(stimulus), presented.STEP_S)


@lru_cache(maxsize=_KEPT)
def _skin_c(stimulus: Stimulus) -> NDArray[np.float64]:
    return presented.skin_c(stimulus)


def warmth_steps(skin_c: NDArray[np.float64], step_s: float) -> NDArray[np.float64]:
    """Early rate and end temperature in Weber steps, (2,), of skin (n,) sampled every `step_s`.

    The first sample is the skin at rest; negative is colder.
    """
    early = min(max(round(EARLY_S / step_s), 1), skin_c.size - 1)
    rate = (skin_c[early] - skin_c[0]) / (early * step_s)
    change_c = skin_c[-1] - skin_c[0]
    return np.array(
        [_weber_steps(rate / RATE_FLOOR_C_PER_S), _weber_steps(change_c / THERMAL_FLOOR_C)]
    )


def _weber_steps(floors: float) -> float:
    """Return the signed number of Weber steps in so many floors."""
    return math.copysign(math.log1p(abs(floors)) / math.log1p(WEBER), floors)
