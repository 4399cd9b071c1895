"""Filters whole waves: to another rate, and to the band of touch. Pure."""

from __future__ import annotations

from math import gcd

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

# The low pass of another rate: a sinc of so many zero crossings on either side under a Kaiser
# window, 60 dB down.
CROSSINGS = 10
KAISER = 5.0
# An elliptic low pass of order 7, flat to .5 dB and 70 dB down above: gain, zeros and poles for an
# edge of 1 rad/s. Zeros and poles off the real axis come in pairs; one of each pair is listed.
GAIN = 0.002466880272644563
ZEROS = (2.670448363043991j, 1.6084033236303312j, 1.3705559485729384j)
POLES = (
    -0.31413629230250506,
    -0.24803660482683898 - 0.5357300970506637j,
    -0.12936990261282358 - 0.8686511983175j,
    -0.03716800380091491 - 1.0054621053900181j,
)
RINGS_S = 0.3  # after which nothing is left of an impulse: below 1e-12

Floats = NDArray[np.float64]


def resample(wave: NDArray[np.floating], up: int, down: int) -> Floats:
    """Return a wave (N,) at up / down times its rate, (ceil(N up / down),)."""
    up, down = up // gcd(up, down), down // gcd(up, down)
    slower = max(up, down)
    half = CROSSINGS * slower
    low = np.sinc(np.arange(-half, half + 1) / slower) * np.kaiser(2 * half + 1, KAISER)
    low *= up / low.sum()
    # Sample m of the result lies at m * down / up of the wave: between its sample `first` and the
    # next, `phase` / up behind the former. Every up-th result has the same phase, thus weights.
    reach = half // up + 1
    around = sliding_window_view(
        np.pad(np.asarray(wave, np.float64), (reach, reach + down)), 2 * reach + 1
    )
    weights = np.pad(low, up)
    result = np.empty(-(-len(wave) * up // down))
    for m in range(min(up, len(result))):
        first, phase = divmod(m * down, up)
        places = up + half + phase + up * np.arange(reach, -reach - 1, -1)
        used = weights[np.clip(places, 0, len(weights) - 1)]
        result[m::up] = around[first::down][: len(result[m::up])] @ used
    return result


def low_passed(wave: Floats, edge_hz: float, rate_hz: int) -> Floats:
    """Remove from a wave (N,) what lies above the edge, by the elliptic low pass; (N,)."""
    # The bilinear transform only bends the axis of frequencies, so the response is exact.
    count = len(wave) + round(RINGS_S * rate_hz)
    count += 1 - count % 2  # odd: half the rate, where the bent axis ends, is no frequency of it
    bent = np.tan(np.pi * np.arange(count // 2 + 1) / count) / np.tan(np.pi * edge_hz / rate_hz)
    s = 1j * bent[:, None]
    response = GAIN * np.prod(s - _pairs(ZEROS), axis=1) / np.prod(s - _pairs(POLES), axis=1)
    return np.fft.irfft(np.fft.rfft(wave, count) * response, count)[: len(wave)]


def _pairs(of: tuple[complex, ...]) -> NDArray[np.complex128]:
    return np.array([*of, *(each.conjugate() for each in of if each.imag)])
