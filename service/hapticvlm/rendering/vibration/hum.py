"""Renders the hum of a thing that runs, such as a motor: a tone and its harmonics. Pure.

The tone feels as strong as a texture of the same level, whatever its frequency: a motor at 50 Hz
needs far more drive than one at 250 Hz (docs/physics.md 4.7). Harmonics above the band of touch are
left out.
"""

from __future__ import annotations

import copy
import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hapticvlm.perception import FULL_SCALE_DB, drive_threshold_db
from hapticvlm.rendering.vibration.equaliser import NOMINAL, Playback
from hapticvlm.rendering.vibration.smoothing import SmoothedValue
from hapticvlm.rendering.vibration.textures import HIGHEST_HZ, RMS

HARMONICS = 4
_MAX_DRIVE_DB = 24.0  # a palm speaker cannot give more below 40 Hz, however hard it is driven


@dataclass(frozen=True, slots=True)
class Hum:
    """A tone: its fundamental in Hz, its perceived level 0..1, and its richness.

    `richness` is the ratio of the amplitudes of each harmonic and the one before it.
    """

    frequency_hz: float
    level: float
    richness: float = 0.3

    def sensation_db(self, full_scale_db: float = FULL_SCALE_DB) -> float:
        """Return how far it lies above the palm's threshold, dB; -inf for level 0.

        A hum feels as strong as a sine of 250 Hz with the rms `level` times RMS, and a full-scale
        sine of 250 Hz is `full_scale_db` above the threshold.
        """
        amplitude = math.sqrt(2.0) * RMS * self.level
        return full_scale_db + 20.0 * math.log10(amplitude) if amplitude > 0.0 else -math.inf


class Tone:
    """Plays one continuous hum; its state makes consecutive blocks join."""

    def __init__(self, hum: Hum, playback: Playback = NOMINAL) -> None:
        self.hum = hum
        self._playback = playback
        self._turns = 0.0
        self._pitch = SmoothedValue(hum.frequency_hz)

    def fork(self) -> Tone:
        """Return an independent copy in the same state."""
        forked = copy.copy(self)
        forked._pitch = self._pitch.fork()
        return forked

    def render(self, count: int) -> NDArray[np.float32]:
        """Next `count` samples, (count,) float32, of the hum at level 1; its voice applies it."""
        rate_hz = self._playback.rate_hz
        pitch = self._pitch.follow(self.hum.frequency_hz, count, rate_hz)
        turns = self._turns + np.cumsum(np.broadcast_to(pitch, count)) / rate_hz
        if count:
            self._turns = float(turns[-1]) % 1.0
        wave = np.zeros(count)
        for order, drive in enumerate(self.drives(), start=1):
            wave += drive * np.sin(2.0 * math.pi * order * turns)
        return np.asarray(wave, dtype=np.float32)

    def drives(self) -> list[float]:
        """Amplitude of each harmonic, from the first on; together they feel like RMS at 250 Hz."""
        base = self.hum.frequency_hz
        orders = [n for n in range(1, HARMONICS + 1) if n == 1 or n * base <= HIGHEST_HZ]
        shares = np.array([self.hum.richness ** (n - 1) for n in orders])
        shares = shares / np.sqrt(np.sum(shares**2))
        hertz = np.array([min(n * base, HIGHEST_HZ) for n in orders])
        decibels = np.minimum(drive_threshold_db(hertz), _MAX_DRIVE_DB)
        correction = [self._playback.correction.gain(float(at)) for at in hertz]
        drives = math.sqrt(2.0) * RMS * shares * 10.0 ** (decibels / 20.0) * np.array(correction)
        return [float(drive) for drive in drives]
