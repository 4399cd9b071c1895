"""The thermal half of a touch: what skin does by physics, and what the plate would be sent. Pure.

The hand approaches for APPROACH_S, then touches. The plate starts neutral, leads by the product's
own trajectory and keeps the product's own limits; nothing here computes heat by itself.
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
from hapticvlm.rendering.heat.limits import AT_REST, limit
from hapticvlm.rendering.heat.trajectory import ThermalTrajectory

APPROACH_S = 0.5
TICK_S = 0.02


@dataclass(frozen=True, slots=True)
class ThermalInputs:
    """Temperatures of a touch, degC; no object temperature means that of the ambient."""

    object_c: float | None
    ambient_c: float
    skin_c: float = NEUTRAL_C
    contact_resistance: float | None = None
    thickness_m: float | None = None


@dataclass(frozen=True, slots=True)
class Heat:
    """One touch from contact on; the last five run over time, degC, `limited_by` None: nothing."""

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
    """Follow a touch of this material for some seconds."""
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
    """Return what is wanted and what is sent from contact on: the plate leads, then follows."""
    reading = replace(AT_REST, plate_c=NEUTRAL_C, sink_c=ambient_c)
    trajectory = ThermalTrajectory()
    setpoint_c = NEUTRAL_C
    wanted = []
    sent = []
    for tick in range(-round(APPROACH_S / TICK_S), round(seconds / TICK_S) + 1):
        now = TICK_S * tick
        trajectory = (
            trajectory.approach(contact, now) if tick < 0 else trajectory.touch(contact, 0, now)
        )
        limited = limit(trajectory.wanted_c(now), setpoint_c, TICK_S, reading)
        setpoint_c = limited.setpoint_c
        if tick >= 0:
            wanted.append(limited.unlimited_c)
            sent.append((setpoint_c, limited.limited_by))
    return wanted, sent
