"""Material and movement become a waveform for the palm, 1-1000 Hz at 48 kHz. Pure; mixes nothing.

An impact is a row of decaying modes struck by a soft pulse: force (1 - cos(2 pi t / T)) / T for the
contact time T, which shrinks as speed^(-1/5) (Hertz), so faster is stronger and brighter. With
s = -B + 2 pi i f and w = 2 pi / T a mode answers, in closed form while the pulse lasts,

    y(t) = ((e^(st) - 1) / s - (s e^(st) + w sin wt - s cos wt) / (s^2 + w^2)) / T

and y(T) e^(s(t-T)) afterwards. Im(s y / |s|) has no constant push; the smooth pulse keeps the band.

A texture is a profile in space: a loop of noise around one cycle per surface period that the hand
reads at speed / pitch, so spectrum and movement cannot come apart. Carving adds fibre breaks,
single grains on the material's resonance; swinging reads the loop at the rate of vortices.

Levels are compared as a palm on a speaker feels them (perception.drive_threshold_db).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from hapticvlm.materials import Mode, Vibration
from hapticvlm.perception import drive_threshold_db

_Complex = NDArray[np.complex128]

RATE_HZ = 48_000
IMPACTS = ("tap", "strike", "press")
TEXTURES = ("slide", "carve", "swing")

# Where no source is named a figure is our choice, to be tuned by hand on real speakers.
_CONTACT_S = {"tap": 3.0e-3, "strike": 2.4e-3, "press": 6.0e-3}  # s, pulse length at 1 m/s
_SHORTEST_S = 2.2e-3  # s, its spectrum ends at 2 / T = 910 Hz: nothing rings above the band
_DAMPING = {"tap": 1.0, "strike": 1.0, "press": 3.0}  # a pressing hand stays and damps the modes
_IMPACT_LEVEL = {"tap": 0.6, "strike": 1.0, "press": 0.5}
_FELT_STRIKE = 3.3  # lets the hardest strike of glass, the neediest material, peak at 0.9
_LEVELLED_SPEED_MPS = 0.5  # m/s, where all materials are equally strong
_LOUD_SPEED_MPS = 0.5  # m/s, an impact reaches 63 % of its level here
_LOUD_FORCE_N = 3.0  # N, the same for a press
_LONGEST_IMPACT_S, _END_FADE_S = 0.4, 0.01
_MOST_BOOST_DB = 12.0  # more would only drive the amplifier into its limiter

_LOW_HZ, _HIGH_HZ, _BAND_END_HZ = 20.0, 800.0, 1000.0
_PERIODS, _SAMPLES = 512, 64  # of the noise loop; 64 keep linear reading 60 dB clean
_LOOP_RMS = 0.25  # of full scale; noise peaks reach about four times that
_GLIDE_S = 0.01  # s, time constant of level and frequency
_SLOW_SPEED_MPS, _LIGHT_FORCE_N = 0.05, 0.5  # half level when rubbing; force counts from 30 %
_VORTEX_PER_M, _SWING_BANDWIDTH, _SWING_SPEED_MPS = 40.0, 0.6, 2.5  # 0.2 / 5 mm (reference 4.3)
_BREAK_SPACING_M, _BREAKS_HZ = 4e-3, (10.0, 60.0)  # fibre breaks per second (4.3, from memory)
_GRAIN_HZ, _GRAIN_DECAY, _GRAIN_S, _GRAIN_LEVEL = (80.0, 250.0), 120.0, 0.04, 0.8
_CARVE_RUB = 0.4  # share of plain rubbing that is felt between the breaks

_BOOST = 10.0 ** (np.minimum(drive_threshold_db(np.arange(1001.0)), _MOST_BOOST_DB) / 20.0)


@dataclass(frozen=True, slots=True)
class Stroke:
    """How the hand moves over or onto a surface: m/s and N, both >= 0."""

    speed_mps: float
    force_n: float


def impact(
    vibration: Vibration, interaction: str, stroke: Stroke, seed: int, rate_hz: int = RATE_HZ
) -> NDArray[np.float32]:
    """Waveform (N,) float32 in [-1, 1] of one impact, from 0 to 0; the seed varies it slightly."""
    vary = np.random.default_rng(seed).uniform
    modes = tuple(
        Mode(mode.frequency_hz * vary(0.985, 1.015), mode.decay_per_s, mode.gain * vary(0.9, 1.1))
        for mode in vibration.modes
    )
    push = stroke.speed_mps / _LOUD_SPEED_MPS
    if interaction == "press":
        push += stroke.force_n / _LOUD_FORCE_N
    level = _impact_gain(vibration, interaction) * (1.0 - math.exp(-push))
    contact_s = _contact_s(interaction, stroke.speed_mps)
    wave = level * _struck(modes, contact_s, _DAMPING[interaction], rate_hz)
    peak = float(np.abs(wave).max())
    return np.asarray(wave / max(peak, 1.0), dtype=np.float32)


class Texture:
    """One sustained texture; its state is only what makes blocks join."""

    def __init__(
        self, vibration: Vibration, interaction: str, seed: int, rate_hz: int = RATE_HZ
    ) -> None:
        self._vibration, self._interaction, self._rate_hz = vibration, interaction, rate_hz
        self._rng = np.random.default_rng(seed)
        self._bandwidth = _SWING_BANDWIDTH if interaction == "swing" else vibration.bandwidth
        self._loop = _noise_loop(self._bandwidth)
        self._at = self._rng.uniform(
            0.0, _PERIODS * _SAMPLES
        )  # place in the loop, in samples of it
        self._centre_hz: float | None = None
        self._level = 0.0
        self._to_break = self._rng.uniform(0.0, 1.0)  # in mean spacings
        self._grain = _grain(vibration, rate_hz) if interaction == "carve" else None
        self._tail = np.zeros(0 if self._grain is None else self._grain.size)

    def render(self, count: int, stroke: Stroke) -> NDArray[np.float32]:
        """Next `count` samples, (count,) float32, under a stroke that holds for all of them."""
        left = _glide(count, self._rate_hz)
        centre_hz = self._glide_centre(left, stroke.speed_mps)
        wanted = self._wanted_level(stroke)
        level = wanted + (self._level - wanted) * left
        wave = self._read_loop(centre_hz) * level
        if count:
            self._level = float(level[-1]) if abs(level[-1] - wanted) > 1e-6 else wanted
        if self._grain is not None:
            wave = _CARVE_RUB * wave + self._breaks(self._grain, level, stroke.speed_mps)
        return np.asarray(wave, dtype=np.float32)

    def _glide_centre(self, left: NDArray[np.float64], speed_mps: float) -> NDArray[np.float64]:
        wanted = self._wanted_centre_hz(speed_mps)
        start = wanted if self._centre_hz is None else self._centre_hz
        centre_hz: NDArray[np.float64] = wanted + (start - wanted) * left
        self._centre_hz = float(centre_hz[-1]) if centre_hz.size else start
        return centre_hz

    def _wanted_centre_hz(self, speed_mps: float) -> float:
        per_m = _VORTEX_PER_M if self._interaction == "swing" else 1.0 / self._vibration.pitch_m
        highest = min(_HIGH_HZ, _BAND_END_HZ / (1.0 + self._bandwidth))
        return min(max(speed_mps * per_m, _LOW_HZ), highest)

    def _wanted_level(self, stroke: Stroke) -> float:
        speed = stroke.speed_mps
        if self._interaction == "swing":
            return 1.0 - math.exp(-speed * speed / _SWING_SPEED_MPS**2)
        pressed = 0.3 + 0.7 * stroke.force_n / (stroke.force_n + _LIGHT_FORCE_N)
        moved = pressed * speed / (speed + _SLOW_SPEED_MPS)
        if self._interaction == "carve":
            return moved
        needed = self._vibration.roughness * moved * _boost(self._wanted_centre_hz(speed))
        return 1.0 - math.exp(-needed)

    def _read_loop(self, centre_hz: NDArray[np.float64]) -> NDArray[np.float64]:
        size = _PERIODS * _SAMPLES
        at = self._at + np.cumsum(centre_hz) * (_SAMPLES / self._rate_hz)
        self._at = float(at[-1]) % size if at.size else self._at
        whole = at.astype(np.intp)
        index = whole % size
        below, above = self._loop[index], self._loop[index + 1]
        return np.asarray(below + (at - whole) * (above - below))

    def _breaks(
        self, grain: NDArray[np.float64], level: NDArray[np.float64], speed_mps: float
    ) -> NDArray[np.float64]:
        """Fibre breaks that begin in this block, and the tails of earlier ones."""
        wave = np.concatenate((self._tail, np.zeros(level.size)))
        rate = min(max(speed_mps / _BREAK_SPACING_M, _BREAKS_HZ[0]), _BREAKS_HZ[1])
        per_sample = rate / self._rate_hz if speed_mps > 0.0 else 0.0
        self._to_break -= per_sample * level.size
        while self._to_break < 0.0:
            begin = max(level.size + math.floor(self._to_break / per_sample), 0)
            strength = _GRAIN_LEVEL * self._rng.uniform(0.4, 1.0) * level[begin]
            wave[begin : begin + grain.size] += strength * grain
            self._to_break += self._rng.uniform(0.5, 1.5)
        self._tail = wave[level.size :]
        return wave[: level.size]


def _struck(
    modes: tuple[Mode, ...], contact_s: float, damping: float, rate_hz: int
) -> NDArray[np.float64]:
    """Modes struck by one soft pulse, (N,), faded out at the end; the equations are at the head."""
    slowest = min(mode.decay_per_s for mode in modes) * damping
    count = int(min(contact_s + 6.0 / slowest, _LONGEST_IMPACT_S) * rate_hz)
    pulse = int(contact_s * rate_hz)
    decay, turns, gain = np.array([(m.decay_per_s, m.frequency_hz, m.gain) for m in modes]).T
    pole: _Complex = (-damping * decay + 2j * math.pi * turns)[:, None]
    gain = gain[:, None] * pole / np.abs(pole)
    time_s, turn = np.arange(pulse + 1) / rate_hz, 2.0 * math.pi * rate_hz / pulse
    ring, sine, cosine = np.exp(pole * time_s), np.sin(turn * time_s), np.cos(turn * time_s)
    swing = (pole * ring + turn * sine - pole * cosine) / (pole**2 + turn**2)
    pushed = gain * ((ring - 1.0) / pole - swing) * (rate_hz / pulse)
    free = _ring_out(pushed[:, -1:], pole / rate_hz, count - pulse)
    wave = np.concatenate((pushed[:, :-1].imag.sum(axis=0), free))
    fade = int(_END_FADE_S * rate_hz)
    wave[-fade:] *= 0.5 + 0.5 * np.cos(np.linspace(0.0, math.pi, fade))
    return wave


def _ring_out(start: _Complex, pole: _Complex, count: int) -> NDArray[np.float64]:
    """Sum over modes of Im(start e^(pole n)), (count,); strides times steps, ten times faster."""
    steps = np.exp(pole * np.arange(128))
    strides = start * np.exp(pole * (128 * np.arange(-(-count // 128))))
    rows = np.concatenate((strides.real, strides.imag)).T
    return np.asarray(rows @ np.concatenate((steps.imag, steps.real))).ravel()[:count]


def _contact_s(interaction: str, speed_mps: float) -> float:
    return max(_CONTACT_S[interaction] * math.pow(max(speed_mps, 0.05), -0.2), _SHORTEST_S)


@lru_cache(maxsize=256)
def _impact_gain(vibration: Vibration, interaction: str) -> float:
    """Gain that makes every material equally strong to the palm; the neediest one peaks highest."""
    contact_s = _contact_s(interaction, _LEVELLED_SPEED_MPS)
    wave = _struck(vibration.modes, contact_s, _DAMPING[interaction], RATE_HZ)
    return _IMPACT_LEVEL[interaction] * _FELT_STRIKE / _felt(wave)


def _felt(wave: NDArray[np.float64]) -> float:
    """Strength of a waveform (N,) to the palm: root of its energy over the threshold, relative."""
    power = np.abs(np.fft.rfft(wave)) ** 2
    needed_db = drive_threshold_db(np.arange(float(power.size)) * (RATE_HZ / wave.size))
    return float(np.sqrt(np.sum(power * 10.0 ** (needed_db / -10.0)) / wave.size))


def _boost(frequency_hz: float) -> float:
    """Drive that a frequency in the band needs to feel as strong as 250 Hz does, within reason."""
    return float(_BOOST[int(frequency_hz)])


@lru_cache(maxsize=8)
def _glide(count: int, rate_hz: int) -> NDArray[np.float64]:
    """Share of a step still to go after each of the next samples, (count,)."""
    return np.asarray(np.exp(np.arange(1, count + 1) * (-1.0 / (_GLIDE_S * rate_hz))))


@lru_cache(maxsize=64)
def _noise_loop(bandwidth: float) -> NDArray[np.float64]:
    """Draw a closed loop of noise around one cycle per period, (_PERIODS * _SAMPLES + 1,)."""
    size = _PERIODS * _SAMPLES
    cycles = np.arange(size // 2 + 1) / _PERIODS
    shape = np.exp(-0.5 * ((cycles - 1.0) / (bandwidth / 2.355)) ** 2)  # full width at half maximum
    shape[(cycles < 0.05) | (cycles > 1.0 + bandwidth)] = 0.0
    rng = np.random.default_rng(0)
    spectrum = shape * np.exp(2j * math.pi * rng.random(shape.size))
    loop = np.fft.irfft(spectrum, size)
    loop *= _LOOP_RMS / np.sqrt(np.mean(loop**2))
    return np.append(loop, loop[0])


@lru_cache(maxsize=64)
def _grain(vibration: Vibration, rate_hz: int) -> NDArray[np.float64]:
    """Make one fibre break, (_GRAIN_S * rate_hz,), peak 1: the lowest mode in wood's range."""
    mode = vibration.modes[0]
    frequency_hz = min(max(mode.frequency_hz, _GRAIN_HZ[0]), _GRAIN_HZ[1])
    decay = max(mode.decay_per_s, _GRAIN_DECAY)
    wave = _struck((Mode(frequency_hz, decay, 1.0),), _CONTACT_S["strike"], 1.0, rate_hz)
    wave = wave[: int(_GRAIN_S * rate_hz)]
    return np.asarray(wave / np.abs(wave).max())
