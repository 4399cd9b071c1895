"""How much a prediction hangs on the guess of the paper's stimuli: other guesses, each calibrated.

The paper's recordings, levels and temperatures are unpublished. A guess takes one stroke of
`patterns.candidates()` for each vibration, a hot and a cold setpoint and a lead; the observer's
noises are fitted to the paper's two figures on it, and a set is predicted with those.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from hapticvlm.study import observer, patterns, predict
from hapticvlm.study.percepts import percepts, weighed
from hapticvlm.study.stimuli import Stimulus, StudyError, checked

HOT_C, COLD_C, LEAD_S = (34.0, 40.0), (23.0, 29.5), (0.25, 3.0)  # what a study may have used
GUESSES, TRIALS, SEED = 20, 2000, 23
_MOST_DRAWS = 3  # for every guess wanted; some let no noise give the paper's figures


@dataclass(frozen=True, slots=True)
class Spread:
    """Shares recognised (0..1) of one set over `count` guesses; `unfit` ones fitted no noise."""

    count: int
    unfit: int
    lowest: float
    tenth: float
    median: float
    ninetieth: float
    highest: float


def spread(stimuli: Sequence[Stimulus], count: int = GUESSES, seed: int = SEED) -> Spread | None:
    """Predict the set with every guess's noise; None where no guess can be calibrated."""
    raw = percepts(stimuli)
    rng = np.random.default_rng(seed)
    shares: list[float] = []
    unfit = 0
    while len(shares) < count and len(shares) + unfit < _MOST_DRAWS * count:
        try:
            noise = predict.calibrated(guess(rng), TRIALS)
        except (ValueError, StudyError):
            unfit += 1
            continue
        counts = observer.confusion(weighed(raw, noise), 1.0, predict.REPORT_SEED, TRIALS)
        shares.append(observer.recognised(counts))
    if not shares:
        return None
    return Spread(len(shares), unfit, *np.percentile(shares, (0, 10, 50, 90, 100)).tolist())


def guess(rng: np.random.Generator) -> tuple[Stimulus, ...]:
    """Draw ten patterns that the paper's might have been. Raises StudyError if none can be so."""
    hot_c, cold_c, lead_s = (float(rng.uniform(*ends)) for ends in (HOT_C, COLD_C, LEAD_S))
    strokes = [row[int(rng.integers(len(row)))] for row in patterns.candidates()]
    ten = patterns.hot_and_cold(strokes)
    setpoints = {"hot": hot_c, "cold": cold_c}
    return checked(
        dataclasses.replace(one, setpoint_c=setpoints[one.temperature], lead_s=lead_s)
        for one in ten
    )
