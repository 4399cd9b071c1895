"""Computes the temperature of the skin surface after a hand meets an object. Pure.

The model is that of Ho and Jones (docs/physics.md 1.1). Skin and object are semi-infinite bodies
that meet through a contact resistance R'' (m2 K/W): where two surfaces touch only at their
asperities, heat has to pass the gaps between them. The effusivity e = sqrt(k rho c) says how much
heat a body gives for a change of its surface temperature.

Without contact resistance both surfaces jump at once to the contact temperature
(es Ts + eo To) / (es + eo) and stay there. The body with the higher effusivity dominates it, which
is why metal feels colder than wood of the same temperature. With contact resistance the skin
approaches that temperature gradually. With effusivities e and temperatures T of skin (s) and object
(o), the skin surface at time t is

    T(t) = Ts + (To - Ts) share(t)
    share(t) = eo / (es + eo) (1 - erfcx(x)),   x = sqrt(t) (1/es + 1/eo) / R''

where erfcx(x) = exp(x^2) erfc(x). It is computed as one function, because exp(x^2) overflows and
erfc(x) underflows for large x while their product stays between 0 and 1 (physics.md 1.4).

An object of finite thickness L (diffusivity a, nothing behind it) runs out of heat after about
L^2 / 4a and then has one temperature throughout, as a lump. Its share has a closed form only in the
Laplace domain,

    s share(s) = 1 / (1 + R'' es sqrt(s) + es / eo coth(L sqrt(s / a)))

which holds for sheet, slab and lump alike. The sum of Gaver and Stehfest with eight terms
transforms it back to time, within 0.003 degC at a contrast of 10 degC. Perfusion, sweat and the
plate are not modelled here; `trajectory.py` adds what earlier contacts left in the skin.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from hapticvlm.materials import MATERIALS, Thermal
from hapticvlm.perception import NEUTRAL_C, THERMAL_FLOOR_C

LEAD_S = 0.25  # s by which heat must lead vibration to feel simultaneous (physics.md 1.3)

# Contact resistance between palm and plate, m2 K/W, assumed until `calibrate plate` has measured
# it. Palms lie between 2e-4 and 1e-3; too high a value errs on the side of stronger heat and cold
# (physics.md 2.1).
PLATE_RESISTANCE = 4e-4

SKIN = Thermal(0.37, 1000, 3770)  # e 1181, inside the published 1090-1281 (physics.md 1.1)
_STRONGEST = max((m.thermal for m in MATERIALS.values()), key=lambda bulk: bulk.effusivity)
_SMALLEST = 1e-300  # keeps a vanishing thickness from dividing by zero
_FAR = 20.0  # beyond it the asymptotic series of erfcx is exact to 3e-10; erfc underflows above 26
_TERMS = 8  # of the sum of Gaver and Stehfest: 6 are five times less exact, 10 cost a fifth more


@dataclass(frozen=True, slots=True)
class ThermalContact:
    """Skin at `skin_c` (degC) that meets an object at `surface_c` (degC).

    `contact_resistance` is in m2 K/W, inf for no contact. `thickness_m` is None for an object that
    is thick enough to count as semi-infinite.
    """

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
    """Create a contact; the contact resistance (m2 K/W) defaults to the fit of Ho and Jones.

    The fit predicts larger changes than one published measurement (copper after 10 s would need
    2e-3 to 3.5e-3; physics.md 1.1), so `serve --contact-resistance` takes another.
    """
    if contact_resistance is None:
        contact_resistance = default_resistance(thermal)
    return ThermalContact(thermal, surface_c, thickness_m, contact_resistance, skin_c)


def default_resistance(thermal: Thermal) -> float:
    """Contact resistance of a palm on this material, m2 K/W, by the fit of Ho and Jones.

    It is (0.37 + k) / (1870 k) for a conductivity k in W/(m K) (physics.md 1.1).
    """
    return (SKIN.conductivity + thermal.conductivity) / (1870.0 * thermal.conductivity)


def contact_temperature_c(contact: ThermalContact) -> float:
    """Temperature in degC at which skin and a thick object meet without contact resistance."""
    share = _object_share(contact.thermal)
    return contact.skin_c + share * (contact.surface_c - contact.skin_c)


def skin_surface_c(contact: ThermalContact, elapsed_s: float) -> float:
    """Temperature of the skin surface `elapsed_s` after contact began, degC; always finite."""
    return contact.skin_c + share(contact, elapsed_s) * (contact.surface_c - contact.skin_c)


def share(contact: ThermalContact, elapsed_s: float) -> float:
    """Share (0..1) of the difference between skin and object that the skin surface has adopted.

    It is `share(t)` above; 0 before contact.
    """
    if not elapsed_s >= 0.0 or contact.contact_resistance == math.inf:
        return 0.0
    if contact.thickness_m is not None:
        return _sheet_share(contact, contact.thickness_m, elapsed_s)
    settled = _object_share(contact.thermal)
    if contact.contact_resistance <= 0.0:
        return settled
    return settled * (1.0 - _erfcx(progress(contact, elapsed_s)))


def progress(contact: ThermalContact, elapsed_s: float) -> float:
    """Progress of a thick contact, x above: near 0 at first, inf without resistance."""
    if contact.contact_resistance <= 0.0:
        return math.inf
    admittance = 1.0 / SKIN.effusivity + 1.0 / contact.thermal.effusivity
    return math.sqrt(elapsed_s) * admittance / contact.contact_resistance


def strength(thermal: Thermal) -> float:
    """Change that this material makes in skin, as a share (0..1) of the strongest class's."""
    return min(_object_share(thermal) / _object_share(_STRONGEST), 1.0)


def carries_cue(contact: ThermalContact) -> bool:
    """Whether the object differs enough from skin to be felt as warm or cold (physics.md 1.3)."""
    return abs(contact_temperature_c(contact) - contact.skin_c) > THERMAL_FLOOR_C


def _object_share(thermal: Thermal) -> float:
    effusivity = thermal.effusivity
    return effusivity / (effusivity + SKIN.effusivity)


def _erfcx(x: float) -> float:
    """exp(x^2) erfc(x) for x >= 0."""
    if x < _FAR:
        return math.exp(x * x) * math.erfc(x)
    half = 0.5 / (x * x)
    return (1.0 - half * (1.0 - 3.0 * half * (1.0 - 5.0 * half))) / (x * math.sqrt(math.pi))


def _sheet_share(contact: ThermalContact, thickness_m: float, elapsed_s: float) -> float:
    """`share` for an object of finite thickness.

    The sum evaluates 1 / (1 + R'' es sqrt(s) + es / eo coth(L sqrt(s / a))) at s = k ln 2 / t, and
    `_STEHFEST` holds the weight and sqrt(k ln 2) of each k.
    """
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
    # 1 / coth is tanh. For an object that is thin, or a time that is long, tanh goes to 0 and the
    # object has no heat left; for a thick one it is 1, and the semi-infinite model returns.
    for weight, root in _STEHFEST:
        filled = math.tanh(depth * root)
        total += weight / (1.0 + barrier * root + contrast / (filled + _SMALLEST))
    return min(max(total, 0.0), 1.0)


def _stehfest(terms: int) -> tuple[tuple[float, float], ...]:
    """Return the weights of Gaver and Stehfest for a step response (over k), and sqrt(k ln 2)."""
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
