"""The strength that a controller is told to vibrate with: every material, struck and slid over.

For a blow it is the strongest value of the plan that is sent at the onset, for a slide the mean of
half a second. 1 is the strongest vibration of a controller. These are the values that are sent;
nobody has felt them.
"""

from __future__ import annotations

import json

from hapticvlm.materials import MATERIALS
from hapticvlm.rendering.vibration.controller_scale import Form
from hapticvlm.rendering.vibration.vibration import Motion
from hapticvlm.rendering.vibration.vibration_plan import PERIOD_S, VibrationPlan, VibrationPlanner
from hapticvlm.rendering.vibration.voices import Command

BLOWS = {"tap": Motion(0.3, 1.5), "strike": Motion(1.0, 4.0), "press": Motion(0.05, 2.0)}
SLIDES_MPS = (0.1, 0.3, 1.0)
SLIDE_N = 1.5
SETTLED_S = 0.3  # a slide has its full strength by then
SHOWN_S = 0.5
RENEWAL_S = 0.04  # a plan each 40 ms, as the service sends them
LEASE_S = 0.25


def amplitudes(material: str, form: Form) -> dict[str, float]:
    """Return the value that is played of each blow and slide, 0..1."""
    planner = VibrationPlanner({material: MATERIALS[material]})
    blows = {kind: max(_blow(planner, material, kind, form).amplitude) for kind in BLOWS}
    return blows | {
        f"slide {speed} m/s": _slide(planner, material, speed, form) for speed in SLIDES_MPS
    }


def _blow(planner: VibrationPlanner, material: str, kind: str, form: Form) -> VibrationPlan:
    planner.rest()
    planner.apply(Command(1, material, kind, True, BLOWS[kind], 1, 1.0 + LEASE_S), 1.0)
    return planner.plan(form, 1.0)


def _slide(planner: VibrationPlanner, material: str, speed_mps: float, form: Form) -> float:
    """Return the mean of each plan until the next one replaces it."""
    planner.rest()
    motion = Motion(speed_mps, SLIDE_N)
    played: list[float] = []
    for step in range(round((SETTLED_S + SHOWN_S) / RENEWAL_S)):
        now = 1.0 + step * RENEWAL_S
        planner.apply(Command(1, material, "slide", step == 0, motion, 1, now + LEASE_S), now)
        if now - 1.0 >= SETTLED_S:
            played += planner.plan(form, now).amplitude[: round(RENEWAL_S / PERIOD_S[form])]
    return round(sum(played) / len(played), 4)


def main() -> None:
    """Print a row for each material, and all of it as one line of JSON."""
    strengths = {material: amplitudes(material, "amplitude") for material in MATERIALS}
    columns = next(iter(strengths.values()))
    print("material", *columns, sep=" | ")
    for material, row in strengths.items():
        print(material, *(f"{value:.2f}" for value in row.values()), sep=" | ")
    print(json.dumps(strengths))


if __name__ == "__main__":
    main()
