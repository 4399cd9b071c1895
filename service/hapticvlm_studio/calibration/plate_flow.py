"""Resistance between a palm and a plate, from the heat that the palm takes. Pure; asks nobody.

The plate swings by a degree around a temperature, a sum of HARMONICS of one slow period, once with
nothing on it and once with the palm at rest on it. With the module's pumped heat P(t), from current
and temperatures, and the reading T(t), each harmonic w of a run has an admittance Y = P / T. What
the palm adds is the difference of the two runs: skin behind the resistance R,

    Y_palm - Y_bare = gain A (1 + i w lag) / (R + Z(w))

where Z is the impedance of a horny layer on deeper skin. The palm's is as thick as a card, and heat
of these periods just gets through it: taken for a half-space it hides 10 to 40 % of R. Nobody knows
how thick his is, so its thickness is left open as the gain is, and the interval covers it. So
whatever the module, its sink and its driver do of their own accord cancels. R shifts the phase
from the 45 degrees of bare skin: it is known even where the gain (palm's area, Seebeck coefficient,
driver) is not. The lag of the thermistor is what bends the bare admittance (K + i w C)(1 + i w lag)
away from that of a lump. Method: our choice (docs/physics.md 1.1, which has what it reaches).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hapticvlm.devices.simulated.plant import AREA_M2, Module
from hapticvlm.errors import HapticVLMError
from hapticvlm.materials import Thermal
from hapticvlm.rendering.heat.contact import SKIN

PERIOD_S = 8.0
PERIODS = 8
SETTLE_S = 8.0  # until the palm that came and the plate that began are steady but for slow drift
RUN_S = SETTLE_S + PERIODS * PERIOD_S
HARMONICS = np.array([1.0, 2.0, 3.0])
SWINGS_C = np.array([1.0, 0.5, 0.4])
PHASES = np.array([0.748, 5.139, 2.171])  # ask for the least heating current at once (computed)
INTERVAL = 0.95

_RISE_S = 4.0  # until the swing has its size
# of the middle: room to heat and to cool
_ABOVE_SINK_C = 4.0
_COLDEST_C = 22.0
_WARMEST_C = 30.0
_DRIFT_DEGREE = 3  # of the polynomial that takes the drift of sink, skin and core
_RESISTANCES = np.geomspace(5e-5, 4e-3, 200)  # m2 K/W
_GAINS = np.exp(np.linspace(-0.8, 0.8, 81))
_GAIN_SPREAD = 0.25  # of its logarithm: palm's area and module within 20 % each; our choice
_MODEL_ERROR = 0.03  # of a harmonic: real skin has blood in it; our choice
_LAYERS_M = np.linspace(0.0, 9e-4, 10)  # of the horny layer, each as likely; our choice
_LAYER = Thermal(0.22, 1200, 3400)  # drier than what lies below it (docs/physics.md 1.1)
_LONGEST_LAG_S = 1.0
_LEAST_SWING_C = 0.3  # at the first harmonic, of 1 that were asked for
_LEAST_FLOW_W_PER_K = 0.05  # at the first harmonic; a palm of 1e-3 m2 K/W takes 0.2
_LARGEST_CHANGE = 0.25  # of the flow, between the halves of a run; our choice

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]


class PalmError(HapticVLMError):
    """The runs say nothing about a palm; the text says what to do."""


@dataclass(frozen=True, slots=True)
class PlateEstimate:
    """Plate resistance in m2 K/W with its interval."""

    plate_resistance: float
    low: float
    high: float


def middle_c(sink_c: float | None) -> float:
    """Return the temperature to swing around, degC, in reach of the current on this sink."""
    if sink_c is None:
        return _WARMEST_C
    return min(max(sink_c + _ABOVE_SINK_C, _COLDEST_C), _WARMEST_C)


def course_c(around_c: float, at_s: float) -> float:
    """Return the setpoint in degC, so long after a run began."""
    angles = _rates() * at_s + PHASES
    return around_c + min(at_s / _RISE_S, 1.0) * float(SWINGS_C @ np.sin(angles))


def estimate(bare: Floats, palm: Floats) -> PlateEstimate:
    """Find the plate resistance from two runs of `course_c`, bare and with a palm.

    Runs are (n, 4) and (m, 4) float64: s since the run began, plate in degC, current in A (positive
    when it heats), sink in degC. Raises PalmError.
    """
    without = _spectrum(bare)
    with_palm = _spectrum(palm)
    if min(abs(without.swing_c[0]), abs(with_palm.swing_c[0])) < _LEAST_SWING_C:
        raise PalmError("the plate did not swing: its current is at a limit; try in a milder room")
    taken = with_palm.admittance - without.admittance
    if taken[0].real < _LEAST_FLOW_W_PER_K:
        raise PalmError(
            "too little heat went into a palm: touch nothing in the first run, and let the whole "
            "palm rest on the plate in the second"
        )
    early, late = (_spectrum(half).admittance for half in _halves(palm))
    if abs(late[0] - early[0]) > _LARGEST_CHANGE * abs(taken[0]):
        raise PalmError("the palm did not rest still: lay it down without pressing, and try again")
    taken = taken / (1.0 + 1j * _rates() * _lag_s(without.admittance))
    error = np.hypot(np.hypot(without.error, with_palm.error), _MODEL_ERROR * np.abs(taken))
    return _posterior(taken, error)


@dataclass(frozen=True, slots=True)
class _Spectrum:
    """Per harmonic (k,): swing in degC, admittance and its standard error in W/K."""

    swing_c: Complexes
    admittance: Complexes
    error: Floats


def _spectrum(run: Floats) -> _Spectrum:
    run = run[run[:, 0] >= SETTLE_S]
    at_s, plate_c, current_a, sink_c = run.T
    slow = np.linspace(-1.0, 1.0, len(run))[:, None] ** np.arange(_DRIFT_DEGREE + 1)
    angles = at_s[:, None] * _rates()
    terms = np.hstack((slow, np.cos(angles), np.sin(angles)))
    measured = np.stack((plate_c, _pumped_w(plate_c, current_a, sink_c)), axis=1)
    fitted, *_ = np.linalg.lstsq(terms, measured, rcond=None)
    error_c, error_w = np.std(measured - terms @ fitted, axis=0) * np.sqrt(2.0 / len(run))
    cosines, sines = np.split(fitted[_DRIFT_DEGREE + 1 :], 2)
    swing_c, power_w = (cosines - 1j * sines).T
    admittance = power_w / swing_c
    error = np.hypot(error_w, np.abs(admittance) * error_c) / np.abs(swing_c)
    return _Spectrum(swing_c, admittance, error)


def _pumped_w(plate_c: Floats, current_a: Floats, sink_c: Floats) -> Floats:
    """Heat into the face by the module's type, W, (n,); it need not be right, only the same."""
    module = Module()
    peltier_w = module.seebeck * current_a * (plate_c + 273.15)
    joule_w = module.resistance * current_a**2 / 2.0
    return np.asarray(peltier_w + joule_w + module.conductance * (sink_c - plate_c))


def _lag_s(bare: Complexes) -> float:
    """Lag of the reading from (K + i w C)(1 + i w lag), the admittance of a lump read late."""
    rates = _rates()
    weights = 1.0 / np.abs(bare)
    terms = np.stack((np.ones_like(rates), -(rates**2)), axis=1)
    (conductance, bend), *_ = np.linalg.lstsq(
        terms * weights[:, None], bare.real * weights, rcond=None
    )
    slope = float(np.sum(bare.imag * rates * weights**2) / np.sum((rates * weights) ** 2))
    lag = 0.0  # bend = C lag, slope = C + K lag
    for _ in range(4):
        lag = float(np.clip(bend / max(slope - conductance * lag, 1e-3), 0.0, _LONGEST_LAG_S))
    return lag


def _posterior(taken: Complexes, error: Floats) -> PlateEstimate:
    """Median and interval over R, gain and horny layer left open within their spreads."""
    model = AREA_M2 / (_RESISTANCES[:, None, None] + _skin(_rates()))  # (R, layer, harmonic)
    misses = taken - _GAINS[None, :, None, None] * model[:, None]
    likely = -0.5 * np.sum(np.abs(misses / error) ** 2, axis=3)  # (R, gain, layer)
    likely -= 0.5 * ((np.log(_GAINS) / _GAIN_SPREAD) ** 2)[None, :, None]
    belief = np.exp(likely - likely.max()).sum(axis=(1, 2))
    tail = (1.0 - INTERVAL) / 2.0
    below = np.cumsum(belief / belief.sum())
    low, middle, high = np.exp(np.interp([tail, 0.5, 1.0 - tail], below, np.log(_RESISTANCES)))
    return PlateEstimate(float(middle), float(low), float(high))


def _skin(rates: Floats) -> Complexes:
    """Return the impedance of skin under each of _LAYERS_M, (layers, harmonics), m2 K/W.

    A line of length d, ended by what lies below it: the layer's own impedance where it is thick,
    that of the deeper skin where it is thin.
    """
    s = 1j * rates
    horny, below = (1.0 / (part.effusivity * np.sqrt(s)) for part in (_LAYER, SKIN))
    diffusivity = _LAYER.conductivity / (_LAYER.density * _LAYER.heat_capacity)
    passed = np.tanh(_LAYERS_M[:, None] * np.sqrt(s / diffusivity))
    return np.asarray(horny * (below + horny * passed) / (horny + below * passed))


def _halves(run: Floats) -> tuple[Floats, Floats]:
    at_s = run[:, 0]
    middle_s = SETTLE_S + PERIODS * PERIOD_S / 2.0
    return run[at_s < middle_s], run[at_s >= middle_s]


def _rates() -> Floats:
    """Angular rates of the harmonics, (k,), 1/s."""
    return np.asarray(HARMONICS * (2.0 * np.pi / PERIOD_S))
