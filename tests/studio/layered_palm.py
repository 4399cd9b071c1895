"""Runs of a plate under a palm with a horny layer on dermis that blood flows through.

Written for the tests alone, with figures that `plate_flow` does not use: what it takes for skin is
neither this layer nor this dermis.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hapticvlm.devices.simulated.plant import AREA_M2, Module
from hapticvlm_studio.calibration.plate_flow import HARMONICS, PERIOD_S, PHASES, RUN_S, SWINGS_C

STEP_S = 0.05
NOISE_C = 0.01
MIDDLE_C, SINK_C = 26.0, 22.0
PLATE_J_PER_K, PLATE_W_PER_K = 2.5, 0.35
VOLUMETRIC = 3.9e6  # J/(m3 K), of both layers
DERMIS_W_PER_MK = 0.42
BLOOD_W_PER_M3K = 5e3  # what flows through takes heat along
RATES = HARMONICS * (2.0 * np.pi / PERIOD_S)


def impedance(thickness_m: float, conductivity: float) -> NDArray[np.complex128]:
    """Temperature over heat flow at the surface, (harmonics,), m2 K/W."""
    s = 1j * RATES
    horny = 1.0 / np.sqrt(conductivity * VOLUMETRIC * s)
    dermis = 1.0 / np.sqrt(DERMIS_W_PER_MK * (VOLUMETRIC * s + BLOOD_W_PER_M3K))
    passed = np.tanh(thickness_m * np.sqrt(s * VOLUMETRIC / conductivity))
    found: NDArray[np.complex128] = horny * (dermis + horny * passed) / (horny + dermis * passed)
    return found


def run(palm: NDArray[np.complex128] | None, seed: int) -> NDArray[np.float64]:
    """Time, plate, current and sink of one run; `palm` is its admittance, None: bare."""
    at_s = np.arange(0.0, RUN_S, STEP_S)
    swing_c = SWINGS_C * np.exp(1j * (PHASES - np.pi / 2.0))
    admittance = PLATE_W_PER_K + 1j * RATES * PLATE_J_PER_K + (0.0 if palm is None else palm)
    waves = np.exp(1j * at_s[:, None] * RATES)
    plate_c = MIDDLE_C + (waves @ swing_c).real
    heat_w = -0.5 + (waves @ (swing_c * admittance)).real
    sink_c = np.full(at_s.size, SINK_C)
    module = Module()
    linear = module.seebeck * (plate_c + 273.15)
    rest_w = module.conductance * (sink_c - plate_c) - heat_w
    root = np.sqrt(linear**2 - 2.0 * module.resistance * rest_w)
    noise_c = np.random.default_rng(seed).normal(0.0, NOISE_C, at_s.size)
    return np.stack((at_s, plate_c + noise_c, (root - linear) / module.resistance, sink_c), axis=1)


def admittance(
    resistance: float, thickness_m: float, conductivity: float, gain: float
) -> NDArray[np.complex128]:
    """What a palm adds, (harmonics,), W/K; `gain` is its share of the plate's area."""
    found: NDArray[np.complex128] = (
        gain * AREA_M2 / (resistance + impedance(thickness_m, conductivity))
    )
    return found
