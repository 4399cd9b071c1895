"""The trial of `stability thermal` that separates memories: a slide from metal to aluminium.

What the metal left in the skin fades while the aluminium takes its share of it.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from hapticvlm.materials import MATERIALS
from hapticvlm.rendering.thermal import ThermalContact, thermal_contact
from hapticvlm_lab.bench.thermal.breaks import ALUMINIUM, FRAME_S, Trial
from hapticvlm_lab.bench.thermal.grids import Floats
from hapticvlm_lab.bench.thermal.methods import Closed, Forgetful, Skin
from hapticvlm_lab.bench.thermal.reference import SETTLED_S, Stage, skin_surface
from hapticvlm_lab.bench.thermal.traces import Traced

PERCEPTIBLE_C = 0.1  # degC, what a slide may err by: the cool threshold (docs/physics.md 1.3)
SLIDE_S = 6.0


def slides() -> list[Trial]:
    """Slide from metal to aluminium, whose skin has lost most and goes on losing."""
    begun = [thermal_contact(bulk, 22.0) for bulk in (MATERIALS["metal"].thermal, ALUMINIUM)]
    exact = skin_surface([Stage(0.0, begun[0]), Stage(1.0, begun[1])], SLIDE_S)
    trials = []
    for name, begin in (
        ("begun anew from the surface", Forgetful),
        ("a trace per contact", Traced),
        ("closed form with memory (default)", Closed),
    ):
        found_c = _slid(begin(FRAME_S), begun)
        times = FRAME_S * np.arange(1, found_c.size + 1)
        off_c = np.abs(found_c - np.interp(times, exact[:, 0], exact[:, 1]))
        worst_c = float(off_c[np.abs(times - 1.0) > SETTLED_S].max())
        found = f"worst error {worst_c:.2g} degC, mark {PERCEPTIBLE_C:g}"
        trials.append(Trial(f"metal > aluminium, {name}", found, worst_c > PERCEPTIBLE_C))
    return trials


def _slid(skin: Skin, begun: Sequence[ThermalContact]) -> Floats:
    """Skin surface at every frame of SLIDE_S on these, a second on each but the last, (N,) degC."""
    followed = []
    for turn, contact in enumerate(begun):
        skin.touch(contact)
        last = turn == len(begun) - 1
        stays_s = SLIDE_S - turn if last else 1.0
        followed += [skin.step() for _ in range(round(stays_s / FRAME_S))]
    return np.array(followed)
