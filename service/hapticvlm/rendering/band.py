"""The band of touch, and the filter that keeps an impact in it. Pure.

Modes above 500 Hz or so, or quickly damped ones above 300, ring past the band's end however softly
they are struck. The filter is causal, so it moves what it filters by about a millisecond; only
materials that need it get it, and none of the built-in ones does.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy import signal

BAND_END_HZ = 1050.0
BAND_DB = -50.5  # of an event's energy may lie above; half a dB for what a seed varies
_ORDER, _RIPPLE_DB, _STOP_DB, _EDGE_HZ = 7, 0.5, 70.0, 800.0  # our choice: flat to 800 Hz

_Floats = NDArray[np.float64]


def above_band_db(wave: _Floats, rate_hz: int) -> float:
    """Energy above BAND_END_HZ of the whole event's (N,), through a Hann window around it, dB."""
    padded = np.pad(wave, wave.size // 2)
    power = np.abs(np.fft.rfft(padded * np.hanning(padded.size))) ** 2
    first = int(BAND_END_HZ * padded.size / rate_hz) + 1
    return float(10.0 * np.log10((power[first:].sum() + 1e-300) / (power.sum() + 1e-300)))


def limited(wave: _Floats, rate_hz: int) -> _Floats:
    """Return the wave (N,) without what lies above the band."""
    return np.asarray(signal.sosfilt(_filter(rate_hz), wave))


@lru_cache(maxsize=8)
def _filter(rate_hz: int) -> _Floats:
    return np.asarray(
        signal.ellip(_ORDER, _RIPPLE_DB, _STOP_DB, _EDGE_HZ, fs=rate_hz, output="sos")
    )
