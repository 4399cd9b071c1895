"""The project's one plant model: a Peltier element between a face with a palm on it and a sink.

The plant is a lumped TEC1-03108 (Lineykin and Ben-Yaakov; docs/physics.md 2.1) between a face and
a sink, with a palm on the face. With current I > 0 heating the face, temperatures in kelvin,

    Cf dTf/dt = a I Tf + I^2 R / 2 + K (Ts - Tf) + heat from the skin
    Cs dTs/dt = -a I Ts + I^2 R / 2 + K (Tf - Ts) + (ambient - Ts) / sink resistance

and the skin is graded cells down to a core at 35 degC. Steps are backward Euler, sub-stepped to
10 ms: the current multiplies a temperature, so no fixed matrix serves; face and fine skin are too
stiff for an explicit step (physics.md 1.4); an implicit one is stable, does not ring and stays
within 0.02 degC of a ten times finer one. Pellet dynamics below 0.3 s are left out.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hapticvlm.perception import NEUTRAL_C
from hapticvlm.rendering.heat.contact import SKIN

# V/K, ohm, W/K (physics.md 2.1)
SEEBECK = 0.01267
RESISTANCE = 0.367
CONDUCTANCE = 0.173
# physics.md 2.1; sink with 2 K/W: 100 s
FACE_J_PER_K = 1.0
SINK_J_PER_K = 50.0
AREA_M2 = 4e-4  # 20 x 20 mm
PALM_RESISTANCE = 2e-4  # m2 K/W, palm lying well on the ceramic face: what harms it most
AMBIENT_C = 23.0
SINK_K_PER_W = 2.0
CORE_C = 35.0
_CELLS_M = 5e-5 * 1.55 ** np.arange(8.0)  # 2.9 mm in all: reproduces physics.md 2.2 and 2.3
_LONGEST_STEP_S = 0.01
_KELVIN = 273.15
_MAX_LOOPED_STEPS = 8  # more are cheaper by a matrix power

_Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Module:
    """The Peltier element and what it is bonded to: V/K, ohm, W/K, J/K, J/K."""

    seebeck: float = SEEBECK
    resistance: float = RESISTANCE
    conductance: float = CONDUCTANCE
    face_j_per_k: float = FACE_J_PER_K
    sink_j_per_k: float = SINK_J_PER_K


class Plant:
    """Face, sink and skin of one plate; `palm_resistance` may be inf for no hand."""

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
        """Set the palm on the face; inf for none."""
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
        """Advance by `dt_s` at a constant current, heating the face when positive."""
        if not dt_s > 0.0:
            return
        count = math.ceil(dt_s / _LONGEST_STEP_S)
        transition, offset = self._solved(current_a, dt_s, count)
        self._state_c = _after(self._state_c, transition, offset, count)

    def _solved(self, current_a: float, dt_s: float, count: int) -> tuple[_Floats, _Floats]:
        """Return what one sub-step does: state -> transition @ state + offset; (n, n), (n,).

        An inverse is most of a step's cost, and a plate at rest asks for the same one 50 times a
        second for hours, in the process that answers touches: so the last one is kept.
        """
        # Implicit steps: the skin's thinnest cell would force an explicit step below a millisecond,
        # an implicit one stays stable at the 20 ms of the control loop. What that costs is one
        # system of equations for each current and step, in which pumped heat stands beside the
        # flows.
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
    """Apply state -> transition @ state + offset so many times; (n,), (n, n), (n,) -> (n,)."""
    if count <= _MAX_LOOPED_STEPS:
        for _ in range(count):
            state_c = transition @ state_c + offset
        return state_c
    # Many equal steps are one power of a matrix: state and a constant 1 go in, so that the offset
    # is part of it. A minute of a plate at rest then costs as much as a dozen steps.
    size = len(offset)
    whole = np.eye(size + 1)
    whole[:size, :size], whole[:size, size] = transition, offset
    whole = np.linalg.matrix_power(whole, count)
    result: _Floats = whole[:size, :size] @ state_c + whole[:size, size]
    return result


def _network(palm_w_per_k: float, conductance: float) -> tuple[_Floats, _Floats]:
    """Conductances between sink, face and cells, (n, n) in W/K, and heat from the core, (n,)."""
    inner = AREA_M2 * SKIN.conductivity / ((_CELLS_M[:-1] + _CELLS_M[1:]) / 2.0)
    links = np.concatenate(([conductance, palm_w_per_k], inner))
    flow = np.diag(links, 1) + np.diag(links, -1)
    flow -= np.diag(flow.sum(axis=1))
    source = np.zeros(len(flow))
    to_core = AREA_M2 * SKIN.conductivity / (_CELLS_M[-1] / 2.0)
    flow[-1, -1] -= to_core
    source[-1] = to_core * CORE_C
    return flow, source
