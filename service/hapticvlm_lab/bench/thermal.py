"""`hapticvlm chart thermal`: the error of each method to follow the skin, against its cost.

When a palm meets an object, both behave like thick bodies: heat flows between them through the
contact resistance R'', and the surface of the skin approaches the contact temperature

    (e_skin T_skin + e_object T_object) / (e_skin + e_object),   e = sqrt(k rho c)

along 1 - erfcx(sqrt(t) (1 / e_skin + 1 / e_object) / R''). This closed form is exact for skin that
is equally warm at every depth. Skin that has just left another object is not: it has lost heat to
some depth, and goes on cooling or rewarming while it touches the next one. The product therefore
carries that history along (rendering/heat/history.py); a method that does not is forgetful.

Each method follows two kinds of touch. One contact of ten seconds, over materials, contact
resistances and frame rates, is compared with a quadrature of the closed form. Hands that slide from
object to object are compared with finite differences. The worst error counts, since a palm notices
the worst moment and not the average.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from functools import partial
from itertools import permutations
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from thermal_reference import Floats, Stage, contact_surface, sharp, skin_surface

from hapticvlm.commands.progress import track
from hapticvlm.materials import MATERIALS, Thermal
from hapticvlm.palette import GREEN, GREY, INK
from hapticvlm.perception import NEUTRAL_C, THERMAL_FLOOR_C
from hapticvlm.rendering.heat.contact import (
    ThermalContact,
    contact_temperature_c,
    skin_surface_c,
    thermal_contact,
)
from hapticvlm.rendering.heat.trajectory import ThermalTrajectory
from hapticvlm_lab.bench import figures
from hapticvlm_lab.bench.printing import publish
from hapticvlm_lab.bench.rigs import least_us

if TYPE_CHECKING:
    from matplotlib.axes import Axes

NAME = "chart-thermal"
FINEST_C = 0.1  # degC, cool threshold at the thenar (docs/physics.md 1.3)
OBJECT_C = 22.0
SECONDS = 10.0
RATES_HZ = (20, 60, 90)
RESISTANCES = (0.0, 1e-5, 1e-4, 5e-4, 2.5e-3, 1e-2)  # m2 K/W
BULKS = {name: material.thermal for name, material in MATERIALS.items()} | {
    "aluminium": Thermal(167, 2700, 896)
}
Slide = tuple[tuple[str, ...], float, float | None]
SLIDES: tuple[Slide, ...] = (
    # materials in order, seconds on each, contact resistance (None: the material's own)
    *(
        (pair, 1.0, None)
        for pair in permutations(("metal", "aluminium", "glass", "wood", "fabric"), 2)
    ),
    (("aluminium", "fabric"), 5.0, 1e-4),
    (("aluminium", "paper"), 5.0, 1e-5),
    (("glass", "fabric"), 0.5, 0.0),
    (("metal", "metal"), 0.1, 5e-4),
    (("fabric", "aluminium"), 5.0, 1e-2),
    (("wood", "glass"), 0.1, 2.5e-3),
    (("metal", "wood", "metal", "fabric", "metal"), 0.5, 0.0),
    (("metal", "wood", "metal", "fabric", "metal"), 0.5, None),
)
SLIDE_TAIL_S = 5.0
TICK_S = 0.02  # how often the service asks for a setpoint
TIMED: Slide = (("metal", "glass", "metal", "glass"), 1.0, None)  # there is a history to carry
ROUNDS = 25

PANELS = (("contact_c", "one contact of 10 s"), ("slide_c", "slides from object to object"))
LOWEST_C = 1e-3  # an error that is smaller is drawn here

# Contacts in order and the times of frames, s, to the surface of the skin at these, degC. The skin
# is at NEUTRAL_C before the first contact.
Follow = Callable[[Sequence[Stage], Floats], Floats]


@dataclass(frozen=True, slots=True)
class Method:
    """A method by its name in the chart."""

    name: str
    follow: Follow
    is_default: bool = False


@dataclass(frozen=True, slots=True)
class Row:
    """One method: worst errors on one contact and over slides, degC, and its cost.

    `step_us` is the time of a core for one frame, with its share of what a new contact costs at
    one contact a second.
    """

    method: str
    is_default: bool
    contact_c: float
    slide_c: float
    step_us: float


def with_memory(stages: Sequence[Stage], times: Floats) -> Floats:
    """Follow as the product does: with the heat that earlier contacts took from the skin."""
    trajectory = ThermalTrajectory(lead_s=0.0)
    skin_c: list[float] = []
    for contact, begins_at, frames in _touches(stages, times):
        trajectory = trajectory.touch(contact, begins_at, begins_at)
        skin_c += [trajectory.skin_c(time_s) for time_s in frames]
    return np.array(skin_c)


def forgetful(stages: Sequence[Stage], times: Floats) -> Floats:
    """Restart the closed form at each contact, as if skin were equally warm inside."""
    skin_c: list[float] = []
    for contact, begins_at, frames in _touches(stages, times):
        started = replace(contact, skin_c=skin_c[-1] if skin_c else NEUTRAL_C)
        skin_c += [skin_surface_c(started, time_s - begins_at) for time_s in frames]
    return np.array(skin_c)


def at_once(stages: Sequence[Stage], times: Floats) -> Floats:
    """Take the contact temperature of skin at rest: the cheapest answer."""
    skin_c: list[float] = []
    for contact, _, frames in _touches(stages, times):
        skin_c += [contact_temperature_c(contact)] * len(frames)
    return np.array(skin_c)


def _touches(
    stages: Sequence[Stage], times: Floats
) -> Iterator[tuple[ThermalContact, float, list[float]]]:
    """Yield each contact, its begin, and the frames after that until the next one begins."""
    # A frame at the moment of a contact does not feel it yet. Rounding could put a contact at 1.0 s
    # just before or after the frame at 1.0 s: hence the small margin.
    ends_s = [stage.begins_at for stage in stages[1:]] + [math.inf]
    for stage, end_s in zip(stages, ends_s, strict=True):
        assert stage.contact is not None
        within = (times > stage.begins_at + 1e-9) & (times <= end_s + 1e-9)
        yield stage.contact, stage.begins_at, times[within].tolist()


METHODS = (
    Method("contact temperature", at_once),
    Method("closed form, forgetful", forgetful),
    Method("closed form", with_memory, is_default=True),
)


def run(out: Path, *, as_json: bool) -> int:
    """Measure, print a table or JSON, write picture and JSON."""
    rows = measure()
    report = {
        "chart": "thermal",
        "floor_c": [FINEST_C, THERMAL_FLOOR_C],
        "default": sentence(rows),
        "rows": [asdict(row) for row in rows],
    }
    files = draw(rows, out / NAME)
    return publish(out / NAME, report, files, as_json=as_json, show=lambda: _print(rows))


def measure(methods: Sequence[Method] = METHODS) -> list[Row]:
    """Compare every method with the yardsticks, and time it."""
    slides = [
        (stages, truth(stages)) for stages in map(staged, track(SLIDES, "computing the reference"))
    ]
    contacts = [
        thermal_contact(bulk, OBJECT_C, contact_resistance=resistance)
        for bulk in BULKS.values()
        for resistance in RESISTANCES
    ]
    step_us = _step_us(methods)
    return [
        Row(
            method.name,
            method.is_default,
            max(contact_error(method, contact, hz) for contact in contacts for hz in RATES_HZ),
            max(slide_error(method, *slide, hz) for slide in slides for hz in RATES_HZ),
            step_us[method.name],
        )
        for method in track(methods, "measuring every method")
    ]


def staged(slide: Slide) -> list[Stage]:
    """Return the contacts of a slide in their order."""
    names, each_s, resistance = slide
    return [
        Stage(turn * each_s, thermal_contact(BULKS[name], OBJECT_C, contact_resistance=resistance))
        for turn, name in enumerate(names)
    ]


def truth(stages: Sequence[Stage]) -> Floats:
    """Follow a slide by finite differences: rows of time and skin surface, (N, 2)."""
    return skin_surface(stages, stages[-1].begins_at + SLIDE_TAIL_S)


def contact_error(method: Method, contact: ThermalContact, rate_hz: int) -> float:
    """Return the worst error over the frames of one contact, degC."""
    times = _frames(SECONDS, rate_hz)
    followed_c = method.follow([Stage(0.0, contact)], times)
    return float(np.abs(followed_c - contact_surface(contact, times)).max())


def slide_error(method: Method, stages: Sequence[Stage], known: Floats, rate_hz: int) -> float:
    """Return the worst error over the frames of a slide, degC.

    Frames just after a change are left out: finite differences cannot be trusted there.
    """
    times = _frames(known[-1, 0], rate_hz)
    exact_c = np.interp(times, known[:, 0], known[:, 1])
    return float(np.abs(method.follow(stages, times) - exact_c)[sharp(times, stages)].max())


def _frames(seconds: float, rate_hz: float) -> Floats:
    return np.arange(1, round(seconds * rate_hz) + 1) / rate_hz


def _step_us(methods: Sequence[Method]) -> dict[str, float]:
    """Return us of a core for a frame by the method's name."""
    stages = staged(TIMED)
    times = _frames(stages[-1].begins_at + 1.0, 1.0 / TICK_S)
    works = {method.name: partial(method.follow, stages, times) for method in methods}
    return {name: round(us / times.size, 3) for name, us in least_us(works, ROUNDS).items()}


def sentence(rows: Sequence[Row]) -> str:
    """Name the cheapest method whose error nobody can feel, and whether the product uses it."""
    # Of two methods whose errors nobody can feel, the more exact one is not the better one.
    good = [row for row in rows if max(row.contact_c, row.slide_c) < FINEST_C]
    if not good:
        return "no method is below the floor"
    best = min(good, key=lambda row: row.step_us)
    kind = "the default" if best.is_default else "NOT the default"
    return (
        f"cheapest below {FINEST_C:g} degC on one contact and on slides: "
        f"{best.method} ({kind}), {best.step_us:.1f} us a step"
    )


def _print(rows: Sequence[Row]) -> None:
    print(f"worst error, degC, at 10 degC of contrast; floors {FINEST_C:g} and {THERMAL_FLOOR_C:g}")
    print(f"{'method':<28} {'contact':>9} {'slides':>9} {'step us':>8}")
    for row in rows:
        mark = " (default)" if row.is_default else ""
        print(f"{row.method:<28} {_degrees(row.contact_c):>9} {_degrees(row.slide_c):>9}", end="")
        print(f" {row.step_us:>8.2f}{mark}")
    print(sentence(rows))


def _degrees(error_c: float) -> str:
    return f"{error_c:.1e}" if error_c < LOWEST_C else f"{error_c:.3f}"


def draw(rows: Sequence[Row], stem: Path) -> list[Path]:
    """Draw error against cost into `stem`.png and .svg; return both."""
    with figures.figure(stem, (12.0, 5.0), 2, dpi=80, sharey=True) as (drawn, panels):
        figures.title(drawn, f"Temperature of the skin: {sentence(rows)}.")
        panels[0].set_ylabel("worst error of the skin's surface, degC (10 degC of contrast)")
        for axes, (field, name) in zip(panels, PANELS, strict=True):
            _panel(axes, rows, field)
            axes.set_title(name)
    return figures.files(stem)


def _panel(axes: Axes, rows: Sequence[Row], field: str) -> None:
    dots = [(row.step_us, max(float(getattr(row, field)), LOWEST_C)) for row in rows]
    for row, dot in zip(rows, dots, strict=True):
        axes.plot(*dot, "o", color=GREEN if row.is_default else GREY, markersize=8, zorder=4)
        if row.is_default:
            figures.ring(axes, *dot)
    figures.level(axes, FINEST_C, f"cool floor {FINEST_C:g}")
    figures.level(axes, THERMAL_FLOOR_C, f"warm floor {THERMAL_FLOOR_C:g}")
    axes.set(xscale="log", yscale="log", ylim=(LOWEST_C / 1.6, 40.0))
    axes.set_xlim(figures.span([x for x, _ in dots]))
    axes.set_xlabel("us a step, at one contact a second")
    labels = [
        (x, y, f"{row.method}: {_degrees(getattr(row, field))} degC", INK)
        for row, (x, y) in zip(rows, dots, strict=True)
    ]
    figures.place(axes, labels, dots)
