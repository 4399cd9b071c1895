"""What a thing that runs makes a palm feel: a tone and its harmonics, as strong as said. Pure.

The tone is played as loud as a texture of the same level would be felt (perceived as `drive_needed`
has it), whatever its frequency: a motor of 50 Hz needs far more drive than one of 250. Harmonics
above the band of touch are left out.
"""

from __future__ import annotations

import copy
import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hapticvlm.perception import drive_threshold_db
from hapticvlm.rendering.vibration.equaliser import NOMINAL, Playback
from hapticvlm.rendering.vibration.smoothing import SmoothedValue
from hapticvlm.rendering.vibration.textures import HIGHEST_HZ, RMS

HARMONICS = 4
_MAX_DRIVE_DB = 24.0  # below 40 Hz a palm speaker gives no more, whatever it is driven with


@dataclass(frozen=True, slots=True)
class Hum:
    """A tone: fundamental in Hz, felt level 0..1, share of each harmonic of the one before it."""

    frequency_hz: float
    level: float
    richness: float = 0.3


class Tone:
    """One hum that goes on; its state is only what makes blocks join."""

    def __init__(self, hum: Hum, playback: Playback = NOMINAL) -> None:
        self.hum = hum
        self._playback = playback
        self._turns = 0.0
        self._pitch = SmoothedValue(hum.frequency_hz)

    def fork(self) -> Tone:
        """Return a copy that goes its own way."""
        forked = copy.copy(self)
        forked._pitch = self._pitch.fork()
        return forked

    def render(self, count: int) -> NDArray[np.float32]:
        """Next `count` samples, (count,) float32, of a hum of level 1."""
        rate_hz = self._playback.rate_hz
        pitch = self._pitch.follow(self.hum.frequency_hz, count, rate_hz)
        turns = self._turns + np.cumsum(np.broadcast_to(pitch, count)) / rate_hz
        if count:
            self._turns = float(turns[-1]) % 1.0
        wave = np.zeros(count)
        for order, drive in enumerate(self._drives(), start=1):
            wave += drive * np.sin(2.0 * math.pi * order * turns)
        return np.asarray(wave, dtype=np.float32)

    def _drives(self) -> list[float]:
        """Amplitude of each harmonic, the first one first; together felt like RMS at 250 Hz."""
        base = self.hum.frequency_hz
        orders = [n for n in range(1, HARMONICS + 1) if n == 1 or n * base <= HIGHEST_HZ]
        shares = np.array([self.hum.richness ** (n - 1) for n in orders])
        shares = shares / np.sqrt(np.sum(shares**2))
        hertz = np.array([min(n * base, HIGHEST_HZ) for n in orders])
        decibels = np.minimum(drive_threshold_db(hertz), _MAX_DRIVE_DB)
        correction = [self._playback.correction.gain(float(at)) for at in hertz]
        drives = math.sqrt(2.0) * RMS * shares * 10.0 ** (decibels / 20.0) * np.array(correction)
        return [float(drive) for drive in drives]
