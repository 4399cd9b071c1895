"""A simulated plate of which only the type is known, and a palm that is laid on it."""

from __future__ import annotations

import math

import numpy as np

from hapticvlm.devices.simulated.plant import (
    CONDUCTANCE,
    CORE_C,
    FACE_J_PER_K,
    RESISTANCE,
    SEEBECK,
    Module,
    Plant,
)
from hapticvlm.devices.simulated.simulated import SimulatedPlate

TYPE = (SEEBECK, RESISTANCE, CONDUCTANCE, FACE_J_PER_K)
NOISE_C = 0.01  # of a reading; the compiled firmware's is smaller


class UnknownPlate(SimulatedPlate):
    """Module, sink, room, thermistor and palm differ from what the fit takes for granted.

    Seebeck coefficient, resistance, conductance, heat capacity and the palm's area lie within 20 %
    of the type's each, the skin's effusivity within 8 %. In the plant a palm on a larger area is
    one on a smaller module, and one of another effusivity is larger, with another resistance.
    """

    def __init__(
        self,
        seed: int,
        *,
        room_c: float | None = None,
        area: float | None = None,
        bead_lag_s: float | None = None,
    ):
        super().__init__(palm_resistance=math.inf)
        self._chance = chance = np.random.default_rng(seed)
        off, self._effusive = chance.uniform(0.8, 1.2, 5), chance.uniform(0.92, 1.08)
        size = (off[0] if area is None else area) * self._effusive
        sink_j, sink_k = chance.uniform(50.0, 300.0), chance.uniform(1.5, 2.5)
        drawn_room_c = chance.uniform(18.0, 27.0)
        seebeck, resistance, conductance, face_j = np.array(TYPE) * off[1:] / size
        module = Module(seebeck, resistance, conductance, face_j, sink_j / size)
        room_c = drawn_room_c if room_c is None else room_c
        self._plant = Plant(room_c, sink_k * size, math.inf, module=module)
        self._true_lag_s, self._palm_c = chance.uniform(0.01, 0.15), chance.uniform(28.0, 35.0)
        self._true_lag_s = self._true_lag_s if bead_lag_s is None else bead_lag_s
        self.lag_s = self._true_lag_s
        self._bead_c = self._read_c = self._plant.plate_c

    def lay(self, resistance: float) -> None:
        """Lay a palm on that comes from elsewhere, with a temperature of its own."""
        skin_c = self._plant._state_c[2:]
        skin_c[:] = np.linspace(self._palm_c, CORE_C, len(skin_c))
        self.touch(resistance * self._effusive)

    def _tick(self, dt_s: float) -> None:
        share = -math.expm1(-dt_s / self._true_lag_s)
        self._bead_c += (self._plant.plate_c - self._bead_c) * share
        self._read_c = self._bead_c + self._chance.normal(0.0, NOISE_C)
        super()._tick(dt_s)

    def _sensed_c(self) -> float:
        return self._read_c
