"""What a hand would feel when it meets an object, and what a plate may do about it. Pure.

The model (Ho and Jones; physics reference 1.1): skin and object are semi-infinite bodies that meet
through a contact resistance R''. With effusivities e, temperatures T and time t the skin surface is

    T(t) = Ts + (To - Ts) eo / (es + eo) (1 - erfcx(x)),   x = sqrt(t) (1/es + 1/eo) / R''

where erfcx(x) = exp(x^2) erfc(x) stays finite where its factors overflow. An object of thickness L
runs out of heat after about L^2 / 4a; from then on it is a lump of rho c L (J/m2K) behind R'',

    T(t) = Ts + (To - Ts) (erfcx(p sqrt t) - erfcx(q sqrt t)) / (es R'' (q - p)),

with p and q from p + q = 1 / (es R'') and p q = 1 / (R'' rho c L), conjugate for a thin lump. Each
form is above the true change where the other one holds, so the smaller change is taken: at most
0.4 degC from a finite-difference slab of 1 mm or more at 10 degC of contrast, near L^2 / 4a.
Perfusion, sweat and the plate itself are not modelled here.
"""

from __future__ import annotations

import cmath
import math
from dataclasses import dataclass
from typing import Literal

from scipy.special import erfcx

from hapticvlm.materials import Thermal
from hapticvlm.perception import NEUTRAL_C, THERMAL_FLOOR_C

LEAD_S = 0.25  # s, heat before vibration is felt as simultaneous: 242 ms best (NSF 2006152)
SETPOINT_MIN_C, SETPOINT_MAX_C = 18.0, 40.0  # degC, this and the next six: physics reference 3.3
SLEW_C_PER_S = 5.0
DOSE_LIMIT_CEM43 = 2.0  # min at 43 degC, the limit for impaired skin (van Rhoon 2013, from memory)
HEAT_LIMIT_S = 900.0
SINK_TRIP_C = 55.0
PLATE_TRIP_HIGH_C = 43.0
PLATE_TRIP_LOW_C = 13.0

SKIN = Thermal(0.37, 1000, 3770)  # from memory; e 1181 is inside the published 1090-1281
_SINK_WARM_C = 45.0  # degC, from here to the trip the coldest setpoint rises to neutral; our choice
_LONGEST_SLEW_S = 0.1  # s, a stalled caller must not earn a jump of many degrees
_NO_RESISTANCE = 1e-12  # m2 K/W, far below any contact; less would overflow the roots
_NEARLY_EQUAL = 1e-6  # of the discriminant: two equal lump roots are split by this much

Limit = Literal["setpoint", "slew", "current", "sink", "dose"]


@dataclass(frozen=True, slots=True)
class ThermalContact:
    """Skin at `skin_c` meeting a surface; resistance in m2 K/W, no thickness means thick."""

    thermal: Thermal
    surface_c: float
    thickness_m: float | None
    contact_resistance: float
    skin_c: float


@dataclass(frozen=True, slots=True)
class Limited:
    """A setpoint that may be sent, the one physics asked for, and what stands between them."""

    setpoint_c: float
    unlimited_c: float
    limited_by: Limit | None


@dataclass(frozen=True, slots=True)
class PlateReading:
    """What a plate last said of itself; None is no reading, duty is -1 (cool) to 1 (heat)."""

    plate_c: float | None
    sink_c: float | None
    setpoint_c: float
    duty: float
    current_limited: bool
    dose_cem43: float
    heated_s: float
    faults: tuple[str, ...]


def thermal_contact(
    thermal: Thermal,
    surface_c: float,
    *,
    thickness_m: float | None = None,
    contact_resistance: float | None = None,
    skin_c: float = NEUTRAL_C,
) -> ThermalContact:
    """Describe a contact; the contact resistance defaults to the fit of Ho and Jones.

    The fit (0.37 + k) / (1870 k) m2 K/W is from memory and predicts larger changes than one
    measured anchor (copper at 10 s would need 2-3.5e-3): calibrate it where it matters.
    """
    if contact_resistance is None:
        conductivity = thermal.conductivity
        contact_resistance = (SKIN.conductivity + conductivity) / (1870.0 * conductivity)
    return ThermalContact(thermal, surface_c, thickness_m, contact_resistance, skin_c)


def contact_temperature_c(contact: ThermalContact) -> float:
    """Temperature at which skin and a thick object meet without contact resistance."""
    share = _object_share(contact)
    return contact.skin_c + share * (contact.surface_c - contact.skin_c)


def skin_surface_c(contact: ThermalContact, elapsed_s: float) -> float:
    """Skin surface temperature `elapsed_s` after contact began; finite for every finite contact."""
    if not elapsed_s >= 0.0:
        return contact.skin_c
    share = _thick_share(contact, elapsed_s)
    if contact.thickness_m is not None:
        share = min(share, _lump_share(contact, contact.thickness_m, elapsed_s))
    return contact.skin_c + share * (contact.surface_c - contact.skin_c)


def wanted_c(contact: ThermalContact, elapsed_s: float | None, gain: float = 1.0) -> float:
    """Plate temperature that physics asks for: None while the hand approaches, else since contact.

    An approach waits where the skin would be at LEAD_S, and contact goes on from there: it never
    falls back to skin temperature. `gain` (0..1) scales the deviation from NEUTRAL_C.
    """
    reached_s = LEAD_S if elapsed_s is None else max(elapsed_s, LEAD_S)
    return NEUTRAL_C + gain * (skin_surface_c(contact, reached_s) - NEUTRAL_C)


def carries_cue(contact: ThermalContact) -> bool:
    """Tell whether the object differs enough from skin to be felt as warm or cold at all."""
    return abs(contact_temperature_c(contact) - contact.skin_c) > THERMAL_FLOOR_C


def within_range(unlimited_c: float) -> Limited:
    """Apply the setpoint band alone; what is no number becomes neutral."""
    if not math.isfinite(unlimited_c):
        return Limited(NEUTRAL_C, NEUTRAL_C, "setpoint")
    setpoint_c = min(max(unlimited_c, SETPOINT_MIN_C), SETPOINT_MAX_C)
    return Limited(setpoint_c, unlimited_c, None if setpoint_c == unlimited_c else "setpoint")


def limit(
    unlimited_c: float, previous_c: float, elapsed_s: float, reading: PlateReading
) -> Limited:
    """Turn a wish into the setpoint of this moment; `limited_by` names the limit that decided it.

    As `settle`, then slew from `previous_c`.
    """
    settled = settle(unlimited_c, reading)
    slewed_c = _slew(settled.setpoint_c, previous_c, elapsed_s)
    if slewed_c != settled.setpoint_c:
        return Limited(slewed_c, settled.unlimited_c, "slew")
    return settled


def settle(unlimited_c: float, reading: PlateReading) -> Limited:
    """Turn a wish into the setpoint the plate will come to, as a decision reports it.

    In order: setpoint band, dose and heated time, sink. A plate at its current limit keeps its
    setpoint and is named only when nothing else limits.
    """
    banded = within_range(unlimited_c)
    setpoint_c, limited_by = banded.setpoint_c, banded.limited_by
    if setpoint_c > NEUTRAL_C and _heat_is_used_up(reading):
        setpoint_c, limited_by = NEUTRAL_C, "dose"
    coldest_c = _coldest_setpoint_c(reading.sink_c)
    if setpoint_c < coldest_c:
        setpoint_c, limited_by = coldest_c, "sink"
    if limited_by is None and reading.current_limited:
        limited_by = "current"
    return Limited(setpoint_c, banded.unlimited_c, limited_by)


def _object_share(contact: ThermalContact) -> float:
    effusivity = contact.thermal.effusivity
    return effusivity / (effusivity + SKIN.effusivity)


def _thick_share(contact: ThermalContact, elapsed_s: float) -> float:
    if contact.contact_resistance <= 0.0:
        return _object_share(contact)
    admittance = 1.0 / SKIN.effusivity + 1.0 / contact.thermal.effusivity
    argument = math.sqrt(elapsed_s) * admittance / contact.contact_resistance
    return _object_share(contact) * (1.0 - float(erfcx(argument)))


def _lump_share(contact: ThermalContact, thickness_m: float, elapsed_s: float) -> float:
    capacity = contact.thermal.density * contact.thermal.heat_capacity * thickness_m
    if capacity <= 0.0:
        return 0.0
    root_s = math.sqrt(elapsed_s)
    if contact.contact_resistance <= _NO_RESISTANCE:
        return float(erfcx(SKIN.effusivity / capacity * root_s))
    half_sum = 0.5 / (SKIN.effusivity * contact.contact_resistance)
    product = 1.0 / (contact.contact_resistance * capacity)
    discriminant = 1.0 - 4.0 * SKIN.effusivity**2 * contact.contact_resistance / capacity
    if abs(discriminant) < _NEARLY_EQUAL:
        discriminant = _NEARLY_EQUAL
    larger = half_sum * (1.0 + cmath.sqrt(discriminant))
    smaller = product / larger  # the difference would cancel for a small resistance
    settled = erfcx(smaller * root_s) - erfcx(larger * root_s)
    return float((2.0 * half_sum * settled / (larger - smaller)).real)


def _heat_is_used_up(reading: PlateReading) -> bool:
    return reading.dose_cem43 >= DOSE_LIMIT_CEM43 or reading.heated_s >= HEAT_LIMIT_S


def _coldest_setpoint_c(sink_c: float | None) -> float:
    """Coldest setpoint the sink can carry: cooling heats it, and a hot sink turns cold to hot."""
    if sink_c is None:
        return NEUTRAL_C
    warm = min(max((sink_c - _SINK_WARM_C) / (SINK_TRIP_C - _SINK_WARM_C), 0.0), 1.0)
    return SETPOINT_MIN_C + warm * (NEUTRAL_C - SETPOINT_MIN_C)


def _slew(setpoint_c: float, previous_c: float, elapsed_s: float) -> float:
    if not math.isfinite(previous_c):
        previous_c = NEUTRAL_C
    usable_s = min(elapsed_s, _LONGEST_SLEW_S) if elapsed_s > 0.0 else 0.0
    reach_c = SLEW_C_PER_S * usable_s
    return min(max(setpoint_c, previous_c - reach_c), previous_c + reach_c)
