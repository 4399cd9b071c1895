"""An impact as a row of decaying modes struck by a soft pulse. Pure.

The pulse is force (1 - cos(2 pi t / T)) / T for the contact time T, which shrinks as speed^(-1/5)
(Hertz) and with force, so a faster or harder hit is stronger and brighter. With s = -B + 2 pi i f
and w = 2 pi / T a mode answers, in closed form while the pulse lasts,

    y(t) = ((e^(st) - 1) / s - (s e^(st) + w sin wt - s cos wt) / (s^2 + w^2)) / T

and y(T) e^(s(t-T)) afterwards. Im(s y / |s|) has no constant push; the smooth pulse keeps the band.

What a pulse excites depends on its length, so strengths are levelled at each length, and then
follow the hardness of the material. A mass that meets a spring at speed v is stopped with 2 pi f v
of acceleration: f is that of the first mode, and HARDNESS compresses what would be 21 dB from
rubber to glass to 16. A user's material whose modes would leave the band of touch is filtered.

Modes above 500 Hz or so, or quickly damped ones above 300, ring past the band's end however softly
they are struck. The filter is causal, so it moves what it filters by about a millisecond; only
materials that need it get it, and none of the built-in ones does.
"""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from hapticvlm.materials import Mode, Vibration
from hapticvlm.rendering.vibration.cache import CACHE
from hapticvlm.rendering.vibration.equaliser import NOMINAL, Playback
from hapticvlm.rendering.vibration.perceived_level import perceived_amplitude
from hapticvlm.rendering.vibration.vibration import RATE_HZ, Motion

BAND_END_HZ = 1050.0
BAND_DB = -50.5  # of an event's energy may lie above; half a dB for what a seed varies
# our choice: flat to 800 Hz
_ORDER = 7
_RIPPLE_DB = 0.5
_STOP_DB = 70.0
_EDGE_HZ = 800.0

_Floats = NDArray[np.float64]

_Complex = NDArray[np.complex128]

# Where no source is named a figure is our choice, to be tuned by hand on real speakers.
_CONTACT_S = {"tap": 3.2e-3, "strike": 2.7e-3, "press": 6.0e-3}  # s, pulse length at 1 m/s, 0 N
_SHORTEST_S = 2.4e-3  # s, its spectrum ends at 2 / T = 830 Hz: nothing rings above the band
_LONGEST_S = 11e-3  # s, of the slowest press
_HARD_N = 10.0  # N; a hit of this force is 7 % shorter
_DAMPING = {"tap": 1.0, "strike": 1.0, "press": 3.0}  # a pressing hand stays and damps the modes
_LEVEL = {"tap": 0.6, "strike": 1.0, "press": 0.5}
# exponent of the lowest mode; full level (physics.md 4.3)
HARDNESS = 0.75
HARDEST_HZ = 350.0
_STRIKE_AMPLITUDE = 5.9  # lets the hardest strike of glass, the neediest material, peak at 0.9
_LOUD_SPEED_MPS = 0.5  # m/s, an impact reaches 63 % of its level here
_LOUD_FORCE_N = 3.0  # N, the same for a press
_LONGEST_IMPACT_S = 0.48
_END_FADE_S = 0.01
_LENGTHS_S = np.geomspace(_SHORTEST_S, _LONGEST_S, 7)  # pulse lengths at which it is levelled


def above_band_db(wave: _Floats, rate_hz: int) -> float:
    """Energy above BAND_END_HZ of the whole event's (N,), through a Hann window around it, dB."""
    padded = np.pad(wave, wave.size // 2)
    power = np.abs(np.fft.rfft(padded * np.hanning(padded.size))) ** 2
    first = int(BAND_END_HZ * padded.size / rate_hz) + 1
    return float(10.0 * np.log10((power[first:].sum() + 1e-300) / (power.sum() + 1e-300)))


def limited(wave: _Floats, rate_hz: int) -> _Floats:
    """Return the wave (N,) without what lies above the band."""
    from scipy import signal  # a second of a processor to load, for the few that need it

    return np.asarray(signal.sosfilt(_filter(rate_hz), wave))


@lru_cache(maxsize=8)
def _filter(rate_hz: int) -> _Floats:
    from scipy import signal

    return np.asarray(
        signal.ellip(_ORDER, _RIPPLE_DB, _STOP_DB, _EDGE_HZ, fs=rate_hz, output="sos")
    )


def impact(
    vibration: Vibration,
    interaction: str,
    motion: Motion,
    seed: int,
    playback: Playback = NOMINAL,
) -> NDArray[np.float32]:
    """Waveform (N,) float32 in [-1, 1] of one impact, from 0 to 0; the seed varies it slightly."""
    vary = np.random.default_rng(seed).uniform
    modes = tuple(
        Mode(
            mode.frequency_hz * vary(0.985, 1.015),
            mode.decay_per_s,
            mode.gain * vary(0.9, 1.1),
        )
        for mode in vibration.modes
    )
    contact_s = _contact_s(interaction, motion)
    level = _LEVEL[interaction] * strength(interaction, motion)
    level *= _gain(vibration, interaction, contact_s) * hardness(vibration)
    damping = _DAMPING[interaction]
    limits = leaves_band(vibration, damping)
    wave = level * struck(modes, contact_s, damping, playback.rate_hz, limits=limits)
    wave = playback.correction.apply(wave, playback.rate_hz)
    peak = float(np.abs(wave).max())
    return np.asarray(wave / max(peak, 1.0), dtype=np.float32)


def strength(interaction: str, motion: Motion) -> float:
    """How much of its level an impact reaches, 0..1, by speed and force."""
    held = 0.7 + 0.6 * motion.force_n / (motion.force_n + _LOUD_FORCE_N)
    push = held * motion.speed_mps / _LOUD_SPEED_MPS
    if interaction == "press":
        push += motion.force_n / _LOUD_FORCE_N
    return 1.0 - math.exp(-push)


def hardness(vibration: Vibration) -> float:
    """Perceived strength of a blow on this, 0..1 of a blow on the hardest."""
    return float(min(vibration.modes[0].frequency_hz / HARDEST_HZ, 1.0) ** HARDNESS)


def full_strength(interaction: str) -> float:
    """Return what the hardest impact is levelled to, in units of perceived_amplitude."""
    return _LEVEL[interaction] * _STRIKE_AMPLITUDE


@lru_cache(maxsize=256)
def leaves_band(vibration: Vibration, damping: float) -> bool:
    """Whether a pulse of any of the lengths has these modes ring above the band."""

    def highest_db() -> _Floats:
        waves = _struck_at_each_length(vibration, damping)
        return np.array([max(above_band_db(wave, RATE_HZ) for wave in waves)])

    return bool(CACHE.get(f"above band {damping!r} {vibration!r}", highest_db)[0] > BAND_DB)


@lru_cache(maxsize=1)  # asked for twice in a row: does it leave the band, and how loud is it
def _struck_at_each_length(vibration: Vibration, damping: float) -> tuple[_Floats, ...]:
    return tuple(
        struck(vibration.modes, length_s, damping, RATE_HZ, limits=False) for length_s in _LENGTHS_S
    )


def struck(
    modes: tuple[Mode, ...], contact_s: float, damping: float, rate_hz: int, *, limits: bool
) -> _Floats:
    """Modes struck by one soft pulse, (N,), faded out at the end; the equations are at the head.

    `limits` has a filter keep it in the band of touch.
    """
    slowest = min(mode.decay_per_s for mode in modes) * damping
    count = int(min(contact_s + 6.0 / slowest, _LONGEST_IMPACT_S) * rate_hz)
    pulse = int(contact_s * rate_hz)
    decay, turns, gain = np.array([(m.decay_per_s, m.frequency_hz, m.gain) for m in modes]).T
    pole: _Complex = (-damping * decay + 2j * math.pi * turns)[:, None]
    gain = gain[:, None] * pole / np.abs(pole)
    time_s = np.arange(pulse + 1) / rate_hz
    turn = 2.0 * math.pi * rate_hz / pulse
    ring = np.exp(pole * time_s)
    sine = np.sin(turn * time_s)
    cosine = np.cos(turn * time_s)
    swing = (pole * ring + turn * sine - pole * cosine) / (pole**2 + turn**2)
    pushed = gain * ((ring - 1.0) / pole - swing) * (rate_hz / pulse)
    free = _ring_out(pushed[:, -1:], pole / rate_hz, count - pulse)
    wave = np.concatenate((pushed[:, :-1].imag.sum(axis=0), free))
    wave = limited(wave, rate_hz) if limits else wave
    fade = min(int(_END_FADE_S * rate_hz), count // 2)
    wave[-fade:] *= 0.5 + 0.5 * np.cos(np.linspace(0.0, math.pi, fade))
    return wave


def _ring_out(start: _Complex, pole: _Complex, count: int) -> _Floats:
    """Sum over modes of Im(start e^(pole n)), (count,); strides times steps, ten times faster."""
    steps = np.exp(pole * np.arange(128))
    strides = start * np.exp(pole * (128 * np.arange(-(-count // 128))))
    rows = np.concatenate((strides.real, strides.imag)).T
    return np.asarray(rows @ np.concatenate((steps.imag, steps.real))).ravel()[:count]


def _contact_s(interaction: str, motion: Motion) -> float:
    slow = math.pow(max(motion.speed_mps, 0.05), -0.2)
    hard = math.pow(1.0 + motion.force_n / _HARD_N, -0.1)
    return max(_CONTACT_S[interaction] * slow * hard, _SHORTEST_S)


def _gain(vibration: Vibration, interaction: str, contact_s: float) -> float:
    """Gain that makes all equally strong to the palm; the neediest material peaks highest."""
    log_gains = _log_gains(vibration, _DAMPING[interaction])
    at = np.interp(math.log(contact_s), np.log(_LENGTHS_S), log_gains)
    return _STRIKE_AMPLITUDE * math.exp(at)


@lru_cache(maxsize=256)
def _log_gains(vibration: Vibration, damping: float) -> _Floats:
    return CACHE.get(
        f"gains {damping!r} {vibration!r}", lambda: _computed_log_gains(vibration, damping)
    )


def _computed_log_gains(vibration: Vibration, damping: float) -> _Floats:
    waves = _struck_at_each_length(vibration, damping)
    if leaves_band(vibration, damping):
        waves = tuple(struck(vibration.modes, s, damping, RATE_HZ, limits=True) for s in _LENGTHS_S)
    return np.asarray(-np.log(np.array([perceived_amplitude(wave) for wave in waves])))
