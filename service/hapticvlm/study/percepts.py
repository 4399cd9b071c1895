"""From patterns to what the machine observer takes from them: presented, sensed, kept."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from hapticvlm.rendering.vibration import RATE_HZ
from hapticvlm.study import presented
from hapticvlm.study.channels import CHANNELS, WINDOWS_S, vibration_steps
from hapticvlm.study.observer import Percepts
from hapticvlm.study.stimuli import Stimulus
from hapticvlm.study.warmth import warmth_steps

RENDERINGS = tuple(range(1, 7))  # seeds; a study's pattern is rendered anew each time
_KEPT = 4096


def _windows() -> tuple[str, ...]:
    ms = [f"{1000 * begin:.0f}-{1000 * end:.0f} ms" for begin, end in WINDOWS_S[:-1]]
    return (*ms, f"from {1000 * WINDOWS_S[-1][0]:.0f} ms")


FEATURES = (
    *(f"{channel}, {window}" for channel in CHANNELS for window in _windows()),
    "early rate",
    "end temperature",
)
TOUCH, HEAT = slice(0, len(FEATURES) - 2), slice(len(FEATURES) - 2, len(FEATURES))


def percepts(stimuli: Sequence[Stimulus], seeds: Sequence[int] = RENDERINGS) -> Percepts:
    """Present every pattern once per seed; the steps of FEATURES, (patterns, seeds, features)."""
    rows = [[_steps(stimulus, seed) for seed in seeds] for stimulus in stimuli]
    return Percepts(tuple(stimulus.name for stimulus in stimuli), np.array(rows))


def touch(stimulus: Stimulus, seed: int) -> NDArray[np.float64]:
    """Return the steps of the vibration alone, (TOUCH,), which neither name nor heat changes."""
    same = {"name": "any", "vibration": "any", "temperature": "any", "setpoint_c": 32.0}
    return _touch(dataclasses.replace(stimulus, **same), seed)  # type: ignore[arg-type]


def _steps(stimulus: Stimulus, seed: int) -> NDArray[np.float64]:
    return np.concatenate((touch(stimulus, seed), _heat(stimulus)))


@lru_cache(maxsize=_KEPT)
def _touch(stimulus: Stimulus, seed: int) -> NDArray[np.float64]:
    return vibration_steps(presented.wave(stimulus, seed), RATE_HZ)


@lru_cache(maxsize=_KEPT)
def _heat(stimulus: Stimulus) -> NDArray[np.float64]:
    return warmth_steps(presented.skin_c(stimulus), presented.STEP_S)
