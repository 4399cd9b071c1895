"""All methods to follow the skin, by one interface: touch an object, then step from frame to frame.

A method that keeps no depth can only go on from the surface temperature it had when the hand slides
to another object; that is what "forgetful" costs. The product's own method is `Closed`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Literal, Protocol

import numpy as np
from scipy.optimize import least_squares
from scipy.special import erfcx

from hapticvlm.perception import NEUTRAL_C
from hapticvlm.rendering.heat.contact import (
    ThermalContact,
    contact_temperature_c,
    progress,
    skin_surface_c,
)
from hapticvlm.rendering.heat.trajectory import ThermalTrajectory
from hapticvlm_lab.bench.thermal import grids
from hapticvlm_lab.bench.thermal.grids import Floats, Rule
from hapticvlm_lab.bench.thermal.traces import Traced

Family = Literal["step", "fitted", "cells", "closed", "stepped"]
FIT_FROM_S = 1.0 / 120.0
FIT_TO_S = 10.0
FIT_POINTS = 60


class Skin(Protocol):
    """Skin that starts at NEUTRAL_C; one step is one frame."""

    def touch(self, contact: ThermalContact) -> None:
        """Meet this object from now on: the cost of setting up."""

    def step(self) -> float:
        """Surface temperature one frame on, degC."""


@dataclass(frozen=True, slots=True)
class Method:
    """A name for the chart and how to begin at a frame length in seconds."""

    name: str
    family: Family
    begin: Callable[[float], Skin]
    is_default: bool = False


class Closed:
    """The product: closed form, with what earlier contacts left."""

    def __init__(self, frame_s: float) -> None:
        self._frame_s = frame_s
        self._now = 0.0
        self._count = 0
        self._course = ThermalTrajectory(lead_s=0.0)

    def touch(self, contact: ThermalContact) -> None:
        """Slide to this object."""
        self._count += 1
        self._course = self._course.touch(contact, self._count, self._now)

    def step(self) -> float:
        """Return the skin temperature of the trajectory."""
        self._now += self._frame_s
        return self._course.skin_c(self._now)


class Forgetful:
    """The closed form restarted at each contact, as if skin were all as warm as its surface."""

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
    """The contact temperature at once and for good."""

    def __init__(self, frame_s: float) -> None:
        del frame_s
        self._skin_c = NEUTRAL_C

    def touch(self, contact: ThermalContact) -> None:
        """Meet resting skin: there is no time in this method, so no past either."""
        self._skin_c = contact_temperature_c(contact)

    def step(self) -> float:
        """Stay."""
        return self._skin_c


class Exponentials:
    """A sum of up to three exponentials fitted to the closed form; forgetful."""

    def __init__(self, frame_s: float, terms: int) -> None:
        self._frame_s = frame_s
        self._terms = terms
        self._skin_c = NEUTRAL_C
        self._end_c = NEUTRAL_C
        self._a = self._b = self._c = self._p = self._q = self._r = 0.0

    def touch(self, contact: ThermalContact) -> None:
        """Fit, scale to the contrast with the skin of now."""
        contrast_c = contact.surface_c - self._skin_c
        end, heights, rates = fitted(contact, self._terms)
        self._end_c = self._skin_c + contrast_c * end
        heights = np.pad(heights * contrast_c, (0, 3 - self._terms))
        self._a, self._b, self._c = heights.tolist()
        keep = np.pad(np.exp(-rates * self._frame_s), (0, 3 - self._terms))
        self._p, self._q, self._r = keep.tolist()

    def step(self) -> float:
        """Three multiplications."""
        self._a *= self._p
        self._b *= self._q
        self._c *= self._r
        self._skin_c = self._end_c + self._a + self._b + self._c
        return self._skin_c


class Cells:
    """Cells on both sides and one matrix a step; the skin's cells are its memory."""

    def __init__(self, frame_s: float, cells_m: Floats, rule: Rule, *, scaled: bool) -> None:
        self._frame_s = frame_s
        self._cells_m = cells_m
        self._rule = rule
        self._scaled = scaled
        self._state = np.full(2 * cells_m.size, NEUTRAL_C)
        self._onwards = self._surface = np.zeros(0)

    def touch(self, contact: ThermalContact) -> None:
        """Bring fresh cells of the object to the cells of skin."""
        count = self._cells_m.size
        made = grids.system(self._cells_m, contact, scaled=self._scaled)
        self._onwards = self._rule(made.matrix, self._frame_s)
        self._surface = made.surface
        self._state = np.concatenate((self._state[:count], np.full(count, contact.surface_c)))

    def step(self) -> float:
        """One product."""
        self._state = self._onwards @ self._state
        return float(self._surface @ self._state)


def fitted(contact: ThermalContact, terms: int) -> tuple[float, Floats, Floats]:
    """Fit share(t) = end + sum of heights exp(-rates t) on log-spaced times.

    Heights (terms,), rates (terms,) in 1/s.
    """
    times = np.geomspace(FIT_FROM_S, FIT_TO_S, FIT_POINTS)
    settled = (contact_temperature_c(contact) - contact.skin_c) / (
        contact.surface_c - contact.skin_c
    )
    pace = progress(contact, 1.0)
    if np.isinf(pace):
        return settled, np.zeros(terms), np.ones(terms)
    wanted = settled * (1.0 - erfcx(np.sqrt(times) * pace))

    def solve(log_rates: Floats) -> tuple[Floats, Floats]:
        parts = np.exp(-np.exp(np.clip(log_rates, -9.0, 9.0)) * times[:, None])
        basis = np.column_stack((np.ones(times.size), parts))
        weights = np.linalg.lstsq(basis, wanted, rcond=None)[0]
        return weights, basis @ weights - wanted

    start = np.log(np.geomspace(0.3, 30.0, terms + 2)[1:-1])
    found = least_squares(lambda rates: solve(rates)[1], start)
    weights, _ = solve(found.x)
    return float(weights[0]), weights[1:], np.exp(np.clip(found.x, -9.0, 9.0))


def _exponentials(terms: int) -> Callable[[float], Skin]:
    return lambda frame_s: Exponentials(frame_s, terms)


def _graded(count: int) -> Callable[[float], Skin]:
    return lambda frame_s: Cells(frame_s, grids.graded(count), grids.exact, scaled=True)


def uniform_cells(rule: Rule) -> Callable[[float], Skin]:
    """Cells of 0.1 mm on both sides, stepped by this rule."""
    return lambda frame_s: Cells(frame_s, grids.uniform(), rule, scaled=False)


METHODS = (
    Method("contact temperature", "step", Constant),
    Method("1 exponential", "fitted", _exponentials(1)),
    Method("2 exponentials", "fitted", _exponentials(2)),
    Method("3 exponentials", "fitted", _exponentials(3)),
    Method("4 graded cells, exact step", "cells", _graded(4)),
    Method("8 graded cells, exact step", "cells", _graded(8)),
    Method("20 graded cells, exact step", "cells", _graded(20)),
    Method("closed form", "closed", Closed, is_default=True),
    Method("closed form, a trace per contact", "closed", Traced),
    Method("closed form, forgetful", "closed", Forgetful),
    Method("explicit Euler, 0.1 mm", "stepped", uniform_cells(grids.explicit_euler)),
    Method("Crank-Nicolson, 0.1 mm", "stepped", uniform_cells(grids.crank_nicolson)),
    Method("backward Euler, 0.1 mm", "stepped", uniform_cells(grids.backward_euler)),
)


@dataclass(frozen=True, slots=True)
class Row:
    """One method: worst errors in degC and where, cost in us; None is no number at all.

    `felt_c` is the worst on one contact, `slide_c` over slides; `step_us` and `setup_us` are
    medians, `touch_us` a step of a touch of one second with its share of setting up, `floors`
    that over a bare evaluation of the closed form in the same run.
    """

    method: str
    family: Family
    is_default: bool
    felt_c: float | None
    felt_at: str
    slide_c: float | None
    slide_at: str
    step_us: float
    setup_us: float
    touch_us: float
    floors: float
