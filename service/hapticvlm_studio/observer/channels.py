"""Models how strongly a vibration excites each of the palm's four channels over time. Pure.

Glabrous skin has four populations of mechanoreceptors that respond to vibration, the channels P
(Pacinian), NP I, NP II and NP III (Gescheider, Bolanowski; docs/physics.md 5). Each has a threshold
of its own as a function of frequency, and the lowest of the four at a frequency is the threshold
that a person shows (perception.py). A pattern is described by the level of each channel in each of
four windows of time after the onset. For channel c and one frame of 50 ms,

    E_c = sum over unmasked bins f of  P(f) / P_c(f)                                (1)
    L_c = 10 log10(1 + mean of E_c over the window)                                 (2)

where P(f) is the power of the movement at f and P_c(f) the power at the channel's threshold. Far
above threshold (2) is the usual level in dB. Near and below it the 1 takes over and L_c goes to 0
instead of minus infinity: two vibrations that are both too weak to be felt are alike. P, and P
alone, sums energy over time up to SUMMATION_S, so it needs a longer vibration for the same level.

Levels divided by the Weber fraction in dB give Weber steps: 1 is a difference that is just noticed.
`answers` compares patterns in these units.

Frames are cut without a window function, so that an onset keeps its strength. The price is leakage:
a pure tone between two bins spreads over both and is distinguished from its neighbours more finely
than people can (18-30 %), and two tones on bins near 250 Hz, where the channels' slopes do not
help, less finely.

The movement of the speaker's cone is that of perception.py: it follows the drive below the
resonance and accelerates with it above. No speaker has been measured yet.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray
from scipy.signal import find_peaks

from hapticvlm.perception import (
    FULL_SCALE_DB,
    SPEAKER_RESONANCE_HZ,
    drive_threshold_db,
    threshold_db,
)

_Floats = NDArray[np.float64]

CHANNELS = ("P", "NP I", "NP II", "NP III")
WINDOWS_S = ((0.0, 0.05), (0.05, 0.15), (0.15, 0.5), (0.5, math.inf))  # after the onset; our choice
FRAME_S = 0.05  # s, of one spectrum: the shortest window

SUMMATION_S = 0.2  # s, of channel P; sources have 0.2 to 1 s (docs/physics.md 5)
# One Weber step of amplitude at the thenar in dB, by channel: 20 log10(1.20) at 125 Hz and
# 20 log10(1.58) at 10 Hz (Forta, Griffin and Morioka 2012). They did not measure NP II and NP III,
# which get the larger step here.
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

# Masking by the psychohaptic model of MPEG (physics.md 4.1): which peaks mask, and how far.
_PROMINENCE_DB = 12.0
_PEAK_RANGE_DB = 45.0
_MASK_BELOW_DB = 5.0
_MASK_DB_PER_HZ = 5.0 / 1400.0
_MASK_FALL_DB = 30.0
_BAND_HZ = (1.0, 1000.0)
_QUIET = 1e-16


def channel_threshold_db(frequency_hz: _Floats) -> _Floats:
    """Return the threshold of each channel, dB re 1 um peak, (4, ...) for frequencies > 0.

    P is the threshold of the palm down to 40 Hz, where the others take over, and rises below.
    """
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
    """Return the peak movement of a full-scale sine, dB re 1 um, any shape."""
    # A constant acceleration is a movement that falls with the square of the frequency, 40 dB per
    # decade. Below its resonance the cone moves by the same amount at all frequencies.
    above = np.log10(np.maximum(frequency_hz, SPEAKER_RESONANCE_HZ) / 250.0)
    return np.asarray(FULL_SCALE_DB + threshold_db(250.0) - 40.0 * above)


def masked_db(level_db: _Floats, frequency_hz: _Floats) -> _Floats:
    """Return the level below which a bin is not felt, dB re full scale, (bins,).

    `level_db` is the spectrum, (bins,) dB re full scale, at `frequency_hz`, (bins,).
    """
    # find_peaks does not report the ends of an array; a padding of silence lets them be peaks.
    padded = np.pad(level_db, 1, constant_values=-300.0)
    peaks = find_peaks(padded, prominence=_PROMINENCE_DB)[0] - 1
    peaks = peaks[level_db[peaks] >= level_db.max() - _PEAK_RANGE_DB]
    # The mask starts from the absolute threshold. Each peak of height H at fp adds the power of
    # H - 5 + (5 / 1400) fp - 30 ((f - fp) / fp)^2 dB: strongest at its own frequency, where it lies
    # just below the peak, and falling to both sides. Powers add.
    mask = 10.0 ** ((drive_threshold_db(frequency_hz) - FULL_SCALE_DB) / 10.0)
    for peak_hz, height_db in zip(frequency_hz[peaks], level_db[peaks], strict=True):
        offset = (frequency_hz - peak_hz) / peak_hz
        fall_db = _MASK_BELOW_DB - _MASK_DB_PER_HZ * peak_hz + _MASK_FALL_DB * offset**2
        mask = mask + 10.0 ** ((height_db - fall_db) / 10.0)
    return np.asarray(10.0 * np.log10(mask))


def levels_db(wave: NDArray[np.floating], rate_hz: int) -> _Floats:
    """Return the level of each channel in each window by (2), dB >= 0, (4, windows).

    `wave` is (N,) with full scale 1, from the onset on; after its end it is silent.
    """
    frequency_hz, power = _spectra(wave, rate_hz)
    unmasked = np.zeros_like(power)
    for frame, spectrum in enumerate(power):
        level_db = 10.0 * np.log10(np.maximum(spectrum, _QUIET))
        unmasked[frame] = np.where(level_db > masked_db(level_db, frequency_hz), spectrum, 0.0)
    # P(f) / P_c(f) of (1) for a full-scale sine in every bin; the spectrum scales it.
    over_db = displacement_db(frequency_hz) - channel_threshold_db(frequency_hz)
    energy = unmasked @ (10.0 ** (over_db / 10.0)).T
    return np.array([_window(energy, *window) for window in WINDOWS_S]).T


def louder_db(level_db: _Floats, gain_db: _Floats) -> _Floats:
    """Return levels after `gain_db` more gain, for shapes that broadcast.

    Inverts (2), scales the energy, and applies (2) again. What was masked stays masked.
    """
    energy = 10.0 ** (level_db / 10.0) - 1.0
    return np.asarray(10.0 * np.log10(1.0 + energy * 10.0 ** (gain_db / 10.0)))


def vibration_steps(wave: NDArray[np.floating], rate_hz: int) -> _Floats:
    """Return the features of a vibration in Weber steps, (4 x windows,), channels first."""
    return np.asarray((levels_db(wave, rate_hz) / WEBER_DB[:, None]).ravel())


def _spectra(wave: NDArray[np.floating], rate_hz: int) -> tuple[_Floats, _Floats]:
    """Return the bins' frequencies in Hz and the power of each frame re a full-scale sine.

    Shapes are (bins,) and (frames, bins). There are always enough frames for the last window.
    """
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
    """Return the level of one window by (2), (4,), from the energy of all frames, (frames, 4)."""
    first = round(begin_s / FRAME_S)
    last = len(energy) if end_s == math.inf else round(end_s / FRAME_S)
    mean = energy[first:last].mean(axis=0)
    # Only P sums over time. A window that is shorter than SUMMATION_S collects only that share of
    # the energy at which the channel's threshold is defined; a longer one collects no more.
    mean[0] *= min((last - first) * FRAME_S, SUMMATION_S) / SUMMATION_S
    return np.asarray(10.0 * np.log10(1.0 + mean))
