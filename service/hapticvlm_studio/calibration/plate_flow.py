"""Estimates the resistance between a palm and a plate from the heat that flows into the palm. Pure.

The plate swings by about a degree around a middle temperature, by a sum of the HARMONICS of one
slow period, once bare and once with the palm at rest on it. No judgement is asked of the person.

From the current and the temperatures follows the heat P(t) that the module pumps into its face, and
the thermistor gives the temperature T(t). Both are sums of sinusoids after the start has died away,
so at each harmonic of angular frequency w a run has an admittance Y(w) = P / T, a complex number in
W/K: how much heat a swing of one degree takes, and how far ahead of the temperature the heat is.

The palm lies parallel to everything else that takes heat from the face (module, sink, air), and
parallel admittances add. So what the palm takes is the difference of the two runs,

    Y_palm - Y_bare = gain A (1 + i w lag) / (R + Z(w))                             (1)

where R is the plate resistance in m2 K/W, A the area of the plate, and Z the impedance of the skin
behind the resistance, in m2 K/W. Whatever module, sink and driver do by themselves is the same in
both runs and cancels.

Why the phase gives R: bare skin is nearly a half-space, whose impedance 1 / (e sqrt(i w)) makes the
heat lead the temperature by 45 degrees at every frequency. R is real. Put in series, it turns the
sum towards 0 degrees, and the more so the higher the frequency, as |Z| falls with 1 / sqrt(w). The
gain (share of the plate under the palm, Seebeck coefficient, scale of the current) is real too, but
as a factor it leaves the phase alone. So R is known even though the gain is known to 25 % only.

Two things could be mistaken for R and are modelled:
- The thermistor lags behind the face. This is the factor (1 + i w lag) in (1), and it is found from
  the bare run (`_lag_s`).
- The horny layer of a palm is as thick as a card and conducts little; heat of these periods just
  gets through it. If the skin is taken for a half-space, the layer hides 10 to 40 % of R. Its
  thickness is unknown for each person, so it is left open as the gain is: the interval covers it.

The method is our choice; docs/physics.md 1.1 has its figures and how well it does.
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
SETTLE_S = 8.0  # until only a slow drift is left of the start and of the palm's arrival
RUN_S = SETTLE_S + PERIODS * PERIOD_S
HARMONICS = np.array([1.0, 2.0, 3.0])
SWINGS_C = np.array([1.0, 0.5, 0.4])
PHASES = np.array([0.748, 5.139, 2.171])  # of the least peak heating current (computed)
INTERVAL = 0.95

_RAMP_S = 4.0  # until the swing has its full size
# Of the middle temperature. The module heats and cools from there with the current it has: it has
# to lie above the sink, and neither so cold nor so warm that the palm minds.
_ABOVE_SINK_C = 4.0
_COLDEST_C = 22.0
_WARMEST_C = 30.0
_DRIFT_DEGREE = 3  # of the polynomial that absorbs the drift of sink, skin and core
_RESISTANCES = np.geomspace(5e-5, 4e-3, 200)  # m2 K/W
_GAINS = np.exp(np.linspace(-0.8, 0.8, 81))
_GAIN_SPREAD = 0.25  # of its logarithm: palm's area and module within 20 % each; our choice
_MODEL_ERROR = 0.03  # of a harmonic, for what (1) leaves out, such as blood flow; our choice
_LAYERS_M = np.linspace(0.0, 9e-4, 10)  # thickness of the horny layer, each as likely; our choice
_LAYER = Thermal(0.22, 1200, 3400)  # drier than what lies below it (docs/physics.md 1.1)
_MAX_LAG_S = 1.0
_MIN_SWING_C = 0.3  # measured at the first harmonic, of 1 degC that is commanded
_MIN_FLOW_W_PER_K = 0.05  # at the first harmonic; a palm of 1e-3 m2 K/W takes 0.2
_MAX_CHANGE = 0.25  # of the flow, between the halves of a run; our choice

_STILL = "the plate did not swing: its current is at a limit; repeat it in a milder room"

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]


class PalmError(HapticVLMError):
    """Raised when the runs do not show a palm at rest; the message says how to repeat them."""


@dataclass(frozen=True, slots=True)
class PlateEstimate:
    """Plate resistance in m2 K/W with the ends of its 95 % interval; the lag of the bead, s."""

    plate_resistance: float
    low: float
    high: float
    lag_s: float


def middle_c(sink_c: float | None) -> float:
    """Return the temperature to swing around, degC; `sink_c` is the sink's, None if unknown."""
    if sink_c is None:
        return _WARMEST_C
    return min(max(sink_c + _ABOVE_SINK_C, _COLDEST_C), _WARMEST_C)


def trajectory_c(around_c: float, at_s: float) -> float:
    """Return the setpoint in degC at `at_s` seconds after a run began."""
    angles = _rates() * at_s + PHASES
    return around_c + min(at_s / _RAMP_S, 1.0) * float(SWINGS_C @ np.sin(angles))


def estimate(bare: Floats, palm: Floats) -> PlateEstimate:
    """Return the plate resistance from a bare run and a run with a palm, of `trajectory_c`.

    Runs are (n, 4) and (m, 4) float64: s since the run began, plate in degC, current in A (positive
    when it heats), sink in degC. Raises PalmError when the plate did not swing, no palm was there,
    or the palm moved.
    """
    without = _spectrum(bare)
    with_palm = _spectrum(palm)
    if min(abs(without.swing_c[0]), abs(with_palm.swing_c[0])) < _MIN_SWING_C:
        raise PalmError(_STILL)
    flow = with_palm.admittance - without.admittance  # the left side of (1)
    if flow[0].real < _MIN_FLOW_W_PER_K:
        raise PalmError(
            "too little heat went into a palm: touch nothing in the first run, and let the whole "
            "palm rest on the plate in the second"
        )
    # A palm that presses harder or is lifted half-way changes R during the run, and the fit would
    # return some mean of both as if it were certain. Each half alone shows it.
    early, late = (_spectrum(half).admittance for half in _halves(palm))
    if abs(late[0] - early[0]) > _MAX_CHANGE * abs(flow[0]):
        raise PalmError(
            "the palm did not rest still: lay it down without pressing, and repeat the measurement"
        )
    lag_s = _lag_s(without.admittance)
    flow = flow / (1.0 + 1j * _rates() * lag_s)
    error = np.hypot(np.hypot(without.error, with_palm.error), _MODEL_ERROR * np.abs(flow))
    return PlateEstimate(*_posterior(flow, error), lag_s)


def bead_lag_s(bare: Floats) -> float:
    """Return the lag of the thermistor in s, 0 to 1, from a bare run as of `estimate`.

    Raises PalmError when the plate did not swing.
    """
    without = _spectrum(bare)
    if abs(without.swing_c[0]) < _MIN_SWING_C:
        raise PalmError(_STILL)
    return _lag_s(without.admittance)


@dataclass(frozen=True, slots=True)
class _Spectrum:
    """Per harmonic (k,): swing in degC, admittance and its standard error in W/K."""

    swing_c: Complexes
    admittance: Complexes
    error: Floats


def _spectrum(run: Floats) -> _Spectrum:
    """Fit the harmonics of temperature and heat to a run, (n, 4), and divide them."""
    run = run[run[:, 0] >= SETTLE_S]
    at_s, plate_c, current_a, sink_c = run.T
    # Least squares instead of an FFT: telemetry is not evenly spaced, and the drift of sink and
    # skin over the run would leak into the lowest harmonics. A polynomial takes it up.
    drift = np.linspace(-1.0, 1.0, len(run))[:, None] ** np.arange(_DRIFT_DEGREE + 1)
    angles = at_s[:, None] * _rates()
    terms = np.hstack((drift, np.cos(angles), np.sin(angles)))
    measured = np.stack((plate_c, _pumped_w(plate_c, current_a, sink_c)), axis=1)
    fitted, *_ = np.linalg.lstsq(terms, measured, rcond=None)
    # The amplitude of a sinusoid fitted to n samples with residuals of deviation s has the standard
    # error s sqrt(2 / n). For the quotient P / T, relative errors add in quadrature.
    error_c, error_w = np.std(measured - terms @ fitted, axis=0) * np.sqrt(2.0 / len(run))
    cosines, sines = np.split(fitted[_DRIFT_DEGREE + 1 :], 2)
    swing_c, power_w = (cosines - 1j * sines).T  # a cos wt + b sin wt = Re (a - ib) exp(iwt)
    admittance = power_w / swing_c
    error = np.hypot(error_w, np.abs(admittance) * error_c) / np.abs(swing_c)
    return _Spectrum(swing_c, admittance, error)


def _pumped_w(plate_c: Floats, current_a: Floats, sink_c: Floats) -> Floats:
    """Return the heat into the face in W, (n,), by the nominal module (physics.md 2.1).

    Peltier heat a I T, half of the Joule heat R I^2 / 2, and conduction K (T_sink - T). A module
    that differs from the nominal one makes the same error in both runs: what does not depend on the
    palm cancels in the difference, and the rest is a factor, which the gain takes up.
    """
    module = Module()
    peltier_w = module.seebeck * current_a * (plate_c + 273.15)
    joule_w = module.resistance * current_a**2 / 2.0
    return np.asarray(peltier_w + joule_w + module.conductance * (sink_c - plate_c))


def _lag_s(bare: Complexes) -> float:
    """Return the lag of the thermistor in s, from the admittances of the bare run (k,).

    A bare face is a lump of heat capacity C with a conductance K to its surroundings. Its
    admittance, read with a lag, is (K + i w C)(1 + i w lag), whose parts are

        real: K - w^2 C lag         imaginary: w (C + K lag)

    Without a lag the real part would be the same at all frequencies; how it bends with w^2 gives
    C lag, and the slope of the imaginary part gives C + K lag. The heat was computed with the
    module's conductance and the lagging reading (`_pumped_w`), so the real part lacks that
    conductance while the imaginary part has it. Current and reading are some ms apart, which
    bends the imaginary part: its slope is taken at w = 0.
    """
    rates = _rates()
    weights = 1.0 / np.abs(bare)  # relative errors are alike at all harmonics
    terms = np.stack((np.ones_like(rates), -(rates**2)), axis=1)
    (conductance, bend), *_ = np.linalg.lstsq(
        terms * weights[:, None], bare.real * weights, rcond=None
    )
    (slope, _), *_ = np.linalg.lstsq(
        terms * (rates * weights)[:, None], bare.imag * weights, rcond=None
    )
    conductance += Module().conductance
    # bend = C lag and slope = C + K lag give lag = bend / (slope - K lag). K lag is small beside
    # C, so four rounds of substitution settle it.
    lag = 0.0
    for _ in range(4):
        lag = float(np.clip(bend / max(slope - conductance * lag, 1e-3), 0.0, _MAX_LAG_S))
    return lag


def _posterior(flow: Complexes, error: Floats) -> tuple[float, float, float]:
    """Return median and interval of R, from the palm's admittance (k,) without lag and its error.

    Computes the probability of every combination of R, gain and thickness of the horny layer on a
    grid, and sums out the latter two. So the interval of R contains what is not known about them,
    where fixing both at their best values would make it too narrow.
    """
    model = AREA_M2 / (_RESISTANCES[:, None, None] + _skin(_rates()))  # (R, layer, harmonic)
    misfit = flow - _GAINS[None, :, None, None] * model[:, None]  # (R, gain, layer, harmonic)
    log_likelihood = -0.5 * np.sum(np.abs(misfit / error) ** 2, axis=3)  # (R, gain, layer)
    log_likelihood -= 0.5 * ((np.log(_GAINS) / _GAIN_SPREAD) ** 2)[None, :, None]  # prior of gain
    # The largest is subtracted before exp, which would otherwise give 0 everywhere.
    posterior = np.exp(log_likelihood - log_likelihood.max()).sum(axis=(1, 2))
    tail = (1.0 - INTERVAL) / 2.0
    cumulative = np.cumsum(posterior / posterior.sum())
    quantiles = np.interp([tail, 0.5, 1.0 - tail], cumulative, np.log(_RESISTANCES))
    low, median, high = np.exp(quantiles)
    return float(median), float(low), float(high)


def _skin(rates: Floats) -> Complexes:
    """Return the impedance of skin under each of _LAYERS_M, (layers, harmonics), m2 K/W.

    Heat in a layer obeys the equation of a lossy transmission line. A layer of thickness d and
    impedance z_l, ended by deeper skin of impedance z_d, has at its surface

        Z = z_l (z_d + z_l tanh(d sqrt(s / a))) / (z_l + z_d tanh(d sqrt(s / a))),   s = i w

    with a the diffusivity of the layer and z = 1 / (e sqrt(s)) for a material of effusivity e. A
    thick layer (tanh = 1) shows only itself, a thin one (tanh = 0) only what lies below it.
    """
    s = 1j * rates
    horny, deeper = (1.0 / (part.effusivity * np.sqrt(s)) for part in (_LAYER, SKIN))
    diffusivity = _LAYER.conductivity / (_LAYER.density * _LAYER.heat_capacity)
    through = np.tanh(_LAYERS_M[:, None] * np.sqrt(s / diffusivity))
    return np.asarray(horny * (deeper + horny * through) / (horny + deeper * through))


def _halves(run: Floats) -> tuple[Floats, Floats]:
    """Split a run (n, 4) in the middle of its periods, so that each half holds whole ones."""
    at_s = run[:, 0]
    middle_s = SETTLE_S + PERIODS * PERIOD_S / 2.0
    return run[at_s < middle_s], run[at_s >= middle_s]


def _rates() -> Floats:
    """Return the angular frequencies of the harmonics, (k,), 1/s."""
    return np.asarray(HARMONICS * (2.0 * np.pi / PERIOD_S))
