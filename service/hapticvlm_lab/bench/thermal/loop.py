"""A PI loop on the project plant with and without anti-windup, after an impossible wish."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np

from hapticvlm.devices.simulated.plant import Plant
from hapticvlm.devices.simulated.simulated import COOL_LIMIT_A, HEAT_LIMIT_A
from hapticvlm.perception import NEUTRAL_C
from hapticvlm_lab.bench.thermal.grids import Floats

# more cold than 2 A on 2 K/W can give
IMPOSSIBLE_C = 0.0
WISH_S = 30.0
AFTER_S = 40.0
# A/K and A/(K s): one schedule for both signs
PROPORTIONAL = 2.0
INTEGRAL = 1.0
TICK_S = 0.02
SETTLED_C = 0.5


@dataclass(frozen=True, slots=True)
class ReturnFromWindup:
    """After the release: time until the plate stays at neutral, None if never; overshoot; trace."""

    settled_s: float | None
    overshoot_c: float
    times_s: Floats
    plate_c: Floats


@cache
def wind_up(*, guarded: bool) -> ReturnFromWindup:
    """Wish the impossible for WISH_S, then neutral; `guarded`: the integral waits at the limit."""
    plant = Plant()
    integral_a = 0.0
    plate = []
    count = round((WISH_S + AFTER_S) / TICK_S)
    times = np.arange(1, count + 1, dtype=np.float64) * TICK_S
    for time_s in times:
        wish_c = IMPOSSIBLE_C if time_s <= WISH_S else NEUTRAL_C
        error_c = wish_c - plant.plate_c
        wanted_a = PROPORTIONAL * error_c + integral_a
        current_a = min(max(wanted_a, -COOL_LIMIT_A), HEAT_LIMIT_A)
        is_limited = current_a != wanted_a and (error_c > 0.0) == (wanted_a > 0.0)
        if not (guarded and is_limited):
            integral_a += INTEGRAL * error_c * TICK_S
        plant.step(current_a, TICK_S)
        plate.append(plant.plate_c)
    return _judge(times, np.array(plate))


def _judge(times: Floats, plate_c: Floats) -> ReturnFromWindup:
    after = times > WISH_S
    off = plate_c[after] - NEUTRAL_C
    away = np.flatnonzero(np.abs(off) > SETTLED_C)
    settled_s = (
        None
        if away.size and away[-1] == off.size - 1
        else TICK_S * (int(away[-1]) + 1 if away.size else 0)
    )
    crossed = np.flatnonzero(off > 0.0)
    overshoot_c = float(off[crossed].max()) if crossed.size else 0.0
    return ReturnFromWindup(settled_s, overshoot_c, times, plate_c)
