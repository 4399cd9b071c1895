"""Corrects waveforms for a measured speaker, which moves less at some frequencies than at others.

The correction is applied where the waveform is created. An impact is corrected as a whole when it
is struck, by a minimum-phase kernel: of all kernels with these gains it delays the onset least. A
texture is corrected at the centre of its band, and a recorded pattern once, when it is read. A
filter at the output would cost time in every block, and its tail would sound on after a lease has
ended.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from hapticvlm.perception import FULL_SCALE_DB
from hapticvlm.rendering.vibration.vibration import RATE_HZ

MAX_DB = 12.0  # either way; more would only drive the amplifier into its limiter
REFERENCE_HZ = 250.0  # nothing is corrected here
LOW_HZ = 20.0
HIGH_HZ = 1000.0
_KERNEL = 2048  # samples: 43 ms
_DESIGN = 16_384  # samples of the transform; what aliases in time lies beyond 300 ms
_END_FADE = 240  # samples


@dataclass(frozen=True, slots=True)
class Correction:
    """Gain in dB to add to the drive, at rising frequencies; empty without a measurement."""

    frequency_hz: tuple[float, ...] = ()
    gain_db: tuple[float, ...] = ()

    def gain(self, frequency_hz: float) -> float:
        """Linear gain at one frequency; 1.0 without a measurement."""
        if not self.frequency_hz:
            return 1.0
        at = np.log(max(frequency_hz, LOW_HZ))
        return float(10.0 ** (np.interp(at, np.log(self.frequency_hz), self.gain_db) / 20.0))

    def gains(self, frequency_hz: NDArray[np.float64]) -> NDArray[np.float64]:
        """Linear gains at these frequencies, of the same shape."""
        if not self.frequency_hz:
            return np.ones_like(frequency_hz)
        at = np.log(np.maximum(frequency_hz, LOW_HZ))
        decibels = np.interp(at, np.log(self.frequency_hz), self.gain_db)
        return np.asarray(10.0 ** (decibels / 20.0))

    def apply(self, wave: NDArray[np.float64], rate_hz: int) -> NDArray[np.float64]:
        """Correct an event (N,) that begins and ends at 0; the result is as long, (N,)."""
        if not self.frequency_hz:
            return wave
        size = 1 << (wave.size + _KERNEL).bit_length()
        corrected = np.fft.irfft(np.fft.rfft(wave, size) * _kernel(self, rate_hz, size), size)
        corrected = corrected[: wave.size]
        fade = min(_END_FADE, wave.size)
        corrected[-fade:] *= np.linspace(1.0, 0.0, fade)
        return np.asarray(corrected)


@dataclass(frozen=True, slots=True)
class Playback:
    """Sample rate that waveforms are created for, and what is known of speaker and hand.

    `full_scale_db` is how far a full-scale sine at REFERENCE_HZ lies above the palm's threshold. It
    is None for a controller, whose levels have a scale of their own (controller_scale.py).
    """

    rate_hz: int = RATE_HZ
    correction: Correction = Correction()
    full_scale_db: float | None = FULL_SCALE_DB


NOMINAL = Playback()


def correction(frequency_hz: Sequence[float], response_db: Sequence[float]) -> Correction:
    """Return the correction that flattens a response between LOW_HZ and HIGH_HZ.

    `response_db` is the acceleration per drive in dB, relative to any level. The correction is 0 dB
    at REFERENCE_HZ and at most MAX_DB either way: it tames a resonance, but does not drive a
    speaker ever harder where it cannot move.
    """
    at = np.log(np.asarray(frequency_hz, dtype=np.float64))
    reference_db = np.interp(np.log(REFERENCE_HZ), at, response_db)
    inside = [
        (hz, float(np.clip(reference_db - db, -MAX_DB, MAX_DB)))
        for hz, db in zip(frequency_hz, response_db, strict=True)
        if LOW_HZ <= hz <= HIGH_HZ
    ]
    return Correction(tuple(hz for hz, _ in inside), tuple(db for _, db in inside))


@lru_cache(maxsize=16)
def _kernel(correction: Correction, rate_hz: int, size: int) -> NDArray[np.complex128]:
    """Return the spectrum (size // 2 + 1,) of the minimum-phase kernel with these gains.

    The logarithm of the gains has a cepstrum that is even in time; folding its negative half onto
    the positive one makes the kernel causal and of minimum phase.
    """
    hertz = np.arange(_DESIGN // 2 + 1.0) * (rate_hz / _DESIGN)
    cepstrum = np.fft.irfft(np.log(correction.gains(hertz)), _DESIGN)
    cepstrum[1 : _DESIGN // 2] *= 2.0
    cepstrum[_DESIGN // 2 + 1 :] = 0.0
    kernel = np.fft.irfft(np.exp(np.fft.rfft(cepstrum)), _DESIGN)[:_KERNEL]
    kernel[_KERNEL // 2 :] *= 0.5 + 0.5 * np.cos(np.linspace(0.0, np.pi, _KERNEL // 2))
    return np.asarray(np.fft.rfft(kernel, size))
