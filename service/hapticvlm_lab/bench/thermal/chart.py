"""`hapticvlm chart thermal`: how far each method errs against what a step of it costs.

Every method answers the same questions: one contact of 10 s over materials, contact resistances and
frame rates, against a quadrature; and hands that slide from object to object, against finite
differences. What setting up costs is spread over the steps of a touch of one second.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from itertools import permutations
from pathlib import Path

import numpy as np

from hapticvlm.commands.progress import track
from hapticvlm.materials import MATERIALS, Thermal
from hapticvlm.perception import THERMAL_FLOOR_C
from hapticvlm.rendering.heat.contact import ThermalContact, thermal_contact
from hapticvlm_lab.bench.printing import made_with, publish
from hapticvlm_lab.bench.thermal import plate_term, plot, timing
from hapticvlm_lab.bench.thermal.methods import METHODS, Method, Row
from hapticvlm_lab.bench.thermal.reference import (
    Floats,
    Stage,
    contact_surface,
    sharp,
    skin_surface,
)

NAME = "chart-thermal"
FINEST_C = 0.1  # degC, cool threshold at the thenar (docs/physics.md 1.3)
OBJECT_C = 22.0
SECONDS = 10.0
RATES_HZ = (20, 60, 90)
RESISTANCES = (0.0, 1e-5, 1e-4, 5e-4, 2.5e-3, 1e-2)  # m2 K/W
BULKS = {name: material.thermal for name, material in MATERIALS.items()} | {
    "aluminium": Thermal(167, 2700, 896)
}
SLIDES: tuple[tuple[tuple[str, ...], float, float | None], ...] = (
    # materials one after the other, seconds on each, contact resistance (None: default)
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


def run(out: Path, *, as_json: bool) -> int:
    """Measure, print a table or JSON, write picture and JSON."""
    rows = measure()
    files = plot.draw(rows, out / NAME, sentence(rows))
    terms = plate_term.run(out)
    figures = {
        "chart": "thermal",
        **made_with(),
        "floor": "one evaluation of the closed form, nothing around it",
        "floor_c": [FINEST_C, THERMAL_FLOOR_C],
        "default": sentence(rows),
        "rows": [asdict(row) for row in rows],
        "plate_terms": [asdict(row) for row in terms],
        "files": [str(path) for path in files],
    }

    def show() -> None:
        _print(rows)
        plate_term.show(terms)

    return publish(out / f"{NAME}.json", figures, as_json=as_json, show=show)


def measure(methods: Sequence[Method] = METHODS) -> list[Row]:
    """Ask and time every method."""
    slides = [
        (stages, truth(stages)) for stages in map(_stages, track(SLIDES, "computing the reference"))
    ]
    return [_row(method, slides) for method in track(methods, "measuring every method")]


def truth(stages: Sequence[Stage]) -> Floats:
    """Follow a slide by finite differences: rows of time and skin surface, (N, 2)."""
    return skin_surface(stages, stages[-1].begins_at + SLIDE_TAIL_S)


def contact_error(method: Method, contact: ThermalContact, rate_hz: int) -> float:
    """Worst error over the frames of one contact, degC; inf where the method gives no number."""
    skin = method.begin(1.0 / rate_hz)
    skin.touch(contact)
    times = np.arange(1, round(SECONDS * rate_hz) + 1) / rate_hz
    with np.errstate(all="ignore"):
        found = np.array([skin.step() for _ in times])
    return _worst(found, contact_surface(contact, times))


def slide_error(method: Method, stages: Sequence[Stage], known: Floats, rate_hz: int) -> float:
    """Worst error over the frames of a slide where finite differences can be trusted, degC."""
    skin = method.begin(1.0 / rate_hz)
    waiting = list(stages)
    times = np.arange(1, round(known[-1, 0] * rate_hz) + 1) / rate_hz
    found = []
    for time_s in times:
        if waiting and waiting[0].begins_at < time_s - 1e-9:
            contact = waiting.pop(0).contact
            assert contact is not None
            skin.touch(contact)
        found.append(skin.step())
    exact_c = np.interp(times, known[:, 0], known[:, 1])
    return _worst(np.array(found), np.where(sharp(times, stages), exact_c, np.nan))


def sentence(rows: Sequence[Row]) -> str:
    """Name the cheapest method whose error nobody can feel, and whether the product uses it."""
    good = [row for row in rows if _is_below(row.felt_c, FINEST_C)]
    good = [row for row in good if _is_below(row.slide_c, FINEST_C)]
    if not good:
        return "no method is below the floor"
    best = min(good, key=lambda row: row.touch_us)
    kind = "the default" if best.is_default else "NOT the default"
    return (
        f"cheapest below {FINEST_C:g} degC on one contact and on slides: "
        f"{best.method} ({kind}), {best.touch_us:.1f} us a step"
    )


def _row(method: Method, slides: Sequence[tuple[Sequence[Stage], Floats]]) -> Row:
    with np.errstate(all="ignore"):
        errors_c = {
            f"{name}, R'' {resistance:g}, {rate_hz} Hz": contact_error(
                method, thermal_contact(bulk, OBJECT_C, contact_resistance=resistance), rate_hz
            )
            for name, bulk in BULKS.items()
            for resistance in RESISTANCES
            for rate_hz in RATES_HZ
        }
        slid = {
            f"{_title(slide)}, {rate_hz} Hz": slide_error(method, stages, known, rate_hz)
            for slide, (stages, known) in zip(SLIDES, slides, strict=True)
            for rate_hz in RATES_HZ
        }
        cost = timing.cost(method)
    felt_at = max(errors_c, key=errors_c.__getitem__)
    slide_at = max(slid, key=slid.__getitem__)
    return Row(
        method=method.name,
        family=method.family,
        is_default=method.is_default,
        felt_c=_number(errors_c[felt_at]),
        felt_at=felt_at,
        slide_c=_number(slid[slide_at]),
        slide_at=slide_at,
        **asdict(cost),
    )


def _stages(slide: tuple[tuple[str, ...], float, float | None]) -> list[Stage]:
    names, each_s, resistance = slide
    return [
        Stage(turn * each_s, thermal_contact(BULKS[name], OBJECT_C, contact_resistance=resistance))
        for turn, name in enumerate(names)
    ]


def _title(slide: tuple[tuple[str, ...], float, float | None]) -> str:
    names, each_s, resistance = slide
    return f"{' > '.join(names)}, {each_s:g} s each, R'' " + (
        "default" if resistance is None else f"{resistance:g}"
    )


def _worst(found: Floats, exact: Floats) -> float:
    off = np.abs(found - exact)[np.isfinite(exact)]
    return float(off.max()) if bool(np.isfinite(off).all()) else np.inf


def _number(error_c: float) -> float | None:
    return error_c if np.isfinite(error_c) else None


def _is_below(error_c: float | None, floor_c: float) -> bool:
    return error_c is not None and error_c < floor_c


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


def _degrees(error_c: float | None) -> str:
    if error_c is None:
        return "overflow"
    return f"{error_c:.1e}" if error_c < 1e-3 or error_c >= 1e4 else f"{error_c:.3f}"
