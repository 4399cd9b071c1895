"""What a hand would feel when it meets an object: the surface of the skin over time. Pure.

The model (Ho and Jones; docs/physics.md 1.1): skin and object are semi-infinite bodies that meet
through a contact resistance R''. With effusivities e, temperatures T and time t the skin surface is

    T(t) = Ts + (To - Ts) share(t)
    share(t) = eo / (es + eo) (1 - erfcx(x)),   x = sqrt(t) (1/es + 1/eo) / R''

where erfcx(x) = exp(x^2) erfc(x) stays finite where its factors overflow. An object of thickness L
(diffusivity a, nothing behind it) runs out of heat after about L^2 / 4a and is then a lump. Its
share has a closed form in the Laplace domain only,

    s share(s) = 1 / (1 + R'' es sqrt(s) + es / eo coth(L sqrt(s / a)))

which holds for sheet, slab and lump alike; Gaver and Stehfest's sum of eight such terms brings it
back to time, within 0.003 degC at 10 degC of contrast. Perfusion, sweat and the plate itself are
not modelled here; what earlier contacts left in the skin is, in trajectory.py.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from hapticvlm.materials import Thermal
from hapticvlm.perception import NEUTRAL_C, THERMAL_FLOOR_C

LEAD_S = 0.25  # s, heat before vibration is felt as simultaneous: 242 ms best (physics.md 1.3)

# m2 K/W, what is assumed between palm and plate until `calibrate plate` measured it. Palms lie
# between 2e-4 and 1e-3; a guess that is too high errs the livelier way (physics.md 2.1).
PLATE_RESISTANCE = 4e-4

SKIN = Thermal(0.37, 1000, 3770)  # e 1181, inside the published 1090-1281 (physics.md 1.1)
_SMALLEST = 1e-300  # keeps a vanishing thickness from dividing by zero
_FAR = 20.0  # where erfc(x) is still far from underflow, and its series is exact to 3e-10
_TERMS = 8  # of Gaver and Stehfest's sum: 6 are five times less exact, 10 cost a fifth more


@dataclass(frozen=True, slots=True)
class ThermalContact:
    """Skin at `skin_c` meeting a surface; resistance in m2 K/W, no thickness means thick."""

    thermal: Thermal
    surface_c: float
    thickness_m: float | None
    contact_resistance: float
    skin_c: float


def thermal_contact(
    thermal: Thermal,
    surface_c: float,
    *,
    thickness_m: float | None = None,
    contact_resistance: float | None = None,
    skin_c: float = NEUTRAL_C,
) -> ThermalContact:
    """Describe a contact; the contact resistance defaults to the fit of Ho and Jones.

    The fit (0.37 + k) / (1870 k) m2 K/W (physics.md 1.1) predicts larger changes than one
    measured anchor (copper at 10 s would need 2-3.5e-3): calibrate it where it matters.
    """
    if contact_resistance is None:
        contact_resistance = default_resistance(thermal)
    return ThermalContact(thermal, surface_c, thickness_m, contact_resistance, skin_c)


def default_resistance(thermal: Thermal) -> float:
    """Contact resistance of a palm on this bulk, m2 K/W: the fit of Ho and Jones."""
    return (SKIN.conductivity + thermal.conductivity) / (1870.0 * thermal.conductivity)


def contact_temperature_c(contact: ThermalContact) -> float:
    """Temperature at which skin and a thick object meet without contact resistance."""
    share = _object_share(contact.thermal)
    return contact.skin_c + share * (contact.surface_c - contact.skin_c)


def skin_surface_c(contact: ThermalContact, elapsed_s: float) -> float:
    """Skin surface temperature `elapsed_s` after contact began; finite for every finite contact."""
    return contact.skin_c + share(contact, elapsed_s) * (contact.surface_c - contact.skin_c)


def share(contact: ThermalContact, elapsed_s: float) -> float:
    """Share (0..1) of the difference between skin and object that the skin surface has taken on."""
    if not elapsed_s >= 0.0 or contact.contact_resistance == math.inf:
        return 0.0
    if contact.thickness_m is not None:
        return _sheet_share(contact, contact.thickness_m, elapsed_s)
    settled = _object_share(contact.thermal)
    if contact.contact_resistance <= 0.0:
        return settled
    return settled * (1.0 - _erfcx(progress(contact, elapsed_s)))


def progress(contact: ThermalContact, elapsed_s: float) -> float:
    """How far a thick contact has come, x above: much less than 1 at first, inf if perfect."""
    if contact.contact_resistance <= 0.0:
        return math.inf
    admittance = 1.0 / SKIN.effusivity + 1.0 / contact.thermal.effusivity
    return math.sqrt(elapsed_s) * admittance / contact.contact_resistance


def carries_cue(contact: ThermalContact) -> bool:
    """Whether the object differs enough from skin to be perceived as warm or cold at all."""
    return abs(contact_temperature_c(contact) - contact.skin_c) > THERMAL_FLOOR_C


def _object_share(thermal: Thermal) -> float:
    effusivity = thermal.effusivity
    return effusivity / (effusivity + SKIN.effusivity)


def _erfcx(x: float) -> float:
    """exp(x^2) erfc(x) for x >= 0. scipy has it too, and takes a quarter second to load."""
    if x < _FAR:
        return math.exp(x * x) * math.erfc(x)
    half = 0.5 / (x * x)
    return (1.0 - half * (1.0 - 3.0 * half * (1.0 - 5.0 * half))) / (x * math.sqrt(math.pi))


def _sheet_share(contact: ThermalContact, thickness_m: float, elapsed_s: float) -> float:
    """Sum 1 / (1 + R'' es sqrt(s) + es / eo coth(L sqrt(s / a))) over the s of this moment."""
    if thickness_m <= 0.0 or elapsed_s == math.inf:
        return 0.0
    resistance = max(contact.contact_resistance, 0.0)
    if elapsed_s == 0.0:
        return 0.0 if resistance else _object_share(contact.thermal)
    bulk = contact.thermal
    root_time = math.sqrt(elapsed_s)
    barrier = resistance * SKIN.effusivity / root_time
    contrast = SKIN.effusivity / bulk.effusivity
    diffusivity = bulk.conductivity / (bulk.density * bulk.heat_capacity)
    depth = thickness_m / (math.sqrt(diffusivity) * root_time)
    total = 0.0
    for weight, root in _STEHFEST:
        filled = math.tanh(depth * root)
        total += weight / (1.0 + barrier * root + contrast / (filled + _SMALLEST))
    return min(max(total, 0.0), 1.0)


def _stehfest(terms: int) -> tuple[tuple[float, float], ...]:
    """Weights of Gaver and Stehfest for a step response (over k), and sqrt(k ln 2)."""
    half = terms // 2
    factorial = math.factorial
    pairs = []
    for k in range(1, terms + 1):
        weight = sum(
            j**half
            * factorial(2 * j)
            / factorial(half - j)
            / (factorial(j) * factorial(j - 1) * factorial(k - j) * factorial(2 * j - k))
            for j in range((k + 1) // 2, min(k, half) + 1)
        )
        pairs.append(((-1) ** (k + half) * weight / k, math.sqrt(k * math.log(2.0))))
    return tuple(pairs)


_STEHFEST = _stehfest(_TERMS)
