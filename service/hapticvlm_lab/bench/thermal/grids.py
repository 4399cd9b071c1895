"""Skin and object cut into cells: the linear system, and the methods to step it.

With temperatures T of all cells, skin first and from the core outwards, dT/dt = A T. A step of dt
is one product with a matrix: exp(A dt) is exact in time; I + A dt is explicit Euler; the inverse of
I - A dt backward Euler; (I - A dt / 2)^-1 (I + A dt / 2) Crank-Nicolson.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import expm
from scipy.optimize import brentq

from hapticvlm.materials import Thermal
from hapticvlm.rendering.heat.contact import SKIN, ThermalContact

DEPTH_M = 8e-3  # of skin that is modelled: heat comes 2 sqrt(a t) = 2 mm far in 10 s
UNIFORM_M = 1e-4  # what many simulations use

Floats = NDArray[np.float64]
Rule = Callable[[Floats, float], Floats]  # A and dt to the matrix of one step


@dataclass(frozen=True, slots=True)
class System:
    """A (2n, 2n) in 1/s and the weights (2n,) that read the skin surface off the cells."""

    matrix: Floats
    surface: Floats


def graded(cells: int) -> Floats:
    """Cell sizes of skin from its surface inwards, (cells,) m: fine first, DEPTH_M deep."""
    first_m = 3e-4 / cells
    growth = brentq(lambda ratio: first_m * np.sum(ratio ** np.arange(cells)) - DEPTH_M, 1.0, 20.0)
    return np.asarray(first_m * growth ** np.arange(cells))


def uniform(size_m: float = UNIFORM_M) -> Floats:
    """Cell sizes that are all alike, (N,) m, DEPTH_M deep."""
    return np.full(round(DEPTH_M / size_m), size_m)


def system(cells_m: Floats, contact: ThermalContact, *, scaled: bool) -> System:
    """Cells of skin meet cells of the object; `scaled` gives these the same time to cross."""
    count = cells_m.size
    bulk = contact.thermal
    stretch = np.sqrt(_diffusivity(bulk) / _diffusivity(SKIN)) if scaled else 1.0
    size = np.concatenate((cells_m[::-1], cells_m * stretch))
    conductivity = np.repeat([SKIN.conductivity, bulk.conductivity], count)
    heat = np.repeat([SKIN.density * SKIN.heat_capacity, bulk.density * bulk.heat_capacity], count)
    half = size / 2.0 / conductivity
    between = half[:-1] + half[1:]
    between[count - 1] += max(contact.contact_resistance, 0.0)
    link = 1.0 / between
    flow = np.diag(link, 1) + np.diag(link, -1)
    flow -= np.diag(flow.sum(axis=1))
    surface = np.zeros(2 * count)
    carried = float(link[count - 1] * half[count - 1])
    surface[count - 1], surface[count] = 1.0 - carried, carried
    return System(flow / (size * heat)[:, None], surface)


def exact(matrix: Floats, step_s: float) -> Floats:
    """Matrix exponential: no error in time, stable at any step."""
    return np.asarray(expm(matrix * step_s))


def explicit_euler(matrix: Floats, step_s: float) -> Floats:
    """Stable only while the step is below dx^2 / 2a of the fastest cell."""
    return np.asarray(np.eye(len(matrix)) + matrix * step_s)


def backward_euler(matrix: Floats, step_s: float) -> Floats:
    """Stable and free of ringing, first order in time."""
    return np.asarray(np.linalg.inv(np.eye(len(matrix)) - matrix * step_s))


def crank_nicolson(matrix: Floats, step_s: float) -> Floats:
    """Stable and second order, but what is stiff rings from step to step."""
    half = matrix * (step_s / 2.0)
    unit = np.eye(len(matrix))
    return np.asarray(np.linalg.solve(unit - half, unit + half))


def explicit_limit_s(bulk: Thermal, size_m: float) -> float:
    """Longest stable step of explicit Euler inside a bulk, dx^2 / 2a."""
    return size_m**2 / (2.0 * _diffusivity(bulk))


def _diffusivity(bulk: Thermal) -> float:
    return bulk.conductivity / (bulk.density * bulk.heat_capacity)
