"""The machine observer: which pattern it takes each for. A model of thresholds, never a person.

It knows each pattern as the mean of its renderings, feels one rendering at a time through equal,
independent Gaussian noise on every feature, and answers the pattern most likely to have caused
that: with equal noise, the nearest. Features are in Weber steps (channels.py, warmth.py), so the
free numbers are noises in Weber steps. Everything is seeded; equal arguments, equal answers.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

_Floats = NDArray[np.float64]
_Counts = NDArray[np.int64]

TRIALS = 4000  # of each pattern: 0.13 % of standard error over ten patterns near 85 %
_NOISE_RANGE = (1e-3, 1e3)
_HALVINGS = 16  # within 0.02 % of noise
_TIE = 1e-9


@dataclass(frozen=True, slots=True)
class Percepts:
    """What a set of patterns does to the observer: (patterns, renderings, features), in steps."""

    names: tuple[str, ...]
    steps: _Floats

    def only(self, columns: slice | list[int]) -> Percepts:
        """Keep some features."""
        return Percepts(self.names, self.steps[:, :, columns])

    @property
    def templates(self) -> _Floats:
        """Each pattern as the observer remembers it, (patterns, features)."""
        return np.asarray(self.steps.mean(axis=1))


def confusion(percepts: Percepts, noise: float, seed: int, trials: int = TRIALS) -> _Counts:
    """Count how often each pattern (rows) is taken for each (columns), (patterns, patterns)."""
    rng = np.random.default_rng(seed)
    templates = percepts.templates
    count = len(templates)
    counts = np.zeros((count, count), dtype=np.int64)
    for presented, renderings in enumerate(percepts.steps):
        chosen = renderings[rng.integers(len(renderings), size=trials)]
        felt = chosen + noise * rng.standard_normal(chosen.shape)
        counts[presented] = np.bincount(_nearest(felt, templates, rng), minlength=count)
    return counts


def recognised(counts: _Counts) -> float:
    """Share of trials answered rightly, 0..1."""
    return float(np.trace(counts) / counts.sum())


def calibrate(percepts: Percepts, target: float, seed: int, trials: int = TRIALS) -> float:
    """Noise in Weber steps at which a share `target` is recognised; bisection on equal draws.

    Raises ValueError when no noise does that.
    """

    def share(noise: float) -> float:
        return recognised(confusion(percepts, noise, seed, trials))

    return solve(share, target)


def solve(share: Callable[[float], float], target: float) -> float:
    """Find by bisection the noise at which a falling share of answers is `target`.

    Raises ValueError when no noise does that.
    """
    low, high = _NOISE_RANGE
    if not share(high) < target < share(low):
        raise ValueError(f"no noise makes this set recognised in {target:.1%} of cases")
    for _ in range(_HALVINGS):
        middle = math.sqrt(low * high)
        low, high = (middle, high) if share(middle) > target else (low, middle)
    return math.sqrt(low * high)


def distances(percepts: Percepts) -> _Floats:
    """Weber steps between the memories of every two patterns, (patterns, patterns)."""
    templates = percepts.templates
    apart = templates[:, None, :] - templates[None, :, :]
    return np.asarray(np.sqrt((apart**2).sum(axis=2)))


def _nearest(felt: _Floats, templates: _Floats, rng: np.random.Generator) -> NDArray[np.intp]:
    """Place of the nearest template for each (trials, features); ties fall by lot."""
    squares = (templates**2).sum(axis=1) - 2.0 * felt @ templates.T
    squares += _TIE * (1.0 + np.abs(squares).max()) * rng.random(squares.shape)
    return np.asarray(squares.argmin(axis=1))
