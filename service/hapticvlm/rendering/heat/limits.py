"""Limits the setpoint of a plate: by its band, its slew, the current, the sink and the dose. Pure.

Limits are part of the model. Each result holds the temperature that physics asks for, the setpoint
that may be sent, and the name of the limit that makes them differ.

- Band: 18 to 40 degC, below the burn threshold of 43 degC and above the 15 degC at which cold
  begins to hurt.
- Slew: at most 12 degC/s, so that the plate never jumps.
- Dose: thermal damage grows with time and exponentially with temperature. CEM43 counts it in
  minutes at 43 degC; from 2 CEM43, or 900 s of heat, on nothing above neutral is sent until the
  skin has rested (physics.md 3.1).
- Sink: cooling moves heat into the sink. Beyond an optimum a hot sink warms the plate when the
  current rises, and through an open bridge it warms the skin. So the coldest setpoint rises to
  neutral as the sink warms up to its trip (physics.md 2.3).

Where a limit binds, clipping would make all things feel alike. So a material is compressed instead,
as a photograph compresses light. `Strongest` follows where the plate would be by now for the
strongest material under the same limits, C degC from neutral. A material of which physics asks the
share r of the strongest one's change gets at most r^COMPRESSION C. Where no limit binds the
strongest, C is its wish w / r, and r^COMPRESSION w / r is no less than w: nothing is changed.

These limits apply before the setpoint is sent; the firmware has its own, which do not rely on them.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from hapticvlm.messages import Limit
from hapticvlm.perception import NEUTRAL_C

# The source is docs/physics.md 3.2 unless another section is named.
SETPOINT_MIN_C = 18.0
SETPOINT_MAX_C = 40.0
# People tell materials apart by the first half second of cooling (Ho and Jones 2006; Bergmann Tiest
# and Kappers 2009), so what limits it should be the current.
COOL_SLEW_C_PER_S = 12.0
HEAT_SLEW_C_PER_S = 12.0
COMPRESSION = 0.5  # exponent of a material's share; 0 clips, 1 keeps the ratios; our choice
# Of a plate at full current under a palm, as for the strongest material: rates, and the time by
# which it is ahead of a plate that follows a setpoint in motion. On a slower plate materials are
# only less apart on the way.
PLATE_COOLS_C_PER_S = 6.3
PLATE_HEATS_C_PER_S = 3.0
_AHEAD_S = 0.5
DOSE_LIMIT_CEM43 = 2.0  # min at 43 degC, for healthy people without supervision (physics.md 3.1)
HEAT_LIMIT_S = 900.0
SINK_TRIP_C = 44.0  # a hotter sink with a dead fan heats the skin through an open bridge
PLATE_TRIP_HIGH_C = 43.0
PLATE_TRIP_LOW_C = 13.0
CATCH_UP, CATCH_UP_S = 0.4, 0.7  # share of the delay, and the time of its mean; our choice

_SINK_WARM_C = 38.0  # from here to the trip the coldest setpoint rises to neutral; our choice
_BEHIND_C = 0.4  # of a setpoint in motion: more than a sound loop's error; our choice
_LONGEST_SLEW_S = 0.1  # a caller that was stalled must not get a jump of many degrees


@dataclass(frozen=True, slots=True)
class Limited:
    """A setpoint that may be sent, the one that physics asks for, and the limit between them."""

    setpoint_c: float
    unlimited_c: float
    limited_by: Limit | None


@dataclass(frozen=True, slots=True)
class Strongest:
    """The plate's place by now for the strongest material, and the limit that keeps it there.

    `setpoint_c` is where it would be a moment later, which a setpoint in motion has to lead by.
    """

    plate_c: float = NEUTRAL_C
    setpoint_c: float = NEUTRAL_C
    limited_by: Limit | None = None

    def towards(
        self, unlimited_c: float, strength: float, elapsed_s: float, reading: PlateReading
    ) -> Strongest:
        """Return it `elapsed_s` later, while a material of this strength asks for `unlimited_c`."""
        wished_c = NEUTRAL_C + (unlimited_c - NEUTRAL_C) / strength
        settled = settle(wished_c, limits_of(reading))
        rates = PLATE_COOLS_C_PER_S, PLATE_HEATS_C_PER_S
        plate_c = _slew(settled.setpoint_c, self.plate_c, _usable_s(elapsed_s), *rates)
        setpoint_c = _slew(settled.setpoint_c, plate_c, _AHEAD_S, *rates)
        is_there = setpoint_c == settled.setpoint_c
        return Strongest(plate_c, setpoint_c, settled.limited_by if is_there else "current")


@dataclass(frozen=True, slots=True)
class Delay:
    """How far the face has been behind its wish lately, and its last reading, degC.

    A plate at full current leaves the skin behind, which needs more than the wish to catch up.
    """

    behind_c: float = 0.0
    plate_c: float | None = None

    def after(self, wanted_c: float, elapsed_s: float, reading: PlateReading) -> Delay:
        """Return it `elapsed_s` later; a face is ahead of its beads by lag times slope."""
        if reading.plate_c is None or reading.lag_s is None:
            return Delay()
        moved_c = 0.0 if self.plate_c is None else reading.plate_c - self.plate_c
        away_c = reading.plate_c - wanted_c - self.behind_c
        change_c = (away_c * _usable_s(elapsed_s) + reading.lag_s * moved_c) / CATCH_UP_S
        return Delay(self.behind_c + change_c, reading.plate_c)


@dataclass(frozen=True, slots=True)
class PlateReading:
    """The last report of a plate; None means no reading.

    `setpoint_c` is the setpoint in force, `duty` the share of full drive, -1 (cool) to 1 (heat).
    `current_a` is the current requested from the driver, A, positive when it heats the plate.
    `dose_cem43` is in minutes at 43 degC and `heated_s` in s; both count the whole session.
    `lag_s` is that of `plate_c` behind the face, s; None until `calibrate plate` has measured it.
    """

    plate_c: float | None
    sink_c: float | None
    setpoint_c: float
    duty: float = 0.0
    current_limited: bool = False
    dose_cem43: float = 0.0
    heated_s: float = 0.0
    faults: tuple[str, ...] = ()
    current_a: float | None = None
    lag_s: float | None = None


AT_REST = PlateReading(None, 22.0, NEUTRAL_C)  # until a plate has reported: only the band limits


@dataclass(frozen=True, slots=True)
class PlateLimits:
    """Current limits of a plate's setpoint, in addition to the band and the slew."""

    coldest_c: float
    may_heat: bool
    is_current_limited: bool


def limits_of(reading: PlateReading) -> PlateLimits:
    """Return the limits of a plate with this reading."""
    used_up = reading.dose_cem43 >= DOSE_LIMIT_CEM43 or reading.heated_s >= HEAT_LIMIT_S
    coldest_c = SETPOINT_MIN_C + sink_share(reading.sink_c) * (NEUTRAL_C - SETPOINT_MIN_C)
    return PlateLimits(coldest_c, not used_up, reading.current_limited)


def within_range(unlimited_c: float) -> Limited:
    """Apply the setpoint band alone; NaN and inf become neutral."""
    if not math.isfinite(unlimited_c):
        return Limited(NEUTRAL_C, NEUTRAL_C, "setpoint")
    setpoint_c = min(max(unlimited_c, SETPOINT_MIN_C), SETPOINT_MAX_C)
    return Limited(setpoint_c, unlimited_c, None if setpoint_c == unlimited_c else "setpoint")


def limit(
    unlimited_c: float,
    previous_c: float,
    elapsed_s: float,
    reading: PlateReading,
    *,
    strength: float = 1.0,
    strongest: Strongest = Strongest(),
) -> Limited:
    """Return the setpoint to send now: settled, compressed, then slewed from `previous_c`.

    `elapsed_s` is the time since `previous_c` (degC) was sent. `limited_by` names the limit that
    decided the result, or None. A plate at its current limit that cannot follow the slew is
    limited by the current: it would be no faster if the setpoint moved faster.
    """
    settled = settle(unlimited_c, limits_of(reading))
    if strength < 1.0:
        settled = _compress(settled, strength, strongest)
    slews = COOL_SLEW_C_PER_S, HEAT_SLEW_C_PER_S
    slewed_c = _slew(settled.setpoint_c, previous_c, _usable_s(elapsed_s), *slews)
    if slewed_c == settled.setpoint_c:
        return settled
    is_behind = _is_behind(reading, towards=slewed_c - previous_c)
    return Limited(slewed_c, settled.unlimited_c, "current" if is_behind else "slew")


def settle_material(unlimited_c: float, strength: float, limits: PlateLimits) -> Limited:
    """Return the setpoint that the plate reaches in the end, as a decision reports it."""
    end = settle(NEUTRAL_C + (unlimited_c - NEUTRAL_C) / strength, limits)
    strongest = Strongest(end.setpoint_c, end.setpoint_c, end.limited_by)
    return _compress(settle(unlimited_c, limits), strength, strongest)


def settle(unlimited_c: float, limits: PlateLimits) -> Limited:
    """Return the setpoint nearest to this one that the plate may have in the end.

    The limits apply in this order: setpoint band, dose and heated time, sink. A plate at its
    current limit keeps its setpoint; that limit is reported only when no other one acts.
    """
    banded = within_range(unlimited_c)
    setpoint_c, limited_by = banded.setpoint_c, banded.limited_by
    if setpoint_c > NEUTRAL_C and not limits.may_heat:
        setpoint_c, limited_by = NEUTRAL_C, "dose"
    if setpoint_c < limits.coldest_c:
        setpoint_c, limited_by = limits.coldest_c, "sink"
    if limited_by is None and limits.is_current_limited:
        limited_by = "current"
    return Limited(setpoint_c, banded.unlimited_c, limited_by)


def _compress(settled: Limited, strength: float, strongest: Strongest) -> Limited:
    """Move a setpoint no further from neutral than this material's part of the strongest one's."""
    most_c = NEUTRAL_C + strength**COMPRESSION * (strongest.setpoint_c - NEUTRAL_C)
    low_c, high_c = min(most_c, NEUTRAL_C), max(most_c, NEUTRAL_C)
    setpoint_c = min(max(settled.setpoint_c, low_c), high_c)
    if setpoint_c == settled.setpoint_c:
        return settled
    return Limited(setpoint_c, settled.unlimited_c, strongest.limited_by)


def _is_behind(reading: PlateReading, towards: float) -> bool:
    """Return whether full current leaves the plate behind a setpoint that moves `towards`."""
    if reading.plate_c is None or not reading.current_limited:
        return False
    return math.copysign(1.0, towards) * (reading.setpoint_c - reading.plate_c) > _BEHIND_C


def sink_share(sink_c: float | None) -> float:
    """Progress of the sink from warm to its trip, 0..1; 1 without a reading, to be safe."""
    if sink_c is None:
        return 1.0
    return min(max((sink_c - _SINK_WARM_C) / (SINK_TRIP_C - _SINK_WARM_C), 0.0), 1.0)


def _slew(
    setpoint_c: float, previous_c: float, elapsed_s: float, cools: float, heats: float
) -> float:
    """Move from `previous_c` towards a setpoint at no more than these rates, degC/s."""
    if not math.isfinite(previous_c):
        previous_c = NEUTRAL_C
    return min(max(setpoint_c, previous_c - cools * elapsed_s), previous_c + heats * elapsed_s)


def _usable_s(elapsed_s: float) -> float:
    return min(elapsed_s, _LONGEST_SLEW_S) if elapsed_s > 0.0 else 0.0
