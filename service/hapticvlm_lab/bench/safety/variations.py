"""Plates as they are built and rooms as they are: seeded scatter around the one plant model.

Every range is an assumption of this project: no series of such plates was measured.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from hapticvlm.devices.simulated.plant import CONDUCTANCE, RESISTANCE, SEEBECK, Module, Plant

SEED = 11


@dataclass(frozen=True, slots=True)
class Variation:
    """One plate: module, sink, room, palm, supply and thermistors."""

    module: Module
    sink_k_per_w: float
    ambient_c: float
    palm_resistance: float  # when a palm is there
    supply: float  # of the nominal current
    offsets_c: tuple[float, float, float]  # of the thermistors on plate, plate and sink

    def plant(self) -> Plant:
        """Return the plant, without a hand, warm from use."""
        return Plant(
            self.ambient_c,
            self.sink_k_per_w,
            palm_resistance=math.inf,
            sink_c=self.ambient_c + 1.0,
            module=self.module,
        )


def draw(count: int, seed: int = SEED) -> list[Variation]:
    """Draw plates, always the same ones for a seed."""
    rng = np.random.default_rng(seed)
    return [_variation(rng) for _ in range(count)]


def _variation(rng: np.random.Generator) -> Variation:
    module = Module(
        seebeck=SEEBECK * rng.uniform(0.95, 1.05),
        resistance=RESISTANCE * rng.uniform(0.9, 1.15),
        conductance=CONDUCTANCE * rng.uniform(0.9, 1.1),
        face_j_per_k=rng.uniform(0.7, 2.0),
        sink_j_per_k=rng.uniform(20.0, 150.0),
    )
    offsets = rng.normal(0.0, 0.2, 3)  # degC, of 1 % parts
    return Variation(
        module,
        sink_k_per_w=rng.uniform(1.0, 5.0),
        ambient_c=rng.uniform(15.0, 32.0),
        palm_resistance=float(10.0 ** rng.uniform(-4.0, -3.0)),
        supply=rng.uniform(0.85, 1.1),
        offsets_c=(float(offsets[0]), float(offsets[1]), float(offsets[2])),
    )
