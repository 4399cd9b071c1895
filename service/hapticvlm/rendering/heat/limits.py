"""The limits of a plate: setpoint band, slew, current, sink and dose. Pure.

Limits are part of the model: each answer gives what physics asked for, what may be sent, and which
limit stands between the two. They are asked for before the plate; the firmware has its own.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from hapticvlm.messages import Limit
from hapticvlm.perception import NEUTRAL_C

# Where no other section is named: docs/physics.md 3.2.
# degC
SETPOINT_MIN_C = 18.0
SETPOINT_MAX_C = 40.0
# The first half second of cooling tells materials apart (Ho and Jones 2006; Bergmann Tiest and
# Kappers 2009), so cold may come faster than heat; the fault sweep is run with both.
COOL_SLEW_C_PER_S = 8.0
HEAT_SLEW_C_PER_S = 5.0
DOSE_LIMIT_CEM43 = 2.0  # min at 43 degC, for healthy people without supervision (physics.md 3.1)
HEAT_LIMIT_S = 900.0
SINK_TRIP_C = 44.0  # a hotter one heats the skin through an open bridge, its fan dead
PLATE_TRIP_HIGH_C = 43.0
PLATE_TRIP_LOW_C = 13.0

_SINK_WARM_C = 38.0  # degC, from here to the trip the coldest setpoint rises to neutral; our choice
_LONGEST_SLEW_S = 0.1  # s, a stalled caller must not earn a jump of many degrees


@dataclass(frozen=True, slots=True)
class Limited:
    """A setpoint that may be sent, the one physics asked for, and what stands between them."""

    setpoint_c: float
    unlimited_c: float
    limited_by: Limit | None


@dataclass(frozen=True, slots=True)
class PlateReading:
    """What a plate last reported of itself; None is no reading, duty is -1 (cool) to 1 (heat).

    `current_a` is what the driver was asked for, positive when it heats the plate.
    """

    plate_c: float | None
    sink_c: float | None
    setpoint_c: float
    duty: float
    current_limited: bool
    dose_cem43: float
    heated_s: float
    faults: tuple[str, ...]
    current_a: float | None = None


AT_REST = PlateReading(  # until the plate has spoken, nothing but the setpoint band limits
    plate_c=None,
    sink_c=22.0,
    setpoint_c=NEUTRAL_C,
    duty=0.0,
    current_limited=False,
    dose_cem43=0.0,
    heated_s=0.0,
    faults=(),
)


@dataclass(frozen=True, slots=True)
class PlateLimits:
    """What limits the setpoint of a plate now, beside the band and the slew."""

    coldest_c: float
    may_heat: bool
    is_current_limited: bool


def limits_of(reading: PlateReading) -> PlateLimits:
    """Return what limits a plate that reports this."""
    used_up = reading.dose_cem43 >= DOSE_LIMIT_CEM43 or reading.heated_s >= HEAT_LIMIT_S
    return PlateLimits(_coldest_setpoint_c(reading.sink_c), not used_up, reading.current_limited)


def within_range(unlimited_c: float) -> Limited:
    """Apply the setpoint band alone; what is no number becomes neutral."""
    if not math.isfinite(unlimited_c):
        return Limited(NEUTRAL_C, NEUTRAL_C, "setpoint")
    setpoint_c = min(max(unlimited_c, SETPOINT_MIN_C), SETPOINT_MAX_C)
    return Limited(setpoint_c, unlimited_c, None if setpoint_c == unlimited_c else "setpoint")


def limit(
    unlimited_c: float, previous_c: float, elapsed_s: float, reading: PlateReading
) -> Limited:
    """Return the setpoint of this moment; `limited_by` names the limit that decided it.

    As `settle`, then slew from `previous_c`.
    """
    settled = settle(unlimited_c, limits_of(reading))
    slewed_c = _slew(settled.setpoint_c, previous_c, elapsed_s)
    if slewed_c != settled.setpoint_c:
        return Limited(slewed_c, settled.unlimited_c, "slew")
    return settled


def settle(unlimited_c: float, limits: PlateLimits) -> Limited:
    """Return the setpoint the plate will come to, as a decision reports it.

    In order: setpoint band, dose and heated time, sink. A plate at its current limit keeps its
    setpoint and is named only when nothing else limits.
    """
    banded = within_range(unlimited_c)
    setpoint_c = banded.setpoint_c
    limited_by = banded.limited_by
    if setpoint_c > NEUTRAL_C and not limits.may_heat:
        setpoint_c = NEUTRAL_C
        limited_by = "dose"
    if setpoint_c < limits.coldest_c:
        setpoint_c = limits.coldest_c
        limited_by = "sink"
    if limited_by is None and limits.is_current_limited:
        limited_by = "current"
    return Limited(setpoint_c, banded.unlimited_c, limited_by)


def sink_share(sink_c: float | None) -> float:
    """How far the sink is on its way from warm to its trip, 0 to 1; unread it may be there."""
    if sink_c is None:
        return 1.0
    return min(max((sink_c - _SINK_WARM_C) / (SINK_TRIP_C - _SINK_WARM_C), 0.0), 1.0)


def _coldest_setpoint_c(sink_c: float | None) -> float:
    """Coldest setpoint the sink can carry: cooling heats it, and a hot sink turns cold to hot."""
    return SETPOINT_MIN_C + sink_share(sink_c) * (NEUTRAL_C - SETPOINT_MIN_C)


def _slew(setpoint_c: float, previous_c: float, elapsed_s: float) -> float:
    if not math.isfinite(previous_c):
        previous_c = NEUTRAL_C
    usable_s = min(elapsed_s, _LONGEST_SLEW_S) if elapsed_s > 0.0 else 0.0
    coldest_c = previous_c - COOL_SLEW_C_PER_S * usable_s
    warmest_c = previous_c + HEAT_SLEW_C_PER_S * usable_s
    return min(max(setpoint_c, coldest_c), warmest_c)
