"""Simulates the plant: a Peltier element between a face with a palm on it and a heat sink. Pure.

This is the only plant model of the project; the simulated plate and every firmware test use it. The
element is a lumped TEC1-03108 (Lineykin and Ben-Yaakov; docs/physics.md 2.1). For a current I, with
I > 0 heating the face, and temperatures in kelvin,

    Cf dTf/dt = a I Tf + I^2 R / 2 + K (Ts - Tf) + heat from the skin
    Cs dTs/dt = -a I Ts + I^2 R / 2 + K (Tf - Ts) + (ambient - Ts) / sink resistance

a I T is the heat that the Peltier effect pumps, I^2 R / 2 the half of the ohmic heat that reaches
each side, and K conducts heat back through the element. The skin is a row of cells, thin at the
surface and thicker with depth, down to a core at 35 degC.

Each step is backward Euler with sub-steps of at most 10 ms. The current multiplies a temperature,
so the matrix differs for every current. Face and thin cells are too stiff for an explicit step
(physics.md 1.4); an implicit step is stable, does not ring and stays within 0.02 degC of one that
is ten times finer. The dynamics of the pellets, faster than 0.3 s, are not modelled.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hapticvlm.perception import NEUTRAL_C
from hapticvlm.rendering.heat.contact import SKIN

# physics.md 2.1
SEEBECK = 0.01267  # V/K
RESISTANCE = 0.367  # ohm
CONDUCTANCE = 0.173  # W/K
FACE_J_PER_K = 1.0
SINK_J_PER_K = 50.0  # with 2 K/W a time constant of 100 s
AREA_M2 = 4e-4  # 20 x 20 mm
PALM_RESISTANCE = 2e-4  # m2 K/W, a palm in good contact with the face, the worst case for a fault
AMBIENT_C = 23.0
SINK_K_PER_W = 2.0
CORE_C = 35.0
_CELLS_M = 5e-5 * 1.55 ** np.arange(8.0)  # 2.9 mm in all: reproduces physics.md 2.2 and 2.3
_LONGEST_STEP_S = 0.01
_KELVIN = 273.15
_MAX_LOOPED_STEPS = 8  # more steps are cheaper by a matrix power

_Floats = NDArray[np.float64]


class Bead:
    """A thermistor glued to a surface, whose reading follows it with a lag of first order, in s."""

    def __init__(self, surface_c: float, lag_s: float) -> None:
        self.c = surface_c
        self._lag_s = lag_s

    def feel(self, surface_c: float, dt_s: float) -> None:
        """Let `dt_s` pass on a surface of this temperature, degC."""
        share = 1.0 if self._lag_s <= 0.0 else -math.expm1(-dt_s / self._lag_s)
        self.c += (surface_c - self.c) * share


@dataclass(frozen=True, slots=True)
class Module:
    """The Peltier element with its face and sink: V/K, ohm, W/K, J/K, J/K."""

    seebeck: float = SEEBECK
    resistance: float = RESISTANCE
    conductance: float = CONDUCTANCE
    face_j_per_k: float = FACE_J_PER_K
    sink_j_per_k: float = SINK_J_PER_K


class Plant:
    """Temperatures of face, sink and skin of one plate, advanced in time.

    `ambient_c`, `plate_c` and `sink_c` are in degC; `palm_resistance` is in m2 K/W, inf for no
    hand. Without `sink_c` the sink starts at ambient temperature.
    """

    def __init__(
        self,
        ambient_c: float = AMBIENT_C,
        sink_k_per_w: float = SINK_K_PER_W,
        palm_resistance: float = PALM_RESISTANCE,
        plate_c: float = NEUTRAL_C,
        sink_c: float | None = None,
        *,
        module: Module = Module(),
    ) -> None:
        self._module = module
        centre_m = np.cumsum(_CELLS_M) - _CELLS_M / 2.0
        skin_c = plate_c + (CORE_C - plate_c) * centre_m / _CELLS_M.sum()
        self._state_c = np.concatenate(([ambient_c if sink_c is None else sink_c, plate_c], skin_c))
        skin_j_per_k = _CELLS_M * (SKIN.density * SKIN.heat_capacity * AREA_M2)
        self._capacity = np.concatenate(([module.sink_j_per_k, module.face_j_per_k], skin_j_per_k))
        self._room = ambient_c, sink_k_per_w
        self._last_step: tuple[float, float, _Floats, _Floats] | None = None
        self.touch(palm_resistance)

    def touch(self, palm_resistance: float) -> None:
        """Lay a palm on the face, with this resistance in m2 K/W; inf lifts it."""
        self.palm_resistance = palm_resistance
        first = _CELLS_M[0] / 2.0 / SKIN.conductivity
        self._surface_share = first / (palm_resistance + first)  # of face minus first cell
        self._flow, self._source = _network(
            AREA_M2 / (palm_resistance + first), self._module.conductance
        )
        ambient_c, sink_k_per_w = self._room
        self._flow[0, 0] -= 1.0 / sink_k_per_w
        self._source[0] += ambient_c / sink_k_per_w
        self._last_step = None

    @property
    def plate_c(self) -> float:
        """Temperature of the face, degC."""
        return float(self._state_c[1])

    @property
    def sink_c(self) -> float:
        """Temperature of the sink, degC."""
        return float(self._state_c[0])

    @property
    def skin_c(self) -> float:
        """Temperature of the skin surface, degC."""
        face_c = self._state_c[1]
        cell_c = self._state_c[2]
        return float(cell_c + self._surface_share * (face_c - cell_c))

    def step(self, current_a: float, dt_s: float) -> None:
        """Advance by `dt_s` at a constant current in A; a positive current heats the face."""
        if not dt_s > 0.0:
            return
        count = math.ceil(dt_s / _LONGEST_STEP_S)
        transition, offset = self._solved(current_a, dt_s, count)
        self._state_c = _after(self._state_c, transition, offset, count)

    def _solved(self, current_a: float, dt_s: float, count: int) -> tuple[_Floats, _Floats]:
        """Return the transition (n, n) and offset (n,) of a sub-step: transition @ state + offset.

        The inverse is most of the cost of a step. A plate at rest needs the same one 50 times a
        second for hours, in the process that answers touches, so the last one is cached.
        """
        # The skin's thinnest cell would force an explicit step below a millisecond, while an
        # implicit step is stable at the 20 ms of the control loop. In return it solves one system
        # of equations for each current and step length: flows and pumped heat are its coefficients,
        # and ohmic heat, ambient and core are its right-hand side.
        last = self._last_step
        if last is not None and last[:2] == (current_a, dt_s):
            return last[2:]
        pumped = self._module.seebeck * current_a
        joule = current_a**2 * self._module.resistance / 2.0
        stored = self._capacity * (count / dt_s)
        system = -self._flow
        system.flat[:: len(stored) + 1] += stored
        system[0, 0] += pumped
        system[1, 1] -= pumped
        source = self._source.copy()
        source[0] += joule - pumped * _KELVIN
        source[1] += joule + pumped * _KELVIN
        inverse = np.linalg.inv(system)
        transition, offset = inverse * stored, inverse @ source
        self._last_step = current_a, dt_s, transition, offset
        return transition, offset


def _after(state_c: _Floats, transition: _Floats, offset: _Floats, count: int) -> _Floats:
    """Apply state -> transition @ state + offset `count` times; (n,), (n, n), (n,) -> (n,)."""
    if count <= _MAX_LOOPED_STEPS:
        for _ in range(count):
            state_c = transition @ state_c + offset
        return state_c
    # Many equal steps are one power of a matrix. The state is extended by a constant 1, which makes
    # the offset a column of that matrix. A minute of a plate at rest then costs a dozen products.
    size = len(offset)
    whole = np.eye(size + 1)
    whole[:size, :size], whole[:size, size] = transition, offset
    whole = np.linalg.matrix_power(whole, count)
    result: _Floats = whole[:size, :size] @ state_c + whole[:size, size]
    return result


def _network(palm_w_per_k: float, conductance: float) -> tuple[_Floats, _Floats]:
    """Return the conductances between sink, face and cells, (n, n) in W/K, and the heat sources.

    The sources (n,) are in W; here only the core at CORE_C is one.
    """
    inner = AREA_M2 * SKIN.conductivity / ((_CELLS_M[:-1] + _CELLS_M[1:]) / 2.0)
    links = np.concatenate(([conductance, palm_w_per_k], inner))
    flow = np.diag(links, 1) + np.diag(links, -1)
    flow -= np.diag(flow.sum(axis=1))
    source = np.zeros(len(flow))
    to_core = AREA_M2 * SKIN.conductivity / (_CELLS_M[-1] / 2.0)
    flow[-1, -1] -= to_core
    source[-1] = to_core * CORE_C
    return flow, source
