"""Decides which pattern the machine observer takes each for. It is a model, not a person.

This is signal detection with many alternatives. The observer remembers each pattern as a template,
the mean of its renderings. A presentation gives it one rendering x plus independent Gaussian noise
of equal standard deviation s on every feature, and it answers the pattern that most likely caused
what it received:

    answer = argmax_k p(x + noise | template k) = argmin_k |x + noise - template k|^2

With equal noise, the most likely template is the nearest one. Two patterns whose templates are a
distance d apart would be mistaken for each other, if they were the only two, with the probability

    p(mistaken) = Phi(-d / (2 s)),      d' = d / s

since noise along the line between them has to exceed half of their distance. Features are in Weber
steps (`channels`, `percepts`), so s is in Weber steps too. It stands for everything that makes
people answer differently to equal stimuli; no bias towards an answer, no learning and no lapse is
modelled. All random numbers are seeded: equal arguments give equal answers.

`choose` searches for the strokes that are confused least. It tries every combination of candidates
and takes the one with the smallest sum of p(mistaken) over all pairs, at NOISE. The distance of two
vibrations is the least that they have when one is louder or softer by up to LEVEL_ERROR_DB: no
speaker has been measured, and patterns that differ by loudness alone would be confused on the next
one. The search uses other seeds than the reported predictions, so that a choice is not judged by
the renderings that it was made on.
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
_TIE = 1e-9  # of the squared distances, far below any difference that matters

SEEDS = (1001, 1002)  # renderings that `choose` compares, disjoint from percepts.RENDERINGS
NOISE = 2.0  # Weber steps, near the noise fitted to the paper's nine people
LEVEL_ERROR_DB = 6.0
MIN_LEVEL_DB = 10.0  # above threshold in some window, about half of the palm's range
_GAINS_DB = np.linspace(-LEVEL_ERROR_DB, LEVEL_ERROR_DB, 9)
_STEP_DB = np.repeat(WEBER_DB, len(WINDOWS_S))


def confusion(percepts: Percepts, noise: float, seed: int, trials: int = TRIALS) -> _Counts:
    """Count how often each pattern (rows) is answered as each (columns), (patterns, patterns).

    `noise` is in the units of `percepts.steps`; every row sums to `trials`.
    """
    rng = np.random.default_rng(seed)
    templates = percepts.templates
    count = len(templates)
    counts = np.zeros((count, count), dtype=np.int64)
    for presented, renderings in enumerate(percepts.steps):
        # A study renders a pattern again for every trial, so its own variation is part of what the
        # observer has to see through; it is drawn before the noise is added.
        chosen = renderings[rng.integers(len(renderings), size=trials)]
        observed = chosen + noise * rng.standard_normal(chosen.shape)
        counts[presented] = np.bincount(_nearest(observed, templates, rng), minlength=count)
    return counts


def recognised(counts: _Counts) -> float:
    """Return the share of trials answered correctly, 0..1."""
    return float(np.trace(counts) / counts.sum())


def solve(share: Callable[[float], float], target: float) -> float:
    """Return the noise at which `share`, a falling function of noise, equals `target`.

    Bisects the logarithm of the noise, since noises matter by their ratio. Raises ValueError when
    the target is not reached within 1e-3 to 1e3.
    """
    low, high = _NOISE_RANGE
    if not share(high) < target < share(low):
        raise ValueError(f"there is no noise at which {target:.1%} of this set is recognised")
    for _ in range(_HALVINGS):
        middle = math.sqrt(low * high)
        low, high = (middle, high) if share(middle) > target else (low, middle)
    return math.sqrt(low * high)


def _nearest(observed: _Floats, templates: _Floats, rng: np.random.Generator) -> NDArray[np.intp]:
    """Return the index of the nearest template, (trials,), for `observed`, (trials, features).

    Templates that are equally near are drawn by lot.
    """
    # |x - t|^2 without |x|^2, which is the same for all templates: one matrix product instead of an
    # array of (trials, templates, features).
    squares = (templates**2).sum(axis=1) - 2.0 * observed @ templates.T
    # argmin takes the first of equal distances. Two patterns that feel the same would then look
    # like one that is always recognised and one that never is.
    squares += _TIE * (1.0 + np.abs(squares).max()) * rng.random(squares.shape)
    return np.asarray(squares.argmin(axis=1))


def choose(candidates: Sequence[Sequence[Stimulus]]) -> tuple[tuple[Stimulus, ...], float]:
    """Choose one candidate of each row, such that the set is confused least.

    Returns the candidates chosen and the distance of the two nearest of them in Weber steps. A row
    with a single candidate keeps it.
    """
    rows = [_well_perceived(row) for row in candidates]
    levels = [np.array([level for _, level in row]) for row in rows]
    errors = np.zeros([len(row) for row in rows])
    # `errors` has one axis for each row, and its entry at (a, b, c ...) is the sum of p(mistaken)
    # over all pairs of that combination. A pair of rows contributes a matrix that is broadcast to
    # all axes, so all combinations are evaluated without a loop over them.
    for i, j in itertools.combinations(range(len(rows)), 2):
        mistaken = ndtr(distances(levels[i], levels[j]) / (-2.0 * NOISE))
        shape = [1] * len(rows)
        shape[i], shape[j] = mistaken.shape
        errors = errors + mistaken.reshape(shape)
    best = np.unravel_index(errors.argmin(), errors.shape)
    picked = np.array([level[at] for level, at in zip(levels, best, strict=True)])
    nearest = distances(picked, picked)[~np.eye(len(rows), dtype=bool)].min()
    return tuple(row[at][0] for row, at in zip(rows, best, strict=True)), float(nearest)


def distances(first: _Floats, second: _Floats) -> _Floats:
    """Return the distances in Weber steps of levels in dB, (n, features) and (m, features), (n, m).

    Each is the least when either of the two has up to LEVEL_ERROR_DB more or less gain.
    """
    return np.minimum(_nearest_level(first, second), _nearest_level(second, first).T)


def _nearest_level(moved: _Floats, fixed: _Floats) -> _Floats:
    """Return the least distances over the gains of `moved`, (moved, fixed)."""
    louder = louder_db(moved[:, None, :], _GAINS_DB[:, None])
    difference = (louder[:, None, :, :] - fixed[None, :, None, :]) / _STEP_DB
    return np.asarray(np.sqrt((difference**2).sum(axis=3)).min(axis=2))


def _well_perceived(row: Sequence[Stimulus]) -> list[tuple[Stimulus, _Floats]]:
    """Return the candidates that are well above threshold with their levels; all where none is."""
    candidates = [(stimulus, _levels(stimulus)) for stimulus in row]
    return [pair for pair in candidates if pair[1].max() >= MIN_LEVEL_DB] or candidates


def _levels(stimulus: Stimulus) -> _Floats:
    """Return the mean level of each vibration feature over SEEDS, dB, (features,)."""
    steps = np.mean([touch(stimulus, seed) for seed in SEEDS], axis=0)
    return np.asarray(steps * _STEP_DB)
