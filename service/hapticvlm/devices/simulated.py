"""A Peltier plate without hardware: the project's one plant model, and a plate that runs on it.

The plant is a lumped TEC1-03108 (Lineykin and Ben-Yaakov; physics reference 2.2) between a face and
a sink, with a palm on the face. With current I > 0 heating the face, temperatures in kelvin,

    Cf dTf/dt = a I Tf + I^2 R / 2 + K (Ts - Tf) + heat from the skin
    Cs dTs/dt = -a I Ts + I^2 R / 2 + K (Tf - Ts) + (ambient - Ts) / sink resistance

and the skin is graded cells down to a core at 35 degC. Steps are backward Euler, sub-stepped to
10 ms: the current multiplies a temperature, so no fixed matrix serves; face and fine skin are too
stiff for an explicit step (1.6); an implicit one is stable, does not ring and stays within 0.02
degC of a ten times finer one. Pellet dynamics below 0.3 s are left out.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hapticvlm.devices.dose import REST_S
from hapticvlm.devices.line import State
from hapticvlm.perception import NEUTRAL_C, THERMAL_FLOOR_C
from hapticvlm.rendering import thermal
from hapticvlm.rendering.thermal import SKIN, PlateReading

SEEBECK, RESISTANCE, CONDUCTANCE = 0.01267, 0.367, 0.173  # V/K, ohm, W/K (reference 2.2)
FACE_J_PER_K, SINK_J_PER_K = 1.0, 50.0  # reference 2.3; sink with 2 K/W: 100 s
AREA_M2 = 4e-4  # 20 x 20 mm
PALM_RESISTANCE = 2e-4  # m2 K/W, palm resting on the ceramic face (reference 2.3)
AMBIENT_C, SINK_K_PER_W, CORE_C = 23.0, 2.0, 35.0
_CELLS_M = 5e-5 * 1.55 ** np.arange(8.0)  # 2.9 mm in all: reproduces the reference's 2.3 and 2.4
_LONGEST_STEP_S, _KELVIN = 0.01, 273.15

HEAT_LIMIT_A, COOL_LIMIT_A = 0.75, 2.0  # heat stuck on stays below 43 degC at 23 (reference 3.4)
_HEAT_GAINS, _COOL_GAINS = (1.5, 0.6), (2.5, 1.5)  # A/K and A/(K s)
_TICK_S = 0.02
_LONGEST_GAP_S = 5.0  # s of a longer silence are lived through, the rest is not
_ARRIVED_C, _LONGEST_RETURN_S = 0.3, 10.0


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
        first = _CELLS_M[0] / 2.0 / SKIN.conductivity
        self._surface_share = first / (palm_resistance + first)  # of face minus first cell
        self._flow, self._source = _network(AREA_M2 / (palm_resistance + first), module.conductance)
        self._flow[0, 0] -= 1.0 / sink_k_per_w
        self._source[0] += ambient_c / sink_k_per_w

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
        face_c, cell_c = self._state_c[1], self._state_c[2]
        return float(cell_c + self._surface_share * (face_c - cell_c))

    def electric_w(self, current_a: float) -> float:
        """Electric power that a current would draw now, in watts."""
        module = self._module
        thermal_v = module.seebeck * (self.plate_c - self.sink_c)
        return current_a * (thermal_v + current_a * module.resistance)

    def step(self, current_a: float, dt_s: float) -> None:
        """Let `dt_s` pass at a constant current, heating the face when positive."""
        if not dt_s > 0.0:
            return
        count = math.ceil(dt_s / _LONGEST_STEP_S)
        pumped = self._module.seebeck * current_a
        joule = current_a**2 * self._module.resistance / 2.0
        stored = self._capacity * (count / dt_s)
        system = np.diag(stored) - self._flow
        system[0, 0] += pumped
        system[1, 1] -= pumped
        source = self._source.copy()
        source[0] += joule - pumped * _KELVIN
        source[1] += joule + pumped * _KELVIN
        inverse, size = np.linalg.inv(system), len(source)
        onwards = np.eye(size + 1)
        onwards[:size, :size], onwards[:size, size] = inverse * stored, inverse @ source
        onwards = np.linalg.matrix_power(onwards, count)
        self._state_c = onwards[:size, :size] @ self._state_c + onwards[:size, size]


class SimulatedPlate:
    """A plate on the plant, with the guards a firmware has: lease, limits, trips that latch."""

    simulated = True
    name = "simulated plate"

    def __init__(
        self,
        ambient_c: float = AMBIENT_C,
        sink_k_per_w: float = SINK_K_PER_W,
        stuck_sensor_c: float | None = None,
    ) -> None:
        self._plant = Plant(ambient_c, sink_k_per_w)
        self._stuck_sensor_c = stuck_sensor_c
        self._now: float | None = None
        self._asked_c, self._left_s = NEUTRAL_C, 0.0
        self._returning_s: float | None = None  # since the return to neutral began
        self._on = False
        self._target_c, self._current_a, self._integral_a = NEUTRAL_C, 0.0, 0.0
        self._current_limited = False
        self._dose_cem43, self._heated_s, self._rested_s = 0.0, 0.0, 0.0
        self._faults: tuple[str, ...] = ()

    def command(self, setpoint_c: float, ttl_s: float, now: float) -> None:
        """Hold `setpoint_c`, limited, for `ttl_s`; without effect while a fault is latched."""
        self.advance(now)
        if self._faults or not 0.0 < ttl_s < math.inf:
            return
        if not self._on:
            self._target_c = thermal.within_range(self._sensed_c()).setpoint_c
        self._asked_c = thermal.within_range(setpoint_c).setpoint_c
        self._left_s, self._returning_s, self._on = ttl_s, None, True

    def rest(self, now: float) -> None:
        """Return to neutral, then open the bridge."""
        self.advance(now)
        self._lapse()

    def advance(self, now: float) -> PlateReading:
        """Live up to `now`; a clock that jumps back ends the lease, a long gap is cut short."""
        elapsed_s = 0.0 if self._now is None else now - self._now
        if math.isfinite(now):
            self._now = now
        if not 0.0 <= elapsed_s <= _LONGEST_GAP_S:
            self._lapse()
            elapsed_s = _LONGEST_GAP_S if elapsed_s > 0.0 else 0.0
        ticks = math.ceil(elapsed_s / _TICK_S - 1e-6)
        for _ in range(ticks):
            self._tick(elapsed_s / ticks)
        return self._reading()

    @property
    def state(self) -> State:
        """What the plate is doing."""
        if self._faults:
            return State.FAULTED
        if not self._on:
            return State.OFF
        return State.HOLDING if self._returning_s is None else State.RETURNING

    @property
    def counts(self) -> dict[str, int]:
        """Nothing goes wrong that could be counted."""
        return {}

    def clear(self, fault: str) -> bool:
        """Unlatch one fault unless its cause is still there; the plate stays off."""
        if fault in self._causes():
            return False
        self._faults = tuple(name for name in self._faults if name != fault)
        return True

    def close(self) -> None:
        """Open the bridge for good; only a new command closes it again."""
        self._left_s = 0.0
        self._open()

    def _tick(self, dt_s: float) -> None:
        self._left_s -= dt_s
        if self._left_s < 0.0:
            self._lapse()
        self._trip()
        self._finish_return(dt_s)
        if self._on:
            reading = self._reading()
            limited = thermal.limit(self._asked_c, self._target_c, dt_s, reading)
            self._target_c = limited.setpoint_c
            self._control(self._sensed_c(), dt_s)
        self._plant.step(self._current_a, dt_s)
        self._account(dt_s)

    def _lapse(self) -> None:
        self._asked_c, self._left_s = NEUTRAL_C, 0.0
        if self._on and self._returning_s is None:
            self._returning_s = 0.0

    def _finish_return(self, dt_s: float) -> None:
        if self._returning_s is None:
            return
        self._returning_s += dt_s
        arrived = abs(self._sensed_c() - NEUTRAL_C) < _ARRIVED_C
        if arrived or self._returning_s > _LONGEST_RETURN_S:
            self._open()

    def _trip(self) -> None:
        self._faults += tuple(name for name in self._causes() if name not in self._faults)
        if self._faults:
            self._open()

    def _causes(self) -> tuple[str, ...]:
        found = (
            ("over_temperature", self._sensed_c() >= thermal.PLATE_TRIP_HIGH_C),
            ("under_temperature", self._sensed_c() <= thermal.PLATE_TRIP_LOW_C),
            ("sink_hot", self._plant.sink_c >= thermal.SINK_TRIP_C),
        )
        return tuple(name for name, is_so in found if is_so)

    def _open(self) -> None:
        self._on, self._returning_s, self._asked_c = False, None, NEUTRAL_C
        self._current_a = self._integral_a = 0.0
        self._current_limited, self._target_c = False, NEUTRAL_C

    def _control(self, sensed_c: float, dt_s: float) -> None:
        """PI with gains per direction; the integral waits while more of it would change nothing."""
        error_c = self._target_c - sensed_c
        proportional, integral = _COOL_GAINS if error_c < 0.0 else _HEAT_GAINS
        wanted_a = proportional * error_c + self._integral_a
        self._current_a = min(max(wanted_a, -COOL_LIMIT_A), HEAT_LIMIT_A)
        self._current_limited = wanted_a != self._current_a
        if not self._current_limited or (error_c > 0.0) != (wanted_a > 0.0):
            self._integral_a += integral * error_c * dt_s

    def _account(self, dt_s: float) -> None:
        skin_c = self._plant.skin_c
        halving = 0.5 if skin_c >= 43.0 else 0.25  # CEM43 (reference 3.1, from memory)
        self._dose_cem43 += dt_s / 60.0 * halving ** (43.0 - skin_c)
        if self._on and self._target_c > NEUTRAL_C + THERMAL_FLOOR_C:
            self._heated_s += dt_s
            self._rested_s = 0.0
            return
        self._rested_s += dt_s
        if self._rested_s >= REST_S:
            self._dose_cem43 = self._heated_s = 0.0

    def _sensed_c(self) -> float:
        return self._plant.plate_c if self._stuck_sensor_c is None else self._stuck_sensor_c

    def _reading(self) -> PlateReading:
        limit_a = HEAT_LIMIT_A if self._current_a > 0.0 else COOL_LIMIT_A
        return PlateReading(
            plate_c=self._sensed_c(),
            sink_c=self._plant.sink_c,
            setpoint_c=self._target_c,
            duty=self._current_a / limit_a,
            current_limited=self._current_limited,
            dose_cem43=self._dose_cem43,
            heated_s=self._heated_s,
            faults=self._faults,
        )


def _network(
    palm_w_per_k: float, conductance: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
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
