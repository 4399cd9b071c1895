"""Creates surfaces as closed loops in space, to be read under a moving hand. Pure.

A loop is the relief of a surface over a number of its periods, with the end joined to the
beginning. It holds nothing above `highest` cycles per period. So when it is read at f periods a
second, the vibration holds nothing above f * highest, and a texture cannot leave the band of touch.
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

PERIODS = 512  # of a loop of noise
SAMPLES = 64  # per period: linear interpolation then adds less than -60 dB
SLIPS = 128  # of a loop of stick-slip
SLIP_SAMPLES = 256  # per slip
SLIP_CYCLES = 6.0  # highest frequency of a slip, in cycles per slip
_SLIP_JITTER = 0.35  # of a slip's length, our choice: without it the palm feels a musical tone
_PATCH_CYCLES = 1.0 / 8.0  # patches of a surface are at least eight periods long
_PATCHY = 0.7  # by which patches of a fully rough surface differ in level
_LOWEST = 0.15  # cycles per period: a slower relief moves the hand and is not felt as vibration
_CLIP = 2.2  # of the rms: higher peaks are clipped, and the band is restored
# A rubbing palm that feels nothing for a twentieth of a second feels the surface vanish. So no
# patch is silent, and no beat of the noise either (docs/physics.md 4.3; our choice).
_MIN_PATCH = 0.35
_MIN_ENVELOPE = 0.45


@dataclass(frozen=True, slots=True, eq=False)
class Loop:
    """One loop of rms 1: `wave` is (periods * samples + 1,), with the first sample repeated.

    `samples` is the number per period and `highest` the highest frequency in cycles per period.
    `drive` is the gain that makes the loop equally strong at each of `perceived_level.GRID_HZ`.
    """

    wave: _Floats
    samples: int
    highest: float
    drive: _Floats  # (40,)

    @property
    def size(self) -> int:
        """Number of samples once around the loop."""
        return self.wave.size - 1

    def read(self, at: _Floats) -> _Floats:
        """Values (N,) at positions (N,) >= 0, in samples; positions wrap around the loop."""
        whole = at.astype(np.intp)
        index = whole % self.size
        below = self.wave[index]
        return np.asarray(below + (at - whole) * (self.wave[index + 1] - below))


def noise(bandwidth: float, roughness: float) -> Loop:
    """Return a loop of noise around one cycle per period, `bandwidth` wide at half maximum.

    The rougher the surface (0..1), the more its patches differ. Peaks stay near 3 times the rms, so
    that a texture can use the range of the output.
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
    """Return a loop of slips, each a slow build-up and a fast release, up to SLIP_CYCLES."""
    rng = np.random.default_rng(2)
    lengths = 1.0 + rng.uniform(-_SLIP_JITTER, _SLIP_JITTER, SLIPS)
    ends = np.cumsum(lengths) * (SLIPS / lengths.sum())
    at = np.arange(SLIPS * SLIP_SAMPLES) / SLIP_SAMPLES
    which = np.searchsorted(ends, at, side="right")
    begins = np.concatenate(([0.0], ends[:-1]))
    saw = (at - begins[which]) / (ends - begins)[which] - 0.5
    cycles = np.arange(saw.size // 2 + 1) / SLIPS
    rolled_off = np.clip((SLIP_CYCLES - cycles) / 2.0, 0.0, 1.0)  # avoids ringing before a slip
    return _loop(_within(saw, rolled_off * (cycles >= 0.05)), SLIP_SAMPLES, SLIP_CYCLES)


def _random(shape: _Floats | NDArray[np.bool_], seed: int) -> _Floats:
    """Return noise of rms 1, (2 K - 2,), with this amplitude spectrum, (K,)."""
    wave = np.fft.irfft(shape * _phases(shape.size, seed))
    return np.asarray(wave / np.sqrt(np.mean(wave**2)))


@lru_cache(maxsize=2)  # every noise uses the same two: of its wave and of its patches
def _phases(count: int, seed: int) -> NDArray[np.complex128]:
    return np.asarray(np.exp(2j * math.pi * np.random.default_rng(seed).random(count)))


def _filled(wave: _Floats) -> _Floats:
    """Raise the envelope of a wave of rms 1, (N,), to at least _MIN_ENVELOPE.

    The envelope is the magnitude of the analytic signal.
    """
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
