"""Levels of a vibration on one grid, and how far two of them are apart to a palm."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hapticvlm.perception import felt_difference_db
from hapticvlm.rendering.interactions import RATE_HZ

_Floats = NDArray[np.float64]

SIZE = 16_384  # samples of a spectrum, 2.9 Hz a line


def event_db(wave: NDArray[np.float32]) -> tuple[_Floats, _Floats]:
    """Frequencies and levels (K,) of one event within SIZE samples, dB re full scale."""
    return _levels(np.abs(np.fft.rfft(wave[:SIZE].astype(np.float64), SIZE)) ** 2)


def steady_db(wave: NDArray[np.float32]) -> tuple[_Floats, _Floats]:
    """Frequencies and mean levels (K,) of a steady wave (N,), dB re full scale."""
    frames = wave[: wave.size // SIZE * SIZE].astype(np.float64).reshape(-1, SIZE)
    window = np.hanning(SIZE)
    power = np.mean(np.abs(np.fft.rfft(frames * window)) ** 2, axis=0) / np.mean(window**2)
    return _levels(power)


def difference_db(meant: tuple[_Floats, _Floats], given: tuple[_Floats, _Floats]) -> float:
    """Return perception.felt_difference_db of two spectra of the same kind."""
    hertz, meant_db = meant
    inside = hertz <= 1100.0
    return felt_difference_db(hertz[inside], meant_db[inside], given[1][inside])


def _levels(power: _Floats) -> tuple[_Floats, _Floats]:
    hertz = np.arange(float(power.size)) * (RATE_HZ / SIZE)
    return hertz, 10.0 * np.log10(4.0 * power / SIZE**2 + 1e-20)
