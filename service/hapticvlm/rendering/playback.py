"""What the waveforms are made for: a sample rate, and a speaker that needs some bands stronger.

A measured speaker is corrected where the waveform is made, mode by mode and at the centre of a
texture's band, and a recorded pattern once, when it is read. So correcting costs nothing while
playing, delays nothing and leaves no tail behind a lease that has ended, as a filter would.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hapticvlm.rendering.gestures import RATE_HZ

MOST_DB = 12.0  # either way; more would only drive the amplifier into its limiter
REFERENCE_HZ = 250.0  # where nothing is corrected
LOW_HZ, HIGH_HZ = 20.0, 1000.0


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


@dataclass(frozen=True, slots=True)
class Playback:
    """Samples per second, and what the speaker needs."""

    rate_hz: int = RATE_HZ
    correction: Correction = Correction()


NOMINAL = Playback()


def correction(frequency_hz: Sequence[float], response_db: Sequence[float]) -> Correction:
    """Undo a response (acceleration per drive, dB, any zero) between LOW_HZ and HIGH_HZ.

    It is levelled at REFERENCE_HZ and never asks for more than MOST_DB either way: a resonance is
    tamed, but what a speaker cannot move is not driven harder for ever.
    """
    at = np.log(np.asarray(frequency_hz, dtype=np.float64))
    reference_db = np.interp(np.log(REFERENCE_HZ), at, response_db)
    inside = [
        (hz, float(np.clip(reference_db - db, -MOST_DB, MOST_DB)))
        for hz, db in zip(frequency_hz, response_db, strict=True)
        if LOW_HZ <= hz <= HIGH_HZ
    ]
    return Correction(tuple(hz for hz, _ in inside), tuple(db for _, db in inside))
