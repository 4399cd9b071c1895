"""What the observer takes from a plate under the palm: which way, how fast, how far. Pure.

Early rate and end temperature, with their sign, on a scale that is even up to a floor and
logarithmic beyond it. One step is WEBER of the rate at which heat is extracted, which decides more
than the end temperature does (Bergmann Tiest and Kappers 2009); the temperature gets the same step
because people told 3 from 6 degC of a thermal icon in 73 % of cases only (Wilson, Brewster), which
0.2 degC of noise would make certain. The sign needs no feature of its own: it is theirs.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from hapticvlm.perception import THERMAL_FLOOR_C

WEBER = 0.43
EARLY_S = 0.5  # s from the plate's start, about a cold reaction time (docs/physics.md 1.3)
RATE_FLOOR_C_PER_S = 0.1  # below it thresholds rise steeply (physics.md 1.3)


def warmth_steps(skin_c: NDArray[np.float64], step_s: float) -> NDArray[np.float64]:
    """Early rate and end temperature in Weber steps, (2,), of skin (n,) sampled every `step_s`.

    The first sample is the skin at rest; negative is colder.
    """
    early = min(max(round(EARLY_S / step_s), 1), skin_c.size - 1)
    rate = (skin_c[early] - skin_c[0]) / (early * step_s)
    change_c = skin_c[-1] - skin_c[0]
    return np.array([_steps(rate / RATE_FLOOR_C_PER_S), _steps(change_c / THERMAL_FLOOR_C)])


def _steps(floors: float) -> float:
    """Return the signed number of Weber steps in so many floors."""
    return math.copysign(math.log1p(abs(floors)) / math.log1p(WEBER), floors)
