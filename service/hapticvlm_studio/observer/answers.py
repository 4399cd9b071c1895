"""The machine observer: which pattern it takes each for. A model of thresholds, never a person.

It knows each pattern as the mean of its renderings, feels one rendering at a time through equal,
independent Gaussian noise on every feature, and answers the pattern most likely to have caused
that: with equal noise, the nearest. Features are in Weber steps (channels.py, percepts.py), so the
free numbers are noises in Weber steps. Everything is seeded; equal arguments, equal answers.

`choose` searches for the strokes that it would confuse least. Every combination of candidates is
tried; the one in which the fewest pairs would be mistaken, each taken alone at NOISE, wins. Two
vibrations count as far apart as they are when the level of one is off by whatever up to
LEVEL_OFF_DB brings them nearest: no speaker has been measured, and what only differs in loudness
is lost with the next one. Seeds must be none of those reported.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr

from hapticvlm_studio.design.stimuli import Stimulus
from hapticvlm_studio.observer.channels import WEBER_DB, WINDOWS_S, louder_db
from hapticvlm_studio.observer.percepts import Percepts, touch

_Floats = NDArray[np.float64]
_Counts = NDArray[np.int64]

TRIALS = 4000  # of each pattern: 0.13 % of standard error over ten patterns near 85 %
_NOISE_RANGE = (1e-3, 1e3)
_HALVINGS = 16  # within 0.02 % of noise
_TIE = 1e-9

SEEDS = (1001, 1002)  # renderings compared, disjoint from percepts.RENDERINGS
NOISE = 2.0  # Weber steps, about what the paper's people had
LEVEL_OFF_DB = 6.0
LEAST_LEVEL_DB = 10.0  # above threshold somewhere, or no candidate; about half of the palm's range
_GAINS_DB = np.linspace(-LEVEL_OFF_DB, LEVEL_OFF_DB, 9)
_STEP_DB = np.repeat(WEBER_DB, len(WINDOWS_S))


def confusion(percepts: Percepts, noise: float, seed: int, trials: int = TRIALS) -> _Counts:
    """Count how often each pattern (rows) is taken for each (columns), (patterns, patterns)."""
    rng = np.random.default_rng(seed)
    templates = percepts.templates
    count = len(templates)
    counts = np.zeros((count, count), dtype=np.int64)
    for presented, renderings in enumerate(percepts.steps):
        chosen = renderings[rng.integers(len(renderings), size=trials)]
        observed = chosen + noise * rng.standard_normal(chosen.shape)
        counts[presented] = np.bincount(_nearest(observed, templates, rng), minlength=count)
    return counts


def recognised(counts: _Counts) -> float:
    """Share of trials answered rightly, 0..1."""
    return float(np.trace(counts) / counts.sum())


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


def _nearest(observed: _Floats, templates: _Floats, rng: np.random.Generator) -> NDArray[np.intp]:
    """Place of the nearest template for each (trials, features); ties fall by lot."""
    squares = (templates**2).sum(axis=1) - 2.0 * observed @ templates.T
    squares += _TIE * (1.0 + np.abs(squares).max()) * rng.random(squares.shape)
    return np.asarray(squares.argmin(axis=1))


def choose(candidates: Sequence[Sequence[Stimulus]]) -> tuple[tuple[Stimulus, ...], float]:
    """Pick one candidate of each row; return them and the nearest two's distance in Weber steps.

    A row of one candidate is kept as it is. Every combination is tried.
    """
    rows = [_well_perceived(row) for row in candidates]
    levels = [np.array([level for _, level in row]) for row in rows]
    errors = np.zeros([len(row) for row in rows])
    for i, j in itertools.combinations(range(len(rows)), 2):
        mistaken = ndtr(apart(levels[i], levels[j]) / (-2.0 * NOISE))
        place = [1] * len(rows)
        place[i], place[j] = mistaken.shape
        errors = errors + mistaken.reshape(place)
    best = np.unravel_index(errors.argmin(), errors.shape)
    picked = np.array([level[at] for level, at in zip(levels, best, strict=True)])
    nearest = apart(picked, picked)[~np.eye(len(rows), dtype=bool)].min()
    return tuple(row[at][0] for row, at in zip(rows, best, strict=True)), float(nearest)


def apart(first: _Floats, second: _Floats) -> _Floats:
    """Weber steps between levels (n, features) and (m, features), as above, (n, m)."""
    return np.minimum(_nearest_level(first, second), _nearest_level(second, first).T)


def _nearest_level(moved: _Floats, fixed: _Floats) -> _Floats:
    louder = louder_db(moved[:, None, :], _GAINS_DB[:, None])
    between = (louder[:, None, :, :] - fixed[None, :, None, :]) / _STEP_DB
    return np.asarray(np.sqrt((between**2).sum(axis=3)).min(axis=2))


def _well_perceived(row: Sequence[Stimulus]) -> list[tuple[Stimulus, _Floats]]:
    """Levels of those candidates that are perceived well; of all where none is."""
    found = [(stimulus, _levels(stimulus)) for stimulus in row]
    return [pair for pair in found if pair[1].max() >= LEAST_LEVEL_DB] or found


def _levels(stimulus: Stimulus) -> _Floats:
    steps = np.mean([touch(stimulus, seed) for seed in SEEDS], axis=0)
    return np.asarray(steps * _STEP_DB)
