"""What the waveforms are made for: a sample rate, and a speaker that needs some bands stronger.

A measured speaker is corrected where the waveform is made: an impact as a whole when it is struck,
by a minimum-phase kernel, which delays nothing; a texture at the centre of its band; a recorded
pattern once, when it is read. So correcting costs nothing while playing and leaves no tail behind
a lease that has ended, as a filter at the output would.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from hapticvlm.rendering.vibration.vibration import RATE_HZ

MAX_DB = 12.0  # either way; more would only drive the amplifier into its limiter
REFERENCE_HZ = 250.0  # where nothing is corrected
LOW_HZ = 20.0
HIGH_HZ = 1000.0
# samples: 43 ms; what folds back is beyond 300 ms
_KERNEL = 2048
_DESIGN = 16_384
_END_FADE = 240


@dataclass(frozen=True, slots=True)
class Correction:
    """Drive to add at rising frequencies, dB; none at all without a measurement."""

    frequency_hz: tuple[float, ...] = ()
    gain_db: tuple[float, ...] = ()

    def gain(self, frequency_hz: float) -> float:
        """Linear gain at one frequency, 1.0 without a measurement."""
        if not self.frequency_hz:
            return 1.0
        at = np.log(max(frequency_hz, LOW_HZ))
        return float(10.0 ** (np.interp(at, np.log(self.frequency_hz), self.gain_db) / 20.0))

    def gains(self, frequency_hz: NDArray[np.float64]) -> NDArray[np.float64]:
        """Linear gains, the shape of `frequency_hz`."""
        if not self.frequency_hz:
            return np.ones_like(frequency_hz)
        at = np.log(np.maximum(frequency_hz, LOW_HZ))
        found = np.interp(at, np.log(self.frequency_hz), self.gain_db)
        return np.asarray(10.0 ** (found / 20.0))

    def apply(self, wave: NDArray[np.float64], rate_hz: int) -> NDArray[np.float64]:
        """Correct an event (N,) that begins and ends at nothing; as long as before."""
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
    """Samples per second, and what the speaker needs."""

    rate_hz: int = RATE_HZ
    correction: Correction = Correction()


NOMINAL = Playback()


def correction(frequency_hz: Sequence[float], response_db: Sequence[float]) -> Correction:
    """Undo a response (acceleration per drive, dB, any zero) between LOW_HZ and HIGH_HZ.

    It is levelled at REFERENCE_HZ and never asks for more than MAX_DB either way: a resonance is
    tamed, but what a speaker cannot move is not driven harder for ever.
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
def _kernel(given: Correction, rate_hz: int, size: int) -> NDArray[np.complex128]:
    """Spectrum (size // 2 + 1,) of the minimum-phase kernel with these gains, by its cepstrum."""
    hertz = np.arange(_DESIGN // 2 + 1.0) * (rate_hz / _DESIGN)
    cepstrum = np.fft.irfft(np.log(given.gains(hertz)), _DESIGN)
    cepstrum[1 : _DESIGN // 2] *= 2.0
    cepstrum[_DESIGN // 2 + 1 :] = 0.0
    kernel = np.fft.irfft(np.exp(np.fft.rfft(cepstrum)), _DESIGN)[:_KERNEL]
    kernel[_KERNEL // 2 :] *= 0.5 + 0.5 * np.cos(np.linspace(0.0, np.pi, _KERNEL // 2))
    return np.asarray(np.fft.rfft(kernel, size))
