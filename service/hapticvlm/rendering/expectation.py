"""Renders a surface of uncertain material as the expectation over the beliefs. Pure.

A material is rendered as itself when its calibrated probability p makes up for a possible mistake.
Being right gains 1 and being wrong costs L, so the gain is expected to exceed the cost if
p > L / (1 + L) (docs/physics.md 4.5). Otherwise heat and vibration are rendered as follows.

Temperature: skin of effusivity es and temperature Ts meets a body of effusivity e and temperature
To at Ts + e / (e + es) (To - Ts) (physics.md 1.1). The contact temperature is linear in the share
e / (e + es), so its expectation is that of a body with the mean of the materials' shares. That
choice has the least mean squared error.

Vibration: a mean of two textures would be a third one that no material has. So the believed
material that is nearest to the mean roughness and pitch is played, at GRADED_GAIN. Its tables are
cached already, and it is never stronger than a material that is sure.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

from hapticvlm.materials import Material, Thermal
from hapticvlm.rendering.heat.contact import SKIN
from hapticvlm.rendering.vibration.vibration import IMPACTS

# All figures are our choice (docs/physics.md 4.5).
GRADED_GAIN = 0.5  # of full level: 6 dB less than a material that is sure
TEXTURE_COST = 1.0  # L of a texture
STRIKE_COST = 2.0  # L of an impact: a false one startles
JUMPS = ((6.0, 4.0), (3.0, 2.0))  # degC from the expected contact temperature, and L of heat
# Differences of roughness and of the logarithm of pitch that count as equally large; the latter is
# a just noticeable difference (physics.md 4.2).
ROUGHNESS_STEP = 0.25
PITCH_STEP = math.log(1.2)


def needed_belief(interaction: str | None, jump_c: float) -> float:
    """Return the probability (0..1) above which a material is rendered as itself.

    `jump_c` is the difference of its contact temperature from the expected one, degC.
    """
    touch = STRIKE_COST if interaction in IMPACTS else TEXTURE_COST
    cost = max(touch, next((cost for far_c, cost in JUMPS if abs(jump_c) >= far_c), 0.0))
    return cost / (1.0 + cost)


def expected_thermal(beliefs: Mapping[str, float], table: Mapping[str, Material]) -> Thermal:
    """Return the bulk properties of a body that meets skin at the expected contact temperature.

    `beliefs` are probabilities by material name and need not sum to 1. Density and heat capacity
    are geometric means; the conductivity is chosen to give the expected effusivity.
    """
    shares = _normalised(beliefs)
    bulks = {name: table[name].thermal for name in shares}
    share = sum(p * _skin_share(bulks[name]) for name, p in shares.items())
    effusivity = SKIN.effusivity * share / (1.0 - share)
    density = _geometric({n: bulks[n].density for n in shares}, shares)
    capacity = _geometric({n: bulks[n].heat_capacity for n in shares}, shares)
    return Thermal(effusivity**2 / (density * capacity), density, capacity)


def nearest_vibration(beliefs: Mapping[str, float], table: Mapping[str, Material]) -> str:
    """Return the name of the believed material with roughness and pitches nearest to the mean."""
    shares = _normalised(beliefs)
    places = {name: _place(table[name]) for name in shares}
    mean = [sum(p * places[name][axis] for name, p in shares.items()) for axis in range(3)]
    return min(shares, key=lambda name: (math.dist(places[name], mean), name))


def _normalised(beliefs: Mapping[str, float]) -> dict[str, float]:
    total = sum(beliefs.values())
    return {name: belief / total for name, belief in beliefs.items() if belief > 0.0}


def _skin_share(thermal: Thermal) -> float:
    return thermal.effusivity / (thermal.effusivity + SKIN.effusivity)


def _geometric(values: Mapping[str, float], shares: Mapping[str, float]) -> float:
    return math.exp(sum(p * math.log(values[name]) for name, p in shares.items()))


def _place(material: Material) -> tuple[float, float, float]:
    """Return roughness, pitch of the texture and pitch of the impact, in equally large steps."""
    vibration = material.vibration
    return (
        vibration.roughness / ROUGHNESS_STEP,
        math.log(vibration.pitch_m) / PITCH_STEP,
        math.log(vibration.modes[0].frequency_hz) / PITCH_STEP,
    )
