"""`hapticvlm stability thermal`: where each method to follow the skin, or the plate, breaks.

Each row is one trial: what was tried, what should happen by theory, what did, and whether the
product's own method survives the same trial (docs/physics.md 1.4). The picture shows four of them.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

from hapticvlm.commands.progress import track
from hapticvlm.materials import MATERIALS
from hapticvlm.rendering.heat.contact import ThermalContact, thermal_contact
from hapticvlm_lab.bench.printing import made_with, publish
from hapticvlm_lab.bench.thermal import breaks, breaks_plot
from hapticvlm_lab.bench.thermal.breaks import ALUMINIUM, FRAME_S, Trial
from hapticvlm_lab.bench.thermal.grids import Floats
from hapticvlm_lab.bench.thermal.methods import Closed, Forgetful, Skin
from hapticvlm_lab.bench.thermal.reference import SETTLED_S, Stage, skin_surface
from hapticvlm_lab.bench.thermal.traces import Traced

PERCEPTIBLE_C = 0.1  # degC, what a slide may err by: the cool threshold (docs/physics.md 1.3)
SLIDE_S = 6.0
NAME = "stability-thermal"


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


@dataclass(frozen=True, slots=True)
class Group:
    """Trials of one kind under the sentence on what they show."""

    title: str
    trials: tuple[Trial, ...]


_GROUPS: tuple[tuple[str, Callable[[], Sequence[Trial]]], ...] = (
    ("explicit Euler, cells of 0.1 mm: stable below dx^2 / 2a only", breaks.explicit_euler),
    ("a stiff contact: Crank-Nicolson rings, backward Euler does not", breaks.ringing),
    ("exp(x^2) erfc(x) overflows where erfcx does not", breaks.overflow),
    ("contact resistance 0, tiny, huge, infinite", breaks.resistances),
    ("a slide to another object: what is left in the skin goes into it too", slides),
    ("a PI loop asked for what it cannot reach for 30 s, then released", breaks.windup),
    ("fast and slow parts in one system: implicit or exact steps only", breaks.stiffness),
    ("what is no number", breaks.no_numbers),
)


def run(out: Path, *, as_json: bool) -> int:
    """Try everything, print tables or JSON, write picture and JSON."""
    groups = measure()
    files = breaks_plot.draw(out / NAME)
    figures = {
        "stability": "thermal",
        **made_with(),
        "groups": [asdict(group) for group in groups],
        "files": [str(path) for path in files],
    }
    return publish(out / f"{NAME}.json", figures, as_json=as_json, show=lambda: _print(groups))


def measure() -> list[Group]:
    """Try every group."""
    with np.errstate(all="ignore"):
        tried = track(_GROUPS, "trying what may break")
        return [Group(title, tuple(attempt())) for title, attempt in tried]


def _print(groups: Sequence[Group]) -> None:
    for group in groups:
        print(f"\n{group.title}")
        for trial in group.trials:
            verdict = "breaks" if trial.breaks else "holds"
            print(f"  {verdict:<7} {trial.what:<58} {trial.found}")
