"""Computes how strong a waveform feels to a palm on a speaker, and the drive that levels it. Pure.

A palm is most sensitive near 250 Hz and needs far more vibration below and above (docs/physics.md
4.1). So the energy at each frequency is weighed by the threshold there
(`perception.drive_threshold_db`). The perceived strength is the root of the weighed energy, in
units of a vibration at 250 Hz with the same rms.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hapticvlm.perception import FULL_SCALE_DB, drive_threshold_db
from hapticvlm.rendering.vibration.vibration import RATE_HZ

MAX_BOOST = 10.0 ** (12.0 / 20.0)  # more would only drive the amplifier into its limiter
GRID_HZ = np.geomspace(20.0, 400.0, 40)  # centre frequencies at which textures are levelled
SUMMATION_S = 0.1  # of an event, over which its level above the threshold is a mean; our choice
THIRD_OCTAVES_HZ = tuple((25.0 * 2.0 ** (np.arange(18) / 3.0)).tolist())  # and the end of the last


def perceived_amplitude(wave: NDArray[np.float64]) -> float:
    """Perceived strength of an event (N,) at RATE_HZ: the root of its summed, weighed energy."""
    power = np.abs(np.fft.rfft(wave)) ** 2
    hertz = np.arange(float(power.size)) * (RATE_HZ / wave.size)
    return float(np.sqrt(2.0 * np.sum(power * _sensitivity(hertz)) / wave.size))


def sensation_db(wave: NDArray[np.float64], full_scale_db: float = FULL_SCALE_DB) -> float:
    """Return how far an event (N,) at RATE_HZ lies above the threshold of the palm, dB.

    It is the level of its strongest third octave, over the SUMMATION_S for which a palm adds up a
    vibration. A full-scale sine of 250 Hz is `full_scale_db` above the threshold.
    """
    size = round(SUMMATION_S * RATE_HZ)
    power = np.abs(np.fft.rfft(wave[:size], size)) ** 2
    edges = np.round(np.array(THIRD_OCTAVES_HZ) * (SUMMATION_S * 2.0 ** (-1.0 / 6.0))).astype(int)
    bands = np.add.reduceat(power[: edges[-1]], edges[:-1])
    # A sine of amplitude 1 has power size^2 / 4 in its line.
    drive_db = 10.0 * np.log10(4.0 * bands / size**2 + 1e-20)
    threshold_db = drive_threshold_db(np.array(THIRD_OCTAVES_HZ[:-1]))
    return float(full_scale_db + (drive_db - threshold_db).max())


def drive_needed(cycles: NDArray[np.float64], power: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the drive that makes a loop equally strong at each of GRID_HZ, (40,).

    It is relative to the drive at 250 Hz, and at most MAX_BOOST. The loop's power (K,) lies at
    `cycles` (K,) times the centre frequency.
    """
    total = power.sum()
    felt = (power * _sensitivity(np.outer(GRID_HZ, cycles))).sum(axis=1)
    return np.asarray(np.minimum(1.0 / np.sqrt(felt / total), MAX_BOOST))


def _sensitivity(hertz: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.asarray(10.0 ** (drive_threshold_db(hertz) / -10.0))
