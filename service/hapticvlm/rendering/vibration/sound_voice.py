"""Makes a vibration audible: moves it from the palm's band to that of small speakers. Pure.

Most touches have their energy below 300 Hz, where a laptop or a phone plays nothing. So whatever is
no palm speaker plays a second voice of the same touch. The *true* voice is what the palm speaker
gets, and the *sound* voice is made from its samples alone. It therefore works for every mode, grain
and hum, for recordings, and for both hands together. `pages/sound.voice.js` is the same function in
JavaScript; a test compares the two.

Pitch. A vibration at f Hz sounds at TIMES * f + SHIFT_HZ: 30 Hz at 420 Hz, 350 Hz at 1,700 Hz and
900 Hz at 3,900 Hz. The map rises strictly, so what is higher for the palm is higher for the ear. A
mere shift would keep all materials within one octave; a mere product would leave the lowest ones
inaudible. The wave is split into the bands between EDGES_HZ. Each is an analytic signal
z = |z| e^(i phase), and what is played of it is |z| cos(TIMES * phase + 2 pi SHIFT_HZ t): its
frequency is mapped and its envelope |z| stays.

    The kernel of a band from a to b is (e^(2 pi i b t) - e^(2 pi i a t)) / (pi i t) under a Hann
    window of 2 HALF_S. All kernels have the same delay, and their sum is that of the whole band. A
    sine at an edge thus reaches two bands in the same phase, and nothing cancels.

Level. Materials differ by 20 dB for the palm and by 60 dB behind a small speaker. The gain is a
power of the level so far, so that EXPONENT dB remain of each dB. The level is the rms of the window
around the sample played. It is held, and falls by 8.7 dB in a second, so a touch keeps its envelope
while materials of unequal strength are heard alike.

All figures are our choice. docs/physics.md 4.8 has what they give; no listener has judged them.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from hapticvlm.rendering.vibration.vibration import RATE_HZ

IN_HZ = 3_000  # of the true voice, as pages receive it: the band of touch ends at 1 kHz
UP = RATE_HZ // IN_HZ  # samples of the sound voice for each of the true one; pages need only 4
TIMES = 4  # a power of two, so the phase is multiplied by squaring
SHIFT_HZ = 300.0
HALF_S = 0.024
EDGES_HZ = (0.0, 90.0, 190.0, 400.0, 1100.0)
WEIGHTS = (1.6, 1.3, 1.0, 0.8)  # of the bands: small speakers lose most of the lowest one
LEVEL = 0.22
EXPONENT = 0.25
LOWEST = 1e-3  # rms below which the gain no longer rises
FALL_PER_S = 1.0  # of the held level, as an exponent

_HALF = round(HALF_S * IN_HZ)
_SPAN = 2 * _HALF + 1  # samples of the true voice under the window
_CHUNK = 1024
_FALLEN = np.exp(-FALL_PER_S / IN_HZ * np.arange(1.0, _CHUNK + 1.0))

_Floats = NDArray[np.float64]
_Complex = NDArray[np.complex128]


class SoundVoice:
    """Turns the true voice at IN_HZ into the sound voice at `up` * IN_HZ, HALF_S later."""

    def __init__(self, up: int = UP, *, compresses: bool = True) -> None:
        self._up = up
        self._compresses = compresses
        self._kernels = _kernels(up)
        self._shift = np.exp(2j * np.pi * SHIFT_HZ / (up * IN_HZ) * np.arange(_period(up)))
        self._earlier = np.zeros(_SPAN - 1)
        self._level = 0.0
        self._turn = 0  # where the wave of the shift is, in samples of its period

    @property
    def is_silent(self) -> bool:
        """Whether only zeros come out until another sample comes in."""
        return not self._earlier.any()

    def render(self, samples: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return the next samples (N,) at IN_HZ as sound, (N * up,) float32 in [-1, 1]."""
        parts = [
            self._chunk(samples[begin : begin + _CHUNK].astype(np.float64))
            for begin in range(0, samples.size, _CHUNK)
        ]
        return np.concatenate([np.zeros(0, np.float32), *parts])

    def _chunk(self, samples: _Floats) -> NDArray[np.float32]:
        bands, windows = self.bands(samples)
        turns = (self._turn + np.arange(bands.shape[0])) % self._shift.size
        self._turn = (self._turn + bands.shape[0]) % self._shift.size
        wave = (bands.sum(axis=1) * self._shift[turns]).real
        if self._compresses:
            wave *= np.repeat(self._gains(np.mean(windows**2, axis=1)), self._up)
        return np.asarray(np.clip(wave, -1.0, 1.0), dtype=np.float32)

    def bands(self, samples: _Floats) -> tuple[_Complex, _Floats]:
        """Return each band at TIMES its frequency, (N * up, bands), and the windows of samples."""
        line = np.concatenate((self._earlier, samples))
        self._earlier = line[line.size - _SPAN + 1 :]
        windows = np.lib.stride_tricks.sliding_window_view(line, _SPAN)
        # (N, _SPAN) samples times (_SPAN, 2 * up * bands) weights: all phases and bands at once.
        bands = (windows @ self._kernels).view(np.complex128).reshape(samples.size * self._up, -1)
        sizes = np.abs(bands)
        turned = bands / np.maximum(sizes, 1e-12)
        for _ in range(TIMES.bit_length() - 1):
            turned = turned * turned
        return sizes * turned, windows

    def _gains(self, power: _Floats) -> _Floats:
        """Gain (N,) of each sample from the mean squares (N,) around it."""
        # An exponential decay of the running maximum, without a loop: divide by the decay, take the
        # running maximum, multiply by the decay again.
        fallen = _FALLEN[: power.size]
        peaks = np.maximum.accumulate(np.sqrt(power) / fallen)
        held = fallen * np.maximum(peaks, self._level)
        self._level = float(held[-1])
        return np.asarray(LEVEL * np.maximum(held, LOWEST) ** (EXPONENT - 1.0))


class SoundBlocks:
    """Turns blocks of the true voice into blocks of the sound voice, of any length, at RATE_HZ.

    A block is late by the window of SoundVoice and by the UP samples that one of its steps needs.
    """

    def __init__(self) -> None:
        self._voice = SoundVoice()
        self._before = np.zeros(0, np.float32)  # less than a step of the true voice
        self._ahead = np.zeros(UP, np.float32)  # of the sound voice, not yet asked for

    @property
    def is_silent(self) -> bool:
        """Whether only zeros come out until a sample that is not zero comes in."""
        is_empty = not (self._before.any() or self._ahead.any())
        return is_empty and self._voice.is_silent

    def render(self, block: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return the next samples (N,) float32 in [-1, 1] for the next samples (N,)."""
        line = np.concatenate((self._before, block))
        steps = line.size // UP * UP
        self._before = line[steps:]
        ready = np.concatenate((self._ahead, self._voice.render(line[:steps:UP])))
        self._ahead = ready[block.size :]
        return ready[: block.size]


def in_voice(wave: NDArray[np.float32], voice: str) -> NDArray[np.float32]:
    """Return a wave (N,) of the true voice in one of `vibration.VOICES`, both at RATE_HZ."""
    return as_sound(wave) if voice == "sound" else wave


def as_sound(wave: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return the sound voice of a whole wave (N,) of the true one, both at RATE_HZ, not delayed."""
    return _whole(SoundVoice(), wave[::UP], UP)[: wave.size]


def uncompressed(slow: NDArray[np.float32], up: int = UP) -> NDArray[np.float32]:
    """Return the sound voice, linear in the level, (N * up,), of a whole wave (N,) at IN_HZ."""
    return _whole(SoundVoice(up, compresses=False), slow, up)


def _whole(voice: SoundVoice, slow: NDArray[np.float32], up: int) -> NDArray[np.float32]:
    ended = np.concatenate((slow, np.zeros(_HALF, np.float32)))
    return voice.render(ended)[_HALF * up :]


def unshifted(wave: NDArray[np.float32]) -> _Complex:
    """Return a whole wave (N,) at TIMES its frequencies, without SHIFT_HZ and compression, (N,)."""
    slowed = np.concatenate((wave[::UP], np.zeros(_HALF))).astype(np.float64)
    bands, _ = SoundVoice().bands(slowed)
    return np.asarray(bands.sum(axis=1)[_HALF * UP :][: wave.size])


def held(slow: NDArray[np.float32]) -> float:
    """Return the level of a whole wave (N,) at IN_HZ at which the compression has its mean gain."""
    sums = np.cumsum(np.pad(slow.astype(np.float64) ** 2, (1, 0)))
    power = (sums[_SPAN:] - sums[:-_SPAN]) / _SPAN
    voice = SoundVoice()
    gains = [voice._gains(power[at : at + _CHUNK]) for at in range(0, power.size, _CHUNK)]
    return float((np.concatenate(gains).mean() / LEVEL) ** (1.0 / (EXPONENT - 1.0)))


def _period(up: int) -> int:
    return round(up * IN_HZ / SHIFT_HZ)


@lru_cache(maxsize=2)
def _kernels(up: int) -> _Floats:
    """Weights (_SPAN, 2 * up * bands) of the samples under the window, the newest last.

    The real part of each weight and its imaginary part follow each other.
    """
    at = np.arange(-_HALF * up, _HALF * up + up) / (up * IN_HZ)
    window = np.where(np.abs(at) < HALF_S, 0.5 + 0.5 * np.cos(np.pi * at / HALF_S), 0.0)
    turns = np.exp(2j * np.pi * np.outer(EDGES_HZ, at))
    with np.errstate(divide="ignore", invalid="ignore"):
        bands = np.diff(turns, axis=0) / (1j * np.pi * at)
    bands[:, _HALF * up] = 2.0 * np.diff(EDGES_HZ)
    bands *= window * np.array(WEIGHTS)[:, None] / IN_HZ
    # Output `up * i + phase` weighs the sample `m` before the newest with kernel `up * m + phase`.
    by_sample = bands.reshape(len(WEIGHTS), _SPAN, up)[:, ::-1]
    return np.ascontiguousarray(by_sample.transpose(1, 2, 0)).view(np.float64).reshape(_SPAN, -1)
