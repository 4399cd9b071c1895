"""Computes the thermal half of a touch: skin on the real object, setpoint of the plate. Pure.

The hand approaches for APPROACH_S and then touches. The skin follows the contact model (physics.md
1.1). The plate starts at neutral, leads the skin by the service's own trajectory and keeps the
service's own limits; both come from `rendering.heat`, and this module only steps through time.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

from hapticvlm.materials import Material
from hapticvlm.messages import Limit
from hapticvlm.perception import NEUTRAL_C
from hapticvlm.rendering.heat.contact import (
    SKIN,
    ThermalContact,
    carries_cue,
    contact_temperature_c,
    thermal_contact,
)
from hapticvlm.rendering.heat.limits import AT_REST, Strongest, limit
from hapticvlm.rendering.heat.trajectory import ThermalTrajectory

APPROACH_S = 0.5
TICK_S = 0.02


@dataclass(frozen=True, slots=True)
class ThermalInputs:
    """Temperatures of a touch in degC; without `object_c` the object is at `ambient_c`.

    `contact_resistance` is in m2 K/W (None: the material's), `thickness_m` in m (None: thick).
    """

    object_c: float | None
    ambient_c: float
    skin_c: float = NEUTRAL_C
    contact_resistance: float | None = None
    thickness_m: float | None = None


@dataclass(frozen=True, slots=True)
class Heat:
    """One touch from contact on.

    The last five run over time, every TICK_S: times in s, the skin on the real object, the setpoint
    without limits and with them in degC, and the limit that acted (None: none did).
    """

    material: str
    skin_effusivity: float
    effusivity: float
    contact_resistance: float
    thickness_m: float | None
    ambient_c: float
    surface_c: float
    skin_start_c: float
    contact_c: float
    thermal_cue: bool
    approach_s: float
    time_s: list[float]
    skin_c: list[float]
    unlimited_c: list[float]
    setpoint_c: list[float]
    limited_by: list[Limit | None]


def heat(material: Material, inputs: ThermalInputs, seconds: float) -> Heat:
    """Return a touch of this material that lasts `seconds`."""
    contact = _contact(material, inputs)
    real = ThermalTrajectory(lead_s=0.0).touch(contact, material.name, 0.0)
    wanted, limited = _plate(contact, inputs.ambient_c, seconds)
    times = [round(TICK_S * tick, 6) for tick in range(len(wanted))]
    return Heat(
        material=material.name,
        skin_effusivity=SKIN.effusivity,
        effusivity=material.thermal.effusivity,
        contact_resistance=contact.contact_resistance,
        thickness_m=contact.thickness_m,
        ambient_c=inputs.ambient_c,
        surface_c=contact.surface_c,
        skin_start_c=contact.skin_c,
        contact_c=contact_temperature_c(contact),
        thermal_cue=carries_cue(contact),
        approach_s=APPROACH_S,
        time_s=times,
        skin_c=[real.skin_c(time_s) for time_s in times],
        unlimited_c=wanted,
        setpoint_c=[setpoint_c for setpoint_c, _ in limited],
        limited_by=[by for _, by in limited],
    )


def _contact(material: Material, inputs: ThermalInputs) -> ThermalContact:
    return thermal_contact(
        material.thermal,
        inputs.ambient_c if inputs.object_c is None else inputs.object_c,
        thickness_m=inputs.thickness_m,
        contact_resistance=inputs.contact_resistance,
        skin_c=inputs.skin_c,
    )


def _plate(
    contact: ThermalContact, ambient_c: float, seconds: float
) -> tuple[list[float], list[tuple[float, Limit | None]]]:
    """Return the setpoints without and with limits, from contact on, with the limit that acted."""
    # Time starts before the contact, since limits such as the slew rate depend on where the lead
    # has brought the setpoint by then. The reading stays that of a plate at rest with its sink at
    # the ambient temperature, so the wear of a real plate (a hot sink, the dose) does not act here.
    reading = replace(AT_REST, plate_c=NEUTRAL_C, sink_c=ambient_c)
    trajectory = ThermalTrajectory()
    setpoint_c = NEUTRAL_C
    strongest = Strongest()
    wanted = []
    sent = []
    for tick in range(-round(APPROACH_S / TICK_S), round(seconds / TICK_S) + 1):
        now = TICK_S * tick
        trajectory = (
            trajectory.approach(contact, now) if tick < 0 else trajectory.touch(contact, 0, now)
        )
        unlimited_c, strength = trajectory.target_c(now), trajectory.strength
        strongest = strongest.towards(unlimited_c, strength, TICK_S, reading)
        limited = limit(
            unlimited_c, setpoint_c, TICK_S, reading, strength=strength, strongest=strongest
        )
        setpoint_c = limited.setpoint_c
        if tick >= 0:
            wanted.append(limited.unlimited_c)
            sent.append((setpoint_c, limited.limited_by))
    return wanted, sent
