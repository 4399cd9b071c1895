"""`hapticvlm chart thermal`: the error of each method to follow the skin, against its cost.

When a palm meets an object, both behave like thick bodies: heat flows between them through the
contact resistance R'', and the surface of the skin approaches the contact temperature

    (e_skin T_skin + e_object T_object) / (e_skin + e_object),   e = sqrt(k rho c)

along 1 - erfcx(sqrt(t) (1 / e_skin + 1 / e_object) / R''). This closed form is exact for skin that
is equally warm at every depth. Skin that has just left another object is not: it has lost heat to
some depth, and goes on cooling or rewarming while it touches the next one. The product therefore
carries that history along (rendering/heat/history.py); a method that does not is called forgetful
here.

Each method follows two kinds of touch. One contact of ten seconds, over materials, contact
resistances and frame rates, is compared with a quadrature of the closed form. Hands that slide from
object to object are compared with finite differences. The worst error counts, since a palm notices
the worst moment and not the average.

Beside it, `first_second.py` compares the plate's first second with the best controller's.

Methods on grids of cells, sums of exponentials and one trace for each contact were measured and
rejected; hapticvlm_lab/LOG.md keeps their figures.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, replace
from itertools import permutations
from pathlib import Path
from typing import TYPE_CHECKING, Protocol

import numpy as np
from thermal_reference import (
    Floats,
    Stage,
    contact_surface,
    sharp,
    skin_surface,
)

from hapticvlm.commands.progress import track
from hapticvlm.materials import MATERIALS, Thermal
from hapticvlm.palette import GREEN, GREY, INK, SOFT
from hapticvlm.perception import NEUTRAL_C, THERMAL_FLOOR_C
from hapticvlm.rendering.heat.contact import (
    ThermalContact,
    contact_temperature_c,
    skin_surface_c,
    thermal_contact,
)
from hapticvlm.rendering.heat.trajectory import ThermalTrajectory
from hapticvlm_lab.bench import figures
from hapticvlm_lab.bench.printing import made_with, publish
from hapticvlm_lab.bench.rigs import core_us
from hapticvlm_lab.bench.thermal import first_second, plate_term

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
STEPS_A_TOUCH = 50  # a touch of one second: its share of setting up is charged to each step
ROUNDS = 25
STEPS = 200
SETUPS = 7

SIZE_IN = (12.0, 5.0)
DPI = 80
PANELS = (("felt_c", "one contact of 10 s"), ("slide_c", "slides from object to object"))
LOWEST_C = 1e-3  # an error that is smaller is drawn here


class Skin(Protocol):
    """Skin that starts at NEUTRAL_C; one step is one frame."""

    def touch(self, contact: ThermalContact) -> None:
        """Meet this object from now on: the cost of setting up."""

    def step(self) -> float:
        """Return the surface temperature one frame later, degC."""


@dataclass(frozen=True, slots=True)
class Method:
    """A method by its name in the chart; `begin` takes the length of a frame in seconds."""

    name: str
    begin: Callable[[float], Skin]
    is_default: bool = False


class Closed:
    """The product: the closed form, with the heat that earlier contacts took from the skin."""

    def __init__(self, frame_s: float) -> None:
        self._frame_s = frame_s
        self._now = 0.0
        self._count = 0
        self._trajectory = ThermalTrajectory(lead_s=0.0)

    def touch(self, contact: ThermalContact) -> None:
        """Slide to this object."""
        self._count += 1
        self._trajectory = self._trajectory.touch(contact, self._count, self._now)

    def step(self) -> float:
        """Return the skin temperature of the trajectory."""
        self._now += self._frame_s
        return self._trajectory.skin_c(self._now)


class Forgetful:
    """The closed form restarted at each contact, as if skin were equally warm inside."""

    def __init__(self, frame_s: float) -> None:
        self._frame_s = frame_s
        self._elapsed_s = 0.0
        self._skin_c = NEUTRAL_C
        self._contact: ThermalContact | None = None

    def touch(self, contact: ThermalContact) -> None:
        """Restart from the present surface temperature."""
        self._contact = replace(contact, skin_c=self._skin_c)
        self._elapsed_s = 0.0

    def step(self) -> float:
        """Evaluate the closed form."""
        assert self._contact is not None
        self._elapsed_s += self._frame_s
        self._skin_c = skin_surface_c(self._contact, self._elapsed_s)
        return self._skin_c


class Constant:
    """The contact temperature at once: the cheapest answer, and the floor for all others."""

    def __init__(self, frame_s: float) -> None:
        del frame_s
        self._skin_c = NEUTRAL_C

    def touch(self, contact: ThermalContact) -> None:
        """Meet skin at rest: a method without time has no history either."""
        self._skin_c = contact_temperature_c(contact)

    def step(self) -> float:
        """Return the same temperature again."""
        return self._skin_c


METHODS = (
    Method("contact temperature", Constant),
    Method("closed form, forgetful", Forgetful),
    Method("closed form", Closed, is_default=True),
)


@dataclass(frozen=True, slots=True)
class Row:
    """One method: worst errors in degC with the case that has them, and its cost in us of a core.

    `felt_c` is the worst on one contact, `slide_c` over slides; `step_us` and `setup_us` are
    medians, `touch_us` is a step of a touch of one second with its share of setting up, and
    `floors` is that over a bare evaluation of the closed form in the same run.
    """

    method: str
    is_default: bool
    felt_c: float
    felt_at: str
    slide_c: float
    slide_at: str
    step_us: float
    setup_us: float
    touch_us: float
    floors: float


def run(out: Path, *, as_json: bool) -> int:
    """Measure, print a table or JSON, write pictures and JSON."""
    rows = measure()
    files = draw(rows, out / NAME)
    terms = plate_term.run(out)
    touches = first_second.measure()
    report = {
        "chart": "thermal",
        **made_with(),
        "floor": "one evaluation of the closed form, nothing around it",
        "floor_c": [FINEST_C, THERMAL_FLOOR_C],
        "default": sentence(rows),
        "rows": [asdict(row) for row in rows],
        "plate_terms": [asdict(row) for row in terms],
        "first_second": [asdict(row) for row in touches],
        "files": [str(path) for path in files],
    }

    def show() -> None:
        _print(rows)
        plate_term.show(terms)
        first_second.show(touches)

    return publish(out / f"{NAME}.json", report, as_json=as_json, show=show)


def measure(methods: Sequence[Method] = METHODS) -> list[Row]:
    """Compare every method with the yardsticks, and time it."""
    slides = [
        (stages, truth(stages)) for stages in map(_stages, track(SLIDES, "computing the reference"))
    ]
    return [_row(method, slides) for method in track(methods, "measuring every method")]


def truth(stages: Sequence[Stage]) -> Floats:
    """Follow a slide by finite differences: rows of time and skin surface, (N, 2)."""
    return skin_surface(stages, stages[-1].begins_at + SLIDE_TAIL_S)


def contact_error(method: Method, contact: ThermalContact, rate_hz: int) -> float:
    """Return the worst error over the frames of one contact, degC."""
    skin = method.begin(1.0 / rate_hz)
    skin.touch(contact)
    times = np.arange(1, round(SECONDS * rate_hz) + 1) / rate_hz
    followed_c = np.array([skin.step() for _ in times])
    return float(np.abs(followed_c - contact_surface(contact, times)).max())


def slide_error(method: Method, stages: Sequence[Stage], known: Floats, rate_hz: int) -> float:
    """Return the worst error over the frames of a slide, degC.

    Frames just after a change are left out: finite differences cannot be trusted there.
    """
    # A frame that begins before a contact must not feel it yet, and rounding could put a contact at
    # 1.0 s just after the frame at 1.0 s: hence the small margin.
    skin = method.begin(1.0 / rate_hz)
    waiting = list(stages)
    times = np.arange(1, round(known[-1, 0] * rate_hz) + 1) / rate_hz
    followed_c = []
    for time_s in times:
        if waiting and waiting[0].begins_at < time_s - 1e-9:
            contact = waiting.pop(0).contact
            assert contact is not None
            skin.touch(contact)
        followed_c.append(skin.step())
    exact_c = np.interp(times, known[:, 0], known[:, 1])
    return float(np.abs(followed_c - exact_c)[sharp(times, stages)].max())


def sentence(rows: Sequence[Row]) -> str:
    """Name the cheapest method whose error nobody can feel, and whether the product uses it."""
    # Of two methods whose errors nobody can feel, the more exact one is not the better one.
    good = [row for row in rows if max(row.felt_c, row.slide_c) < FINEST_C]
    if not good:
        return "no method is below the floor"
    best = min(good, key=lambda row: row.touch_us)
    kind = "the default" if best.is_default else "NOT the default"
    return (
        f"cheapest below {FINEST_C:g} degC on one contact and on slides: "
        f"{best.method} ({kind}), {best.touch_us:.1f} us a step"
    )


def _row(method: Method, slides: Sequence[tuple[Sequence[Stage], Floats]]) -> Row:
    contacts_c = {
        f"{name}, R'' {resistance:g}, {rate_hz} Hz": contact_error(
            method, thermal_contact(bulk, OBJECT_C, contact_resistance=resistance), rate_hz
        )
        for name, bulk in BULKS.items()
        for resistance in RESISTANCES
        for rate_hz in RATES_HZ
    }
    slides_c = {
        f"{_title(slide)}, {rate_hz} Hz": slide_error(method, stages, known, rate_hz)
        for slide, (stages, known) in zip(SLIDES, slides, strict=True)
        for rate_hz in RATES_HZ
    }
    step_us, setup_us, floor_us = _cost(method)
    touch_us = step_us + setup_us / STEPS_A_TOUCH
    felt_at = max(contacts_c, key=contacts_c.__getitem__)
    slide_at = max(slides_c, key=slides_c.__getitem__)
    return Row(
        method=method.name,
        is_default=method.is_default,
        felt_c=contacts_c[felt_at],
        felt_at=felt_at,
        slide_c=slides_c[slide_at],
        slide_at=slide_at,
        step_us=round(step_us, 3),
        setup_us=round(setup_us, 1),
        touch_us=round(touch_us, 3),
        floors=round(touch_us / floor_us, 2),
    )


def _cost(method: Method) -> tuple[float, float, float]:
    """Return the median us of a core of a step, of setting up, and of the bare closed form.

    Metal is touched before glass, so that there is a history to carry. Steps and floor take turns,
    so that a machine that slows down slows both.
    """
    first, second = (thermal_contact(MATERIALS[name].thermal, 22.0) for name in ("metal", "glass"))
    # Setting up is timed in place, one contact after another, since its cost depends on the history
    # so far. A step is so short that reading the clock would count: STEPS of them are timed at
    # once.
    skin = method.begin(TICK_S)
    skin.touch(first)
    setups = []
    for turn in range(SETUPS + 1):
        skin.step()
        contact = second if turn % 2 == 0 else first
        setups.append(core_us(lambda contact=contact: skin.touch(contact)))  # type: ignore[misc]
    floors = []
    steps = []
    for _ in range(ROUNDS):
        floors.append(core_us(lambda: skin_surface_c(second, 1.0), STEPS))
        steps.append(core_us(skin.step, STEPS))
    return float(np.median(steps)), float(np.median(setups)), float(np.median(floors))


def _stages(slide: Slide) -> list[Stage]:
    names, each_s, resistance = slide
    return [
        Stage(turn * each_s, thermal_contact(BULKS[name], OBJECT_C, contact_resistance=resistance))
        for turn, name in enumerate(names)
    ]


def _title(slide: Slide) -> str:
    names, each_s, resistance = slide
    kind = "default" if resistance is None else f"{resistance:g}"
    return f"{' > '.join(names)}, {each_s:g} s each, R'' {kind}"


def _print(rows: Sequence[Row]) -> None:
    print(f"worst error, degC, at 10 degC of contrast; floors {FINEST_C:g} and {THERMAL_FLOOR_C:g}")
    print(f"{'method':<28} {'contact':>9} {'slides':>9} {'step us':>8} {'set-up us':>10}", end="")
    print(f" {'touch us':>9} {'floors':>7}")
    for row in rows:
        mark = " (default)" if row.is_default else ""
        print(f"{row.method:<28} {_degrees(row.felt_c):>9} {_degrees(row.slide_c):>9}", end="")
        print(f" {row.step_us:>8.2f} {row.setup_us:>10.1f} {row.touch_us:>9.2f}", end="")
        print(f" {row.floors:>7.1f}{mark}")
    print(sentence(rows))


def _degrees(error_c: float) -> str:
    return f"{error_c:.1e}" if error_c < LOWEST_C else f"{error_c:.3f}"


def draw(rows: Sequence[Row], stem: Path) -> list[Path]:
    """Draw error against cost into `stem`.png and .svg; return both."""
    reason = sentence(rows)
    with figures.figure(stem, SIZE_IN, 2, dpi=DPI, sharey=True) as (drawn, panels):
        figures.title(drawn, f"Temperature of the skin: {reason}.")
        panels[0].set_ylabel("worst error of the skin's surface, degC (10 degC of contrast)")
        for axes, (field, name) in zip(panels, PANELS, strict=True):
            _panel(axes, rows, field)
            axes.set_title(name)
    return figures.files(stem)


def _panel(axes: Axes, rows: Sequence[Row], field: str) -> None:
    dots = [(row.touch_us, max(float(getattr(row, field)), LOWEST_C)) for row in rows]
    for row, dot in zip(rows, dots, strict=True):
        axes.plot(*dot, "o", color=GREEN if row.is_default else GREY, markersize=8, zorder=4)
        if row.is_default:
            figures.ring(axes, *dot)
    figures.level(axes, FINEST_C, f"cool floor {FINEST_C:g}")
    figures.level(axes, THERMAL_FLOOR_C, f"warm floor {THERMAL_FLOOR_C:g}")
    axes.axvline(5.0, color=SOFT, linewidth=0.8, linestyle=":", zorder=1)
    axes.set(xscale="log", yscale="log", ylim=(LOWEST_C / 1.6, 40.0))
    axes.set_xlim(figures.span([x for x, _ in dots], 2.0, 6.0))
    axes.set_xlabel("us a step, setting up spread over a touch of one second (dotted: 5 us)")
    labels = []
    for row, (x, y) in zip(rows, dots, strict=True):
        error = "below 0.001" if y == LOWEST_C else f"{y:.2g}"
        labels.append((x, y, f"{row.method}: {error} degC", INK))
    figures.place(axes, labels, dots)
