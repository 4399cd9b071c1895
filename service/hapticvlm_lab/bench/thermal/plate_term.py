"""The allowance for the resistance between palm and plate: error of the skin against cost.

A plate that cools skin to 30 degC has to be colder than that itself: the heat that flows from palm
to plate passes the resistance R between them, and the skin lags the plate by R times that flow
(docs/physics.md 1.1). The product adds this term to the temperature that it wants of the skin.

The chart isolates the error of the term. The plate here follows its setpoint at once and nothing
limits it, so that neither driver nor module counts. The skin on such a plate is computed exactly: a
setpoint held for a frame is a step, and a step of height h moves the skin by h (1 - erfcx(sqrt(t) /
(e_skin R))), so the skin is the sum over all steps so far. Heat from the core of the hand is left
out.
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
from scipy.special import erfcx
from thermal_reference import Floats

from hapticvlm.materials import MATERIALS
from hapticvlm.palette import GREEN, GREY, INK, SOFT
from hapticvlm.perception import NEUTRAL_C
from hapticvlm.rendering.heat.contact import SKIN, ThermalContact, progress, thermal_contact
from hapticvlm.rendering.heat.trajectory import ThermalTrajectory
from hapticvlm_lab.bench import figures
from hapticvlm_lab.bench.rigs import core_us

NAME = "chart-thermal-plate"
FRAME_S = 0.02
AFTER_S = 1.0
SLIDE_S = 2.0
ENDS_S = 6.0
PALMS = (2e-4, 5e-4, 1e-3)  # m2 K/W
ROOMS_C = (15.0, 22.0, 30.0)
TOUCHED = ("wood", "glass", "fabric", "metal")
ASSUMED = 5e-4  # m2 K/W, for a term that does not know the palm
LOWEST_C = 1e-3  # a smaller error is drawn here
MARK_C = 0.3  # RMS of the skin from 1 s on
ROUNDS = 15
STEPS = 200
PANELS = (("contact_c", "one contact"), ("slide_c", "the second object of a slide"))

# trajectory, palm resistance, now -> plate
Term = Callable[[ThermalTrajectory, float, float], float]


@dataclass(frozen=True, slots=True)
class PlateRow:
    """One method: worst RMS error of the skin from AFTER_S on, on a contact and a slide, degC."""

    method: str
    is_default: bool
    contact_c: float
    slide_c: float
    step_us: float


def without(trajectory: ThermalTrajectory, resistance: float, now: float) -> float:
    """Treat skin and plate as the same."""
    del resistance
    return trajectory.skin_c(now)


def closed(trajectory: ThermalTrajectory, resistance: float, now: float) -> float:
    """Use the flow of a first contact with a thick body, dT / R'' erfcx(x), without a history."""
    contact = trajectory.contact
    begun_at = trajectory.begun_at
    assert contact is not None
    assert begun_at is not None
    # The flow through the contact is the gradient that is left across its resistance. Before the
    # first moment it is the whole drop; later the surfaces have approached each other, and the
    # share that is left is erfcx of the progress. An earlier contact would change the drop: not
    # known here.
    drop_c = contact.surface_c - contact.skin_c
    left = float(erfcx(progress(contact, now - begun_at)))
    return trajectory.skin_c(now) + resistance * drop_c / contact.contact_resistance * left


def product(trajectory: ThermalTrajectory, resistance: float, now: float) -> float:
    """Return the temperature that the product drives the plate to."""
    del resistance  # the trajectory contains it
    return trajectory.target_c(now)


METHODS: tuple[tuple[str, Term, float | None], ...] = (
    ("without the term", without, None),
    ("closed form, first contact only", closed, None),
    (f"with memory, palm taken for {ASSUMED:g}", product, ASSUMED),
    ("with memory, palm known (default)", product, None),
)


def run(out: Path) -> list[PlateRow]:
    """Measure, write picture and JSON."""
    rows = [_row(*method) for method in METHODS]
    draw(rows, out / NAME)
    report = {"chart": "thermal plate", "mark_c": MARK_C, "rows": [asdict(row) for row in rows]}
    (out / f"{NAME}.json").write_text(json.dumps(report, indent=1) + "\n", encoding="utf-8")
    return rows


def show(rows: Sequence[PlateRow]) -> None:
    """Print a table."""
    print(f"skin on the plate from {AFTER_S:g} s on, worst RMS, degC; mark {MARK_C:g}")
    for row in rows:
        print(f"{row.method:<40} {row.contact_c:>9.4f} {row.slide_c:>9.4f} {row.step_us:>8.2f} us")


def skin_on_plate(plate_c: Floats, resistance: float) -> Floats:
    """Return the skin on a plate of these temperatures, one held for each frame, (N,) degC."""
    # Superposition: conduction is linear, so the skin's answer to a course of the plate is the sum
    # of its answers to the steps of that course, each shifted to the time of its step. That sum is
    # a convolution of the steps with the answer to a step of one degree.
    steps = np.diff(plate_c, prepend=NEUTRAL_C)
    times = FRAME_S * np.arange(1, plate_c.size + 1)
    response = 1.0 - erfcx(np.sqrt(times) / (SKIN.effusivity * resistance))
    return NEUTRAL_C + np.convolve(steps, response)[: plate_c.size]


def error_c(term: Term, palm: float, assumed: float, touched: Sequence[ThermalContact]) -> float:
    """Return the RMS error of the skin from AFTER_S after the last contact on, degC."""
    # The plate is set to the middle of each frame, so that holding it for the frame is right on
    # average; the skin is compared at the end of the frame.
    trajectory = ThermalTrajectory(lead_s=0.0, plate_resistance=assumed)
    plate = []
    wanted = []
    for frame in range(round(ENDS_S / FRAME_S)):
        turn = min(int(frame * FRAME_S / SLIDE_S), len(touched) - 1)
        trajectory = trajectory.touch(touched[turn], turn, frame * FRAME_S)
        plate.append(term(trajectory, assumed, (frame + 0.5) * FRAME_S))
        wanted.append(trajectory.skin_c((frame + 1) * FRAME_S))
    off = skin_on_plate(np.array(plate), palm) - wanted
    after = round(((len(touched) - 1) * SLIDE_S + AFTER_S) / FRAME_S)
    return float(np.sqrt(np.mean(off[after:] ** 2)))


def _row(name: str, term: Term, assumed: float | None) -> PlateRow:
    def worst(pairs: Sequence[tuple[str, ...]]) -> float:
        return max(
            error_c(term, palm, palm if assumed is None else assumed, _contacts(names, room_c))
            for palm in PALMS
            for room_c in ROOMS_C
            for names in pairs
        )

    single = worst([(name,) for name in TOUCHED])
    slides = worst([(first, second) for first in TOUCHED for second in TOUCHED if first != second])
    is_default = term is product and assumed is None
    return PlateRow(name, is_default, round(single, 4), round(slides, 4), _step_us(term))


def _contacts(names: Sequence[str], room_c: float) -> list[ThermalContact]:
    return [thermal_contact(MATERIALS[name].thermal, room_c) for name in names]


def _step_us(term: Term) -> float:
    """Return the median core time of a setpoint on glass after metal, us."""
    first, second = _contacts(("metal", "glass"), 22.0)
    trajectory = ThermalTrajectory(lead_s=0.0, plate_resistance=ASSUMED).touch(first, 1, 0.0)
    trajectory = trajectory.touch(second, 2, 1.0)

    def follow() -> None:
        for step in range(STEPS):
            term(trajectory, ASSUMED, 1.0 + FRAME_S * (step + 1))

    return round(float(np.median([core_us(follow) for _ in range(ROUNDS)])) / STEPS, 2)


def _degrees(error_c: float) -> str:
    return f"{error_c:.2g}" if error_c >= LOWEST_C else "below 0.001"


def draw(rows: Sequence[PlateRow], stem: Path) -> None:
    """Draw error against cost, a panel for one contact and one for slides."""
    with figures.figure(stem, (12.0, 4.6), 2, dpi=80, sharey=True) as (drawn, panels):
        figures.title(
            drawn, "Allowing for palm and plate, 2e-4 to 1e-3 m2 K/W (dashed: mark of 0.3 degC)"
        )
        panels[0].set_ylabel("skin on the plate from 1 s on: worst RMS, degC")
        for axes, (field, title) in zip(panels, PANELS, strict=True):
            dots = [(row.step_us, max(getattr(row, field), LOWEST_C)) for row in rows]
            for row, dot in zip(rows, dots, strict=True):
                axes.plot(*dot, "o", color=GREEN if row.is_default else GREY, markersize=8)
            axes.axhline(MARK_C, color=SOFT, linestyle="--", linewidth=0.8)
            axes.set(xscale="log", yscale="log", title=title, xlabel="us of a core a setpoint")
            axes.set_xlim(figures.span([x for x, _ in dots], 3.0, 100.0))
            highest = math.ceil(math.log10(max(y for _, y in dots)) + 0.1)
            axes.set_ylim(LOWEST_C / 2.0, 10.0**highest)
            labels = [
                (x, y, f"{row.method}: {_degrees(getattr(row, field))}", INK)
                for row, (x, y) in zip(rows, dots, strict=True)
            ]
            figures.place(axes, labels, dots)
