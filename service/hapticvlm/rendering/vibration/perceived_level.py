"""How strong a waveform is to a palm on a speaker, and what levels it. Pure.

Strength is the root of the energy over the threshold of each frequency (perception.
drive_threshold_db), in units of a 250 Hz vibration of the same rms.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hapticvlm.perception import drive_threshold_db
from hapticvlm.rendering.vibration.vibration import RATE_HZ

MAX_BOOST = 10.0 ** (12.0 / 20.0)  # more would only drive the amplifier into its limiter
GRID_HZ = np.geomspace(20.0, 400.0, 40)  # centres at which textures are levelled


def perceived_amplitude(wave: NDArray[np.float64]) -> float:
    """Strength of an event (N,) at RATE_HZ: root of its summed energy, relative to 250 Hz."""
    power = np.abs(np.fft.rfft(wave)) ** 2
    hertz = np.arange(float(power.size)) * (RATE_HZ / wave.size)
    return float(np.sqrt(2.0 * np.sum(power * _sensitivity(hertz)) / wave.size))


def drive_needed(cycles: NDArray[np.float64], power: NDArray[np.float64]) -> NDArray[np.float64]:
    """Drive that levels a loop at each of GRID_HZ, (40,), relative to 250 Hz, within reason.

    The loop's power (K,) lies at `cycles` (K,) times the centre frequency.
    """
    total = power.sum()
    felt = (power * _sensitivity(np.outer(GRID_HZ, cycles))).sum(axis=1)
    return np.asarray(np.minimum(1.0 / np.sqrt(felt / total), MAX_BOOST))


def _sensitivity(hertz: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.asarray(10.0 ** (drive_threshold_db(hertz) / -10.0))
