"""Levels of a vibration on one grid, and the distance of two of them for a palm.

Two vibrations that differ on paper may feel the same, for two reasons. A component below the
threshold of the skin is not felt; the threshold is lowest near 250 Hz and rises on both sides. And
a strong component masks weaker ones of nearby frequency, over a width in proportion to its own
frequency. So the levels of both vibrations are added up in third octaves, together with the
threshold that the intended vibration leaves, masks included. The largest remaining difference of a
band counts; below a just noticeable difference (JND_DB) no palm tells the two apart.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hapticvlm.materials import MATERIALS
from hapticvlm.rendering.vibration.textures import Texture
from hapticvlm.rendering.vibration.vibration import RATE_HZ, Motion

_Floats = NDArray[np.float64]

SIZE = 16_384  # samples of a spectrum, 2.9 Hz a line
RUBBED = Motion(0.15, 0.0)  # no force: nothing sticks, the noise alone is compared
STEADY_S = 12.0

# Vibrotactile masking and threshold of the psychohaptic model of MPEG haptics (ISO/IEC 23090-31),
# implemented from its published formulae. Its reference software is under a BSD licence that gives
# no patent rights; it is used here to measure, not to encode.
JND_DB = 1.6  # least difference of amplitude told apart at the thenar (Forta and others 2012)
_MODEL_BEST_HZ = 250.0
_MODEL_HZ = 550.0
_MODEL_BEST_DB = -45.0
# A peak masks if it stands this far above its feet, and not this far below the highest peak.
_PROMINENT_DB = 12.0
_REACH_DB = 45.0
BANDS_HZ = 20.0 * 2.0 ** (np.arange(18) / 3.0)  # third octaves, 20 to 1016 Hz
_EDGE = 2.0 ** (1.0 / 6.0)  # of a third octave, relative to its centre


def rub(name: str) -> NDArray[np.float32]:
    """Rub a surface for STEADY_S as the product does."""
    texture = Texture(MATERIALS[name].vibration, "slide", 1)
    texture.render(9600, RUBBED)
    return texture.render(int(STEADY_S * RATE_HZ), RUBBED)


def event_db(wave: NDArray[np.float32]) -> tuple[_Floats, _Floats]:
    """Return frequencies and levels (K,) of one event within SIZE samples, dB re full scale."""
    return _levels(np.abs(np.fft.rfft(wave[:SIZE].astype(np.float64), SIZE)) ** 2)


def steady_db(wave: NDArray[np.float32]) -> tuple[_Floats, _Floats]:
    """Return frequencies and mean levels (K,) of a steady wave (N,), dB re full scale."""
    # Welch's method: power spectra of windowed pieces are averaged, since that of one piece of
    # noise scatters as much as its own mean. The window's own power is divided out.
    frames = wave[: wave.size // SIZE * SIZE].astype(np.float64).reshape(-1, SIZE)
    window = np.hanning(SIZE)
    power = np.mean(np.abs(np.fft.rfft(frames * window)) ** 2, axis=0) / np.mean(window**2)
    return _levels(power)


def difference_db(meant: tuple[_Floats, _Floats], given: tuple[_Floats, _Floats]) -> float:
    """Return felt_difference_db of two spectra of the same kind."""
    hertz, meant_db = meant
    inside = hertz <= 1100.0
    return felt_difference_db(hertz[inside], meant_db[inside], given[1][inside])


def _levels(power: _Floats) -> tuple[_Floats, _Floats]:
    hertz = np.arange(float(power.size)) * (RATE_HZ / SIZE)
    return hertz, 10.0 * np.log10(4.0 * power / SIZE**2 + 1e-20)


def model_threshold_db(frequency_hz: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the threshold of the psychohaptic model, dB below full scale, any shape."""
    # A parabola over the logarithm of a shifted frequency, with its least value at _MODEL_BEST_HZ.
    b = 1.0 - _MODEL_BEST_HZ / _MODEL_HZ
    at = np.log10(frequency_hz / _MODEL_HZ + b) ** 2
    return np.asarray(np.minimum(50.0 / np.log10(b) ** 2 * at + _MODEL_BEST_DB, 0.0))


def masked_threshold_db(frequency_hz: _Floats, level_db: _Floats, bare_db: _Floats) -> _Floats:
    """Return the threshold under a vibration's own peaks, (K,) dB: masks summed in power.

    `bare_db` is the threshold without a mask, `level_db` the vibration, both (K,).
    """
    from scipy.signal import find_peaks

    # Masks of several peaks add up in power, not in dB: two equal masks raise the threshold by 3
    # dB. Each mask is a parabola in the relative distance from its peak, its top some 5 dB below
    # that. find_peaks does not report the ends of an array; a padding of silence lets them be
    # peaks.
    padded_db = np.pad(level_db, 1, constant_values=-300.0)
    peaks = find_peaks(padded_db, prominence=_PROMINENT_DB)[0] - 1
    total = 10.0 ** (bare_db / 10.0)
    for peak in peaks:
        if level_db[peak] >= level_db.max() - _REACH_DB and frequency_hz[peak] > 0.0:
            hz = frequency_hz[peak]
            away = ((frequency_hz - hz) / hz) ** 2
            total += 10.0 ** ((level_db[peak] - 5.0 + 5.0 / 1400.0 * hz - 30.0 * away) / 10.0)
    return np.asarray(10.0 * np.log10(total))


def felt_difference_db(
    frequency_hz: NDArray[np.float64],
    meant_db: NDArray[np.float64],
    given_db: NDArray[np.float64],
) -> float:
    """Return the largest difference, in third octaves, that the meant vibration does not mask, dB.

    All (K,); levels are power a band in dB re full scale. The masked threshold is added to both, so
    that only a difference that can be felt counts.
    """
    # Adding the threshold to both sides turns "below the threshold" into "equal": two levels far
    # below it give the same sum, two levels far above it keep their difference, and in between the
    # difference fades instead of jumping.
    hidden_db = masked_threshold_db(frequency_hz, meant_db, model_threshold_db(frequency_hz))
    bands = [bands_db(frequency_hz, level_db, hidden_db) for level_db in (meant_db, given_db)]
    return float(np.abs(bands[1] - bands[0]).max())


def bands_db(frequency_hz: _Floats, level_db: _Floats, threshold_db: _Floats) -> _Floats:
    """Return levels (18,) in third octaves of a vibration and a threshold, both (K,), in dB."""
    levels = []
    for centre_hz in BANDS_HZ:
        inside = (frequency_hz >= centre_hz / _EDGE) & (frequency_hz < centre_hz * _EDGE)
        floor = 10.0 ** (threshold_db[inside].min() / 10.0)
        levels.append(10.0 * np.log10(np.sum(10.0 ** (level_db[inside] / 10.0)) + floor))
    return np.array(levels)
