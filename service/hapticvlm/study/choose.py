"""Search for the strokes that make vibrations hardest to confuse, for the machine observer.

Every combination of candidates is looked at; the one in which the fewest pairs would be mistaken,
each taken alone at NOISE, wins. Two vibrations count as far apart as they are when the level of
one is off by whatever up to LEVEL_OFF_DB brings them nearest: no speaker has been measured, and
what is told apart by loudness alone is lost with the next one. Seeds must be none of those
reported.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr

from hapticvlm.study.channels import WEBER_DB, WINDOWS_S, louder_db
from hapticvlm.study.percepts import touch
from hapticvlm.study.stimuli import Stimulus

SEEDS = (1001, 1002)  # renderings looked at, disjoint from percepts.RENDERINGS
NOISE = 2.0  # Weber steps, about what the paper's people had
LEVEL_OFF_DB = 6.0
FELT_DB = 10.0  # above threshold somewhere, or it is no candidate; about half of the palm's range
_GAINS_DB = np.linspace(-LEVEL_OFF_DB, LEVEL_OFF_DB, 9)
_STEP_DB = np.repeat(WEBER_DB, len(WINDOWS_S))

_Floats = NDArray[np.float64]


def choose(candidates: Sequence[Sequence[Stimulus]]) -> tuple[tuple[Stimulus, ...], float]:
    """Pick one candidate of each row; return them and the nearest two's distance in Weber steps.

    A row of one candidate is kept as it is. Every combination is looked at.
    """
    rows = [_felt(row) for row in candidates]
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
    return np.minimum(_one_way(first, second), _one_way(second, first).T)


def _one_way(moved: _Floats, fixed: _Floats) -> _Floats:
    louder = louder_db(moved[:, None, :], _GAINS_DB[:, None])
    between = (louder[:, None, :, :] - fixed[None, :, None, :]) / _STEP_DB
    return np.asarray(np.sqrt((between**2).sum(axis=3)).min(axis=2))


def _felt(row: Sequence[Stimulus]) -> list[tuple[Stimulus, _Floats]]:
    """Levels of those candidates that are felt well; of all where none is."""
    found = [(one, _levels(one)) for one in row]
    return [pair for pair in found if pair[1].max() >= FELT_DB] or found


def _levels(stimulus: Stimulus) -> _Floats:
    steps = np.mean([touch(stimulus, seed) for seed in SEEDS], axis=0)
    return np.asarray(steps * _STEP_DB)
