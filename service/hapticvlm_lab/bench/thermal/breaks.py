"""The trials of `stability thermal`: small, repeatable, each against its theory. Pure.

Methods are pushed where they fail; the product's own method stands beside them in every group.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.special import erfc

from hapticvlm.devices.simulated.plant import Plant
from hapticvlm.materials import MATERIALS, Thermal
from hapticvlm.perception import NEUTRAL_C
from hapticvlm.rendering.heat.contact import (
    ThermalContact,
    contact_temperature_c,
    progress,
    skin_surface_c,
    thermal_contact,
)
from hapticvlm.rendering.heat.limits import within_range
from hapticvlm.rendering.heat.trajectory import ThermalTrajectory
from hapticvlm_lab.bench.thermal import grids
from hapticvlm_lab.bench.thermal.grids import Floats
from hapticvlm_lab.bench.thermal.loop import AFTER_S, ReturnFromWindup, wind_up
from hapticvlm_lab.bench.thermal.methods import Closed, Skin, uniform_cells
from hapticvlm_lab.bench.thermal.reference import contact_surface

ALUMINIUM = Thermal(167, 2700, 896)
BULKS = {
    "softwood": Thermal(0.12, 510, 1380),
    "glass": MATERIALS["glass"].thermal,
    "aluminium": ALUMINIUM,
}
FRAME_S = 1.0 / 90.0
MOST_TURNS = 3  # of dT/dt: the cells of an object run out of cold once
LOST_C = 1e6  # degC, an error beyond any doubt
STIFF = 1e-5  # m2 K/W, wet or pressed hard


@dataclass(frozen=True, slots=True)
class Trial:
    """What was tried, what was found, and whether that breaks the method."""

    what: str
    found: str
    breaks: bool


def explicit_euler() -> list[Trial]:
    """Explicit Euler at frame steps, and the product at the same."""
    trials = []
    for name, bulk in BULKS.items():
        for step_s in (FRAME_S, 1e-3):
            limit_s = grids.explicit_limit_s(bulk, grids.UNIFORM_M)
            contact = thermal_contact(bulk, 22.0, contact_resistance=5e-4)
            errors = euler_errors(contact, step_s)
            late_c = float(errors[errors.size // 2 :].max())
            lost = first_lost(errors)
            broken = not late_c < 1.0
            found = f"limit {limit_s * 1e3:.2g} ms; worst error from 1 to 2 s {late_c:.2g} degC"
            found += f", past {LOST_C:.0e} at step {lost}" if lost else ""
            trials.append(Trial(f"{name}, dt {step_s * 1e3:.3g} ms", found, broken))
    contact = thermal_contact(ALUMINIUM, 22.0, contact_resistance=5e-4)
    worst_c = float(_errors(Closed(FRAME_S), contact, FRAME_S, 2.0).max())
    found = f"worst error in 2 s {worst_c:.1e} degC"
    return [*trials, Trial("closed form (default), aluminium, any step", found, worst_c > 1e-3)]


def ringing() -> list[Trial]:
    """Sign changes of the skin's rate after a stiff contact with aluminium."""
    contact = thermal_contact(ALUMINIUM, 22.0, contact_resistance=STIFF)
    trials = []
    for name, rule in (
        ("Crank-Nicolson", grids.crank_nicolson),
        ("backward Euler", grids.backward_euler),
    ):
        followed = follow(uniform_cells(rule)(FRAME_S), contact, FRAME_S, 2.0)
        trials.append(_rings(name, followed))
    return [
        *trials,
        _rings("closed form (default)", follow(Closed(FRAME_S), contact, FRAME_S, 2.0)),
    ]


def overflow() -> list[Trial]:
    """Find where exp(x^2) erfc(x) stops being a number, as x and as time on aluminium."""
    trials = []
    for kind in (np.float32, np.float64):
        at = overflow_at(kind)
        for resistance in (1e-4, 1e-5):
            contact = thermal_contact(ALUMINIUM, 22.0, contact_resistance=resistance)
            pace = progress(contact, 1.0)
            found = f"x > {at:.1f}, that is {(at / pace) ** 2:.2g} s into the touch"
            trials.append(Trial(f"{kind.__name__}, R'' {resistance:g}", found, True))
    stiff = thermal_contact(ALUMINIUM, 22.0, contact_resistance=1e-9)
    late_c = [skin_surface_c(stiff, 10.0**power) for power in range(-3, 300)]
    found = f"finite to 1e300 s, {min(late_c):.2f} to {max(late_c):.2f} degC"
    broken = not bool(np.isfinite(late_c).all())
    return [*trials, Trial("closed form (default), R'' 1e-9", found, broken)]


def resistances() -> list[Trial]:
    """Try the product where others divide by zero."""
    trials = []
    for thickness_m in (None, 1e-3):
        for resistance in (0.0, 1e-300, 1e300, math.inf):
            contact = thermal_contact(
                ALUMINIUM, 22.0, thickness_m=thickness_m, contact_resistance=resistance
            )
            skin_c = skin_surface_c(contact, 1e-3)
            wanted_c = NEUTRAL_C if resistance > 1.0 else contact_temperature_c(contact)
            body = "thick" if thickness_m is None else "1 mm"
            found = f"{skin_c:.3f} degC after 1 ms; expected {wanted_c:.3f}"
            broken = not abs(skin_c - wanted_c) < 0.1
            trials.append(
                Trial(f"closed form, {body} aluminium, R'' {resistance:g}", found, broken)
            )
    return trials


def windup() -> list[Trial]:
    """Run a loop with and without anti-windup on the project's plant."""
    trials = []
    for name, guarded in (("without anti-windup", False), ("integral waits (default)", True)):
        back = wind_up(guarded=guarded)
        found = f"{_seconds(back)} to settle, overshoot {back.overshoot_c:.1f} degC"
        trials.append(Trial(f"PI {name}", found, back.overshoot_c > 1.0))
    return trials


def stiffness() -> list[Trial]:
    """Skin under a face in fine cells has fast and slow parts; the plant takes any step."""
    fine = grids.system(grids.uniform(2e-5), thermal_contact(ALUMINIUM, 22.0), scaled=False)
    rates = np.sort(-np.linalg.eigvals(fine.matrix).real)
    slow_s = 1.0 / float(rates[1])
    fast_s = 1.0 / float(rates[-1])
    stiff = f"slowest {slow_s:.2g} s, fastest {fast_s:.1e} s, explicit limit {2e6 * fast_s:.2g} us"
    plant = Plant()
    beside = Plant()
    plant.step(-2.0, 10.0)
    for _ in range(1000):
        beside.step(-2.0, 0.01)
    apart_c = abs(plant.plate_c - beside.plate_c)
    found = f"one step of 10 s and 1000 of 10 ms end {apart_c:.1e} degC apart"
    return [
        Trial("explicit step of 11 ms, cells of 0.02 mm on aluminium", stiff, 2 * fast_s < FRAME_S),
        Trial("implicit plant of the simulated plate (default)", found, apart_c > 0.1),
    ]


def no_numbers() -> list[Trial]:
    """NaN and infinity as temperature, time and wish."""
    glass = thermal_contact(MATERIALS["glass"].thermal, 22.0)
    cases = {
        "surface NaN": ThermalTrajectory()
        .touch(replace(glass, surface_c=math.nan), 1, 0.0)
        .target_c(1.0),
        "surface inf": ThermalTrajectory()
        .touch(replace(glass, surface_c=math.inf), 1, 0.0)
        .target_c(1.0),
        "time NaN": ThermalTrajectory().touch(glass, 1, 0.0).target_c(math.nan),
        "R'' NaN": ThermalTrajectory()
        .touch(replace(glass, contact_resistance=math.nan), 1, 0.0)
        .target_c(1.0),
    }
    trials = []
    for name, wish_c in cases.items():
        limited = within_range(wish_c)
        found = f"wish {wish_c:g}, setpoint {limited.setpoint_c:g} degC, limited by "
        broken = not math.isfinite(limited.setpoint_c)
        trials.append(Trial(f"default, {name}", f"{found}{limited.limited_by}", broken))
    return trials


def euler_errors(contact: ThermalContact, step_s: float) -> Floats:
    """Error of explicit Euler at 0.1 mm over 2 s, (N,) degC; inf from where it is no number."""
    errors = _errors(uniform_cells(grids.explicit_euler)(step_s), contact, step_s, 2.0)
    return np.where(np.isfinite(errors), errors, np.inf)


def first_lost(errors: Floats) -> int | None:
    """Count the steps until the error is past LOST_C; None if it never is."""
    lost = np.flatnonzero(errors > LOST_C)
    return int(lost[0]) + 1 if lost.size else None


def follow(skin: Skin, contact: ThermalContact, step_s: float, seconds: float) -> Floats:
    """Skin surface at every step of one contact, (N,) degC."""
    with np.errstate(all="ignore"):
        skin.touch(contact)
        return np.array([skin.step() for _ in range(round(seconds / step_s))])


def turns(followed: Floats) -> int:
    """How often the rate of change changes its sign."""
    rates = np.diff(followed)
    return int(np.sum(rates[1:] * rates[:-1] < 0.0))


def overflow_at(kind: type[np.floating]) -> float:
    """Largest x, in steps of 0.1, where exp(x^2) erfc(x) in this precision is still a number."""
    x = np.arange(0.1, 60.0, 0.1)
    return float(x[np.argmax(np.isnan(naive(x, kind))) - 1])


def naive(x: Floats, kind: type[np.floating]) -> Floats:
    """Multiply exp(x^2) by erfc(x) in this precision, (N,); NaN where that is no number."""
    narrow: NDArray[Any] = x.astype(kind)
    with np.errstate(all="ignore"):
        value: NDArray[Any] = np.exp(narrow * narrow) * erfc(narrow).astype(kind)
    wide = value.astype(np.float64)
    return np.where(np.isfinite(wide) & (wide > 0.0), wide, np.nan)


def _errors(skin: Skin, contact: ThermalContact, step_s: float, seconds: float) -> Floats:
    followed = follow(skin, contact, step_s, seconds)
    times = np.arange(1, followed.size + 1, dtype=np.float64) * step_s
    return np.asarray(np.abs(followed - contact_surface(contact, times)))


def _rings(name: str, followed: Floats) -> Trial:
    count = turns(followed)
    what = f"{name}, aluminium, R'' {STIFF:g}, dt {FRAME_S * 1e3:.1f} ms"
    return Trial(what, f"{count} sign changes of dT/dt in 2 s", count > MOST_TURNS)


def _seconds(back: ReturnFromWindup) -> str:
    return f"over {AFTER_S:g} s" if back.settled_s is None else f"{back.settled_s:.1f} s"
