"""The first second of a touch: what a plate gives, and the most that any controller could.

A plate cannot follow metal at once: its current is limited, and heat takes time through face, palm
and skin. How good a controller is therefore shows beside the best one under the same limits. Skin
on a plate is the colder the more the plate was cooled at any moment before, so no course of the
current brings more cold by a given time than full current from the first moment on, and this bound
needs no search. It ends at the coldest setpoint, and where the skin has reached its goal. The same
holds for heat.

Both plates are the plant model, with the same limits of current and setpoint, and with the store
that lets cooling begin faster. It holds a charge, which a later use would only make later. The hand
is announced LEAD_S before it touches, and nothing waits for a message. The product renders as a
session does, on a simulated plate whose bead lags.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from hapticvlm.devices.simulated.limiter import Limiter
from hapticvlm.devices.simulated.plant import Plant
from hapticvlm.devices.simulated.simulated import (
    HEAT_LIMIT_A,
    TICK_S,
    SimulatedPlate,
    burst_a,
)
from hapticvlm.materials import MATERIALS
from hapticvlm.perception import NEUTRAL_C
from hapticvlm.rendering.heat import limits
from hapticvlm.rendering.heat.contact import LEAD_S as AHEAD_S
from hapticvlm.rendering.heat.contact import ThermalContact, share, thermal_contact
from hapticvlm.rendering.heat.trajectory import ThermalTrajectory

ROOM_C = 22.0
OBJECTS_C = (22.0, 40.0)
PALM = 5e-4  # m2 K/W, known to the product
BEAD_LAG_S = 0.3  # what a board assumes until it was told its own
LEAD_S = 0.4  # of the announcement; a session leads by 0.6 s at most
AT_S = (0.25, 1.0)
REST_S = 30.0
LEASE_S = 0.25


@dataclass(frozen=True, slots=True)
class FirstSecond:
    """One touch: shares of the real object's change of the skin, at 0.25 and 1 s after contact.

    `real_c` is that change in degC, `product` what the plate gives of it, `most` what any could.
    """

    material: str
    object_c: float
    real_c: tuple[float, float]
    product: tuple[float, float]
    most: tuple[float, float]
    product_over_most: tuple[float, float]


def measure() -> list[FirstSecond]:
    """Touch every material, cold and warm."""
    return [
        touch(name, thermal_contact(material.thermal, object_c))
        for object_c in OBJECTS_C
        for name, material in MATERIALS.items()
    ]


def touch(material: str, contact: ThermalContact) -> FirstSecond:
    """Touch one object."""
    real_c = [_real_c(contact, at_s) for at_s in AT_S]
    product = [felt / real for felt, real in zip(product_c(contact), real_c, strict=True)]
    most = [felt / real for felt, real in zip(most_c(contact), real_c, strict=True)]
    over = [ours / bound for ours, bound in zip(product, most, strict=True)]
    return FirstSecond(material, contact.surface_c, _at(real_c), _at(product), _at(most), _at(over))


def product_c(contact: ThermalContact) -> list[float]:
    """Return the change of the skin that the product gives at each of AT_S, degC."""
    session = _Session()
    rest_c = session.live(REST_S)
    session.trajectory = session.trajectory.approach(contact, session.now)
    session.live(LEAD_S)
    session.trajectory = session.trajectory.touch(contact, "object", session.now)
    spans_s = np.diff(AT_S, prepend=0.0)
    return [session.live(float(span_s)) - rest_c for span_s in spans_s]


def most_c(contact: ThermalContact) -> list[float]:
    """Return the largest change of the skin that any controller gives at each of AT_S, degC."""
    plant = Plant(ROOM_C, palm_resistance=PALM)
    rest_a = _rest(plant)
    rest_c, way = plant.skin_c, math.copysign(1.0, contact.surface_c - NEUTRAL_C)
    limiter = Limiter()
    end_c = limits.SETPOINT_MAX_C if way > 0.0 else limits.SETPOINT_MIN_C
    changes_c = []
    for _ in range(_ticks(LEAD_S + AT_S[-1])):
        is_driven = way * (end_c - plant.plate_c) > 0.0
        full_a = HEAT_LIMIT_A if way > 0.0 else -burst_a(limiter)
        current_a = full_a if is_driven else rest_a
        limiter.take(-current_a, TICK_S)
        plant.step(current_a, TICK_S)
        changes_c.append(plant.skin_c - rest_c)
    by_then_c = [changes_c[_ticks(LEAD_S + at_s) - 1] for at_s in AT_S]
    goals_c = [_real_c(contact, at_s + AHEAD_S) for at_s in AT_S]
    return [
        way * min(way * change_c, way * goal_c)
        for change_c, goal_c in zip(by_then_c, goals_c, strict=True)
    ]


class _Session:
    """A session's rendering of heat, and its line to a simulated plate."""

    def __init__(self) -> None:
        self.now = 0.0
        self.trajectory = ThermalTrajectory(plate_resistance=PALM)
        self._plate = SimulatedPlate(ROOM_C, palm_resistance=PALM, bead_lag_s=BEAD_LAG_S)
        self._setpoint_c = NEUTRAL_C

    def live(self, seconds: float) -> float:
        """Render for `seconds` and return the skin, degC."""
        for _ in range(_ticks(seconds)):
            reading = self._plate.advance(self.now)
            wanted_c = self.trajectory.target_c(self.now)
            limited = limits.limit(wanted_c, self._setpoint_c, TICK_S, reading)
            self._setpoint_c = limited.setpoint_c
            self._plate.command(self._setpoint_c, LEASE_S, self.now)
            self.now += TICK_S
        self._plate.advance(self.now)
        return self._plate.skin_c


def _rest(plant: Plant) -> float:
    """Hold a plate at neutral until the skin rests, and return the current, A."""
    current_a = 0.0
    for _ in range(_ticks(REST_S)):
        current_a += 0.1 * (NEUTRAL_C - plant.plate_c) * TICK_S
        plant.step(current_a + NEUTRAL_C - plant.plate_c, TICK_S)
    return current_a


def _real_c(contact: ThermalContact, at_s: float) -> float:
    return share(contact, at_s) * (contact.surface_c - contact.skin_c)


def _ticks(seconds: float) -> int:
    return round(seconds / TICK_S)


def _at(values: Iterable[float]) -> tuple[float, float]:
    first, last = values
    return round(first, 3), round(last, 3)


def show(rows: Sequence[FirstSecond]) -> None:
    """Print a table."""
    print(
        "share of a real object's change of the skin "
        f"{AT_S[0]:g} and {AT_S[1]:g} s after contact, simulated plate"
    )
    print(f"{'material':<12} {'object':>7} {'real, degC':>13}", end="")
    print(f" {'product':>13} {'most':>13} {'product/most':>13}")
    for row in rows:
        shares = (row.product, row.most)
        cells = " ".join(f"{first:>5.0%} / {last:>5.0%}" for first, last in shares)
        over = " / ".join(f"{ratio:.2f}" for ratio in row.product_over_most)
        real = " / ".join(f"{change_c:+.2f}" for change_c in row.real_c)
        print(f"{row.material:<12} {row.object_c:>5g} C {real:>13} {cells} {over:>13}")
