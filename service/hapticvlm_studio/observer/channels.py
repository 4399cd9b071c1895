"""How strongly a vibration stirs each of the palm's four channels, moment by moment. Pure.

The four channels (Gescheider, Bolanowski) are told apart by frequency: P (Pacinian), NP I, NP II
and NP III. The best of them at each frequency is the palm's own threshold (perception.py). What a
channel receives of a moment is its power over that threshold, summed over what is not masked, in dB
above a floor of 0 dB, below which differences vanish as they do near threshold; P sums time up to
SUMMATION_S. Levels are then counted in Weber steps, so that 1 is a difference just noticed.

Frames are cut sharply, so that an onset keeps its strength. The price: a pure tone between two bins
leaks and is told from its neighbours more finely than people can (18-30 %), two tones on bins near
250 Hz, where no channel's slope helps, less finely.

A cone's movement is perception.py's: it follows the drive below its resonance and accelerates with
it above. Nobody has measured a speaker yet.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray
from scipy.signal import find_peaks

from hapticvlm.perception import SPEAKER_RESONANCE_HZ, drive_threshold_db, threshold_db

_Floats = NDArray[np.float64]

CHANNELS = ("P", "NP I", "NP II", "NP III")
WINDOWS_S = ((0.0, 0.05), (0.05, 0.15), (0.15, 0.5), (0.5, math.inf))  # from the onset on
FRAME_S = 0.05  # s, of one spectrum: the shortest window

# dB that a full-scale sine of 250 Hz is above its threshold: where the psychohaptic model of MPEG
# (ISO/IEC 23090-31) has it. A real speaker's level is one figure to change here.
FULL_SCALE_DB = 45.0
SUMMATION_S = 0.2  # s, P alone sums time, over 0.2-1 s (docs/physics.md 5)
# dB, one Weber step of amplitude at the thenar: 0.20 at 125 Hz and 0.58 at 10 Hz (Forta, Griffin
# and Morioka 2012). NP II and NP III were not measured there and get the larger one.
WEBER_DB = np.array([1.6, 4.0, 4.0, 4.0])

# Channel thresholds, dB re 1 um peak, and slopes, dB per octave (physics.md 5; Gescheider,
# Bolanowski; unchecked, +-5 dB): NP I is flat to 40 Hz, NP II best at 300 Hz, NP III flat to 3 Hz.
_NP_I_DB = 12.0
_NP_I_HZ = 40.0
_NP_II_DB = 10.0
_NP_II_HZ = 300.0
_NP_III_DB = 28.0
_NP_III_HZ = 3.0
_NP_SLOPE_DB = 6.0
_P_SLOPE_DB = 12.0

# A peak masks its neighbours as the model of MPEG has it: which peaks, and how far.
_PROMINENCE_DB = 12.0
_PEAK_RANGE_DB = 45.0
_MASK_BELOW_DB = 5.0
_MASK_DB_PER_HZ = 5.0 / 1400.0
_MASK_FALL_DB = 30.0
_BAND_HZ = (1.0, 1000.0)
_QUIET = 1e-16


def channel_threshold_db(frequency_hz: _Floats) -> _Floats:
    """Smallest vibration each channel answers to, dB re 1 um peak, (4, ...) for any shape > 0."""
    octaves = np.log2(frequency_hz)
    low = np.maximum(math.log2(_NP_I_HZ) - octaves, 0.0)
    return np.array(
        [
            threshold_db(frequency_hz) + _P_SLOPE_DB * low,
            _NP_I_DB + _NP_SLOPE_DB * np.maximum(octaves - math.log2(_NP_I_HZ), 0.0),
            _NP_II_DB + _NP_SLOPE_DB * np.abs(octaves - math.log2(_NP_II_HZ)),
            _NP_III_DB + _NP_SLOPE_DB * np.maximum(octaves - math.log2(_NP_III_HZ), 0.0),
        ]
    )


def displacement_db(frequency_hz: _Floats) -> _Floats:
    """Peak movement of a full-scale sine, dB re 1 um, any shape."""
    above = np.log10(np.maximum(frequency_hz, SPEAKER_RESONANCE_HZ) / 250.0)
    return np.asarray(FULL_SCALE_DB + threshold_db(250.0) - 40.0 * above)


def masked_db(level_db: _Floats, frequency_hz: _Floats) -> _Floats:
    """Level under which nothing is felt beside the spectrum's peaks, dB re full scale, (bins,)."""
    found, _ = find_peaks(np.pad(level_db, 1, constant_values=-300.0), prominence=_PROMINENCE_DB)
    peaks = found - 1
    peaks = peaks[level_db[peaks] >= level_db.max() - _PEAK_RANGE_DB]
    mask = 10.0 ** ((drive_threshold_db(frequency_hz) - FULL_SCALE_DB) / 10.0)
    for peak_hz, height_db in zip(frequency_hz[peaks], level_db[peaks], strict=True):
        apart = (frequency_hz - peak_hz) / peak_hz
        fall_db = _MASK_BELOW_DB - _MASK_DB_PER_HZ * peak_hz + _MASK_FALL_DB * apart**2
        mask = mask + 10.0 ** ((height_db - fall_db) / 10.0)
    return np.asarray(10.0 * np.log10(mask))


def levels_db(wave: NDArray[np.floating], rate_hz: int) -> _Floats:
    """Perceived level of each channel in each window, dB above its floor, (4, windows), from 0 up.

    `wave` is (N,), 1 being full scale; what comes after its end is silence.
    """
    frequency_hz, power = _spectra(wave, rate_hz)
    unmasked = np.zeros_like(power)
    for frame, spectrum in enumerate(power):
        level_db = 10.0 * np.log10(np.maximum(spectrum, _QUIET))
        unmasked[frame] = np.where(level_db > masked_db(level_db, frequency_hz), spectrum, 0.0)
    over_db = displacement_db(frequency_hz) - channel_threshold_db(frequency_hz)
    energy = unmasked @ (10.0 ** (over_db / 10.0)).T
    return np.array([_window(energy, *window) for window in WINDOWS_S]).T


def louder_db(level_db: _Floats, gain_db: _Floats) -> _Floats:
    """Levels with so much more gain, any shapes that fit; what rises from under the mask is not."""
    energy = 10.0 ** (level_db / 10.0) - 1.0
    return np.asarray(10.0 * np.log10(1.0 + energy * 10.0 ** (gain_db / 10.0)))


def vibration_steps(wave: NDArray[np.floating], rate_hz: int) -> _Floats:
    """Return what the observer takes from a vibration, in Weber steps, (4 x windows,)."""
    return np.asarray((levels_db(wave, rate_hz) / WEBER_DB[:, None]).ravel())


def _spectra(wave: NDArray[np.floating], rate_hz: int) -> tuple[_Floats, _Floats]:
    """Power of each frame and bin re a full-scale sine, (frames, bins), and the bins' Hz."""
    size = round(FRAME_S * rate_hz)
    frames = max(math.ceil(wave.size / size), round(WINDOWS_S[-1][0] / FRAME_S) + 1)
    whole = np.zeros(frames * size)
    whole[: wave.size] = wave
    spectrum = np.fft.rfft(whole.reshape(frames, size), axis=1)
    power = np.asarray(np.abs(spectrum * (2.0 / size)) ** 2, dtype=np.float64)
    frequency_hz = np.arange(power.shape[1], dtype=np.float64) * (rate_hz / size)
    band = (frequency_hz >= _BAND_HZ[0]) & (frequency_hz <= _BAND_HZ[1])
    return frequency_hz[band], power[:, band]


def _window(energy: _Floats, begin_s: float, end_s: float) -> _Floats:
    """Level of one window, (4,), of the energy of all frames, (frames, 4)."""
    first = round(begin_s / FRAME_S)
    last = len(energy) if end_s == math.inf else round(end_s / FRAME_S)
    mean = energy[first:last].mean(axis=0)
    mean[0] *= min((last - first) * FRAME_S, SUMMATION_S) / SUMMATION_S
    return np.asarray(10.0 * np.log10(1.0 + mean))
