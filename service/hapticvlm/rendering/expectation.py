"""What is felt of a surface whose material is not sure: the expectation over beliefs. Pure.

Temperature: skin and a body of effusivity e meet at Ts + e / (e + es) (To - Ts), so the expected
contact temperature is that of a body whose share e / (e + es) is the mean of the materials' shares.
A material is rendered as itself where its calibrated probability p is worth a mistake: right gains
1, wrong costs L, so p > L / (1 + L).

Vibration: that of the material nearest to the mean roughness and pitch, at GRADED_GAIN; what
vibrates is therefore always a material that is kept ready, and never stronger than a sure one.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

from hapticvlm.materials import Material, Thermal
from hapticvlm.rendering.heat.contact import SKIN
from hapticvlm.rendering.vibration.vibration import IMPACTS

GRADED_GAIN = 0.5  # of full level, 6 dB less than a sure one: our choice
# L: a false strike startles; our choice
TEXTURE_COST = 1.0
STRIKE_COST = 2.0
JUMPS = ((6.0, 4.0), (3.0, 2.0))  # degC from the expectation, L: a burn or a chill; our choice
# that weigh alike; physics.md 4.2 for pitch
ROUGHNESS_STEP = 0.25
PITCH_STEP = math.log(1.2)


def needed_belief(interaction: str | None, jump_c: float) -> float:
    """Return the probability above which a material is rendered as itself.

    `jump_c` is how far its contact temperature lies from the expected one, degC.
    """
    touch = STRIKE_COST if interaction in IMPACTS else TEXTURE_COST
    cost = max(touch, next((cost for far_c, cost in JUMPS if abs(jump_c) >= far_c), 0.0))
    return cost / (1.0 + cost)


def expected_thermal(beliefs: Mapping[str, float], table: Mapping[str, Material]) -> Thermal:
    """Return the bulk that meets skin at the expected contact temperature.

    Beliefs need not sum to 1. Density and heat capacity are geometric means; the conductivity
    gives the effusivity.
    """
    shares = _normalised(beliefs)
    bulks = {name: table[name].thermal for name in shares}
    share = sum(p * _skin_share(bulks[name]) for name, p in shares.items())
    effusivity = SKIN.effusivity * share / (1.0 - share)
    density = _geometric({n: bulks[n].density for n in shares}, shares)
    capacity = _geometric({n: bulks[n].heat_capacity for n in shares}, shares)
    return Thermal(effusivity**2 / (density * capacity), density, capacity)


def nearest_vibration(beliefs: Mapping[str, float], table: Mapping[str, Material]) -> str:
    """Return the believed material whose roughness and pitches are nearest to the mean ones."""
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
    """Roughness, pitch of the texture and of the impact, each in steps that weigh alike."""
    vibration = material.vibration
    return (
        vibration.roughness / ROUGHNESS_STEP,
        math.log(vibration.pitch_m) / PITCH_STEP,
        math.log(vibration.modes[0].frequency_hz) / PITCH_STEP,
    )
