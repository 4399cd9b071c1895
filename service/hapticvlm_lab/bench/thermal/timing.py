"""What a step costs: median over rounds, each in turn with a bare evaluation of the closed form."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hapticvlm.materials import MATERIALS
from hapticvlm.rendering.heat.contact import skin_surface_c, thermal_contact
from hapticvlm_lab.bench.rigs import core_us
from hapticvlm_lab.bench.thermal.methods import Method

TICK_S = 0.02  # how often the service asks
STEPS_A_TOUCH = 50  # a touch of one second
ROUNDS = 25
STEPS = 200
SETUPS = 7


@dataclass(frozen=True, slots=True)
class Cost:
    """Medians in us of a core; see chart.Row."""

    step_us: float
    setup_us: float
    touch_us: float
    floors: float


def cost(method: Method) -> Cost:
    """Time one method on glass after metal, so that there is a past to carry."""
    first, second = (thermal_contact(MATERIALS[name].thermal, 22.0) for name in ("metal", "glass"))
    skin = method.begin(TICK_S)
    skin.touch(first)
    skin.step()
    setups = [core_us(lambda: skin.touch(second), 1)]
    for turn in range(SETUPS):
        skin.step()
        again = first if turn % 2 == 0 else second
        setups.append(core_us(lambda contact=again: skin.touch(contact), 1))  # type: ignore[misc]
    floors = []
    steps = []
    for _ in range(ROUNDS):
        floors.append(core_us(lambda: skin_surface_c(second, 1.0), STEPS))
        steps.append(core_us(skin.step, STEPS))
    step_us = float(np.median(steps))
    setup_us = float(np.median(setups))
    touch_us = step_us + setup_us / STEPS_A_TOUCH
    floor_us = float(np.median(floors))
    return Cost(
        round(step_us, 3), round(setup_us, 1), round(touch_us, 3), round(touch_us / floor_us, 2)
    )
