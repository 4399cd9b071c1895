"""Surfaces as closed loops in space: what is read off under a moving hand. Pure.

A loop holds SAMPLES samples for each of PERIODS surface periods and nothing above `highest` cycles
a period, so that reading it at f periods a second gives nothing above f * highest.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from hapticvlm.rendering.vibration.cache import CACHE
from hapticvlm.rendering.vibration.perceived_level import GRID_HZ, drive_needed

_Floats = NDArray[np.float64]

# of noise; 64 keep linear reading 60 dB clean
PERIODS = 512
SAMPLES = 64
SLIPS = 128
SLIP_SAMPLES = 256
SLIP_CYCLES = 6.0
_SLIP_JITTER = 0.15  # of a slip's length, our choice: without it the palm perceives a note
_PATCH_CYCLES = 1.0 / 8.0  # surface changes over eight periods and more
_PATCHY = 0.7  # how unlike patches of a fully rough surface are
_LOWEST = 0.15  # cycles a period: a surface slower than that is moved along, not felt
_CLIP = 2.2  # of the rms: peaks beyond are taken down, and the band is restored
# No patch is smooth enough to be silent, and no beat of the noise either: a rubbing palm that feels
# nothing for a twentieth of a second feels the surface vanish. Our choice.
_MIN_PATCH = 0.35
_MIN_ENVELOPE = 0.45


@dataclass(frozen=True, slots=True, eq=False)
class Loop:
    """`wave` (periods * samples + 1,) of rms 1, first sample repeated; `drive` levels it."""

    wave: _Floats
    samples: int
    highest: float
    drive: _Floats  # (40,), at strength.GRID_HZ

    @property
    def size(self) -> int:
        """Samples once around."""
        return self.wave.size - 1

    def read(self, at: _Floats) -> _Floats:
        """Values (N,) at places (N,) >= 0 in samples of the loop."""
        whole = at.astype(np.intp)
        index = whole % self.size
        below = self.wave[index]
        return np.asarray(below + (at - whole) * (self.wave[index + 1] - below))


def noise(bandwidth: float, roughness: float) -> Loop:
    """Noise around one cycle a period, `bandwidth` wide at half maximum; the rougher, the patchier.

    Peaks are kept near 3 times the rms, so that a texture uses the range it has.
    """
    packed = CACHE.get(
        f"noise {bandwidth!r} {roughness!r}", lambda: _packed(_noise(bandwidth, roughness))
    )
    drive, wave = packed[: GRID_HZ.size], packed[GRID_HZ.size :]
    return Loop(wave, SAMPLES, 1.0 + bandwidth, drive)


def _packed(loop: Loop) -> _Floats:
    return np.concatenate((loop.drive, loop.wave))


def _noise(bandwidth: float, roughness: float) -> Loop:
    cycles = np.arange(PERIODS * SAMPLES // 2 + 1) / PERIODS
    shape = np.exp(-0.5 * ((cycles - 1.0) / (bandwidth / 2.355)) ** 2)
    inside = (cycles >= _LOWEST) & (cycles <= 1.0 + bandwidth)
    wave = _random(shape * inside, 0)
    patches = _random((cycles > 0.0) & (cycles < _PATCH_CYCLES), 1)
    wave *= np.clip(1.0 + _PATCHY * roughness * patches, _MIN_PATCH, 2.5)
    for _ in range(3):
        wave = _within(_filled(np.clip(wave, -_CLIP, _CLIP)), inside)
    return _loop(wave, SAMPLES, 1.0 + bandwidth)


@lru_cache(maxsize=1)
def stick_slip() -> Loop:
    """Slips of about one period: a slow build-up and a fast release, SLIP_CYCLES of it."""
    rng = np.random.default_rng(2)
    lengths = 1.0 + rng.uniform(-_SLIP_JITTER, _SLIP_JITTER, SLIPS)
    ends = np.cumsum(lengths) * (SLIPS / lengths.sum())
    at = np.arange(SLIPS * SLIP_SAMPLES) / SLIP_SAMPLES
    which = np.searchsorted(ends, at, side="right")
    begins = np.concatenate(([0.0], ends[:-1]))
    saw = (at - begins[which]) / (ends - begins)[which] - 0.5
    cycles = np.arange(saw.size // 2 + 1) / SLIPS
    rolled_off = np.clip((SLIP_CYCLES - cycles) / 2.0, 0.0, 1.0)  # no ringing before the slip
    return _loop(_within(saw, rolled_off * (cycles >= 0.05)), SLIP_SAMPLES, SLIP_CYCLES)


def _random(shape: _Floats | NDArray[np.bool_], seed: int) -> _Floats:
    """Noise of rms 1 with this amplitude spectrum (K,), (2 K - 2,)."""
    wave = np.fft.irfft(shape * _phases(shape.size, seed))
    return np.asarray(wave / np.sqrt(np.mean(wave**2)))


@lru_cache(maxsize=2)  # the two that every noise is made of
def _phases(count: int, seed: int) -> NDArray[np.complex128]:
    return np.asarray(np.exp(2j * math.pi * np.random.default_rng(seed).random(count)))


def _filled(wave: _Floats) -> _Floats:
    """Raise the holes of a wave of rms 1, (N,), to _MIN_ENVELOPE by the envelope's own shape."""
    spectrum = np.fft.fft(wave)
    spectrum[wave.size // 2 :] = 0.0
    envelope = 2.0 * np.abs(np.fft.ifft(spectrum))
    return np.asarray(wave * np.maximum(_MIN_ENVELOPE / np.maximum(envelope, 0.02), 1.0))


def _within(wave: _Floats, gains: _Floats | NDArray[np.bool_]) -> _Floats:
    wave = np.fft.irfft(np.fft.rfft(wave) * gains, wave.size)
    return np.asarray(wave / np.sqrt(np.mean(wave**2)))


def _loop(wave: _Floats, samples: int, highest: float) -> Loop:
    power = np.abs(np.fft.rfft(wave)) ** 2
    cycles = np.arange(power.size) * (samples / wave.size)
    rendered = (power > 1e-9 * power.max()) & (cycles <= highest)
    drive = drive_needed(cycles[rendered], power[rendered])
    return Loop(np.append(wave, wave[0]), samples, highest, drive)
