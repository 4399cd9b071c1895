"""Renders an impact as decaying modes of the material, struck by a soft pulse. Pure.

An object that is struck rings in modes: each is a sine of frequency f that decays as exp(-B t).
People name materials by these modes (Okamura, Cutkosky and Dennerlein 2001; docs/physics.md 4.3).

The pulse. A hand and an object touch for a contact time T, during which the force rises and falls
as (1 - cos(2 pi t / T)) / T. The time shrinks with speed^(-1/5) (Hertz) and with force. A shorter
pulse excites higher frequencies, so a faster or harder impact is stronger and brighter. The pulse
is smooth and its spectrum ends at 2 / T, which keeps the impact within the band of touch.

The response. With s = -B + 2 pi i f and w = 2 pi / T, a mode answers in closed form: while the
pulse lasts,

    y(t) = ((e^(st) - 1) / s - (s e^(st) + w sin wt - s cos wt) / (s^2 + w^2)) / T

and afterwards y(T) e^(s(t-T)). What is played is Im(s y / |s|), which has no constant part.

The level. What a pulse excites depends on its length. So the materials are first made equally
strong to the palm at every pulse length, and then follow their hardness: a mass that meets a spring
at speed v is stopped with an acceleration of 2 pi f v, where f is the frequency of the first mode.
That would be 21 dB from rubber to glass; the exponent HARDNESS compresses it to 16 dB.

The palm. On a palm speaker the level grows as the square root of the strength that speed and force
give, so that the range of a hand fits between the threshold of the palm and the end of the speaker.
No impact is too weak to be felt: at LEAST_MPS and LEAST_N the softest material lies LEAST_DB above
the threshold (`least_level`). That least level is added as a power, so it hardly changes a material
that is felt anyway, and it grows with the speed as everything else does. Controllers have a scale
of their own (controller_scale.py) and get the level as it is.

No two impacts are equal. A hand never strikes twice in the same way, so the seed varies level and
pitch of the whole blow, by less than is noticed. Nor does it strike the same place, and a mode is
excited by how far it moves there. So the seed also varies the gains of the higher modes by up to
PLACE_DB either way, and tunes each mode by little.

The band. Modes above about 500 Hz, or quickly damped ones above 300 Hz, ring beyond the end of the
band, however softly they are struck. A user's material with such modes is filtered. The filter is
causal and delays the impact by about a millisecond, so only materials that need it are filtered;
no built-in material is.
"""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from hapticvlm.materials import Mode, Vibration
from hapticvlm.rendering.vibration.cache import CACHE
from hapticvlm.rendering.vibration.equaliser import NOMINAL, Playback
from hapticvlm.rendering.vibration.filters import low_passed
from hapticvlm.rendering.vibration.perceived_level import perceived_amplitude, sensation_db
from hapticvlm.rendering.vibration.vibration import RATE_HZ, Motion

BAND_END_HZ = 1050.0
BAND_DB = -50.5  # share of an event's energy that may lie above; seeds lift it, by 3 dB at most
EDGE_HZ = 800.0  # to which the filter is flat; our choice

_Floats = NDArray[np.float64]

_Complex = NDArray[np.complex128]

# Figures without a source are our choice, to be tuned by hand on real speakers.
CONTACT_S = {"tap": 3.2e-3, "strike": 2.7e-3, "press": 6.0e-3}  # pulse length at 1 m/s and 0 N
SHORTEST_S = 2.4e-3  # the spectrum ends at 2 / T = 830 Hz: nothing rings above the band
_LONGEST_S = 11e-3  # of the slowest press
HARD_N = 10.0  # at this force the pulse is 7 % shorter
DAMPING = {"tap": 1.0, "strike": 1.0, "press": 3.0}  # a pressing hand stays and damps the modes
LEVEL = {"tap": 0.6, "strike": 1.0, "press": 0.5}
HARDNESS = 0.75  # exponent of the first mode's frequency (physics.md 4.3)
HARDEST_HZ = 350.0  # first mode of a material with full level
COMPRESSION = 0.5  # exponent of the strength on a palm speaker
LEAST_DB = 8.5  # above the threshold: every impact at this motion; seeds take up to 2.4 dB of it
LEAST_MPS = 0.1
LEAST_N = 1.0
# Shares by which a seed varies a blow, either way (physics.md 4.3).
LEVEL_VARIES = 0.12
PITCH_VARIES = 0.01
GOLDEN = 0.6180339887498949  # of a turn for each seed: two blows in a row are never equal
TUNE_VARIES = 0.015  # of each mode for itself
PLACE_DB = 6.0  # by which it varies the gains of all modes but the first
STRIKE_AMPLITUDE = 5.9  # at it the hardest strike of glass, which needs most drive, peaks at 0.9
LOUD_SPEED_MPS = 0.5  # an impact reaches 63 % of its level here
LOUD_FORCE_N = 3.0  # the same for a press
LONGEST_IMPACT_S = 0.48
END_FADE_S = 0.01
LENGTHS_S = np.geomspace(SHORTEST_S, _LONGEST_S, 7)  # pulse lengths at which levels are equal


def impact(
    vibration: Vibration,
    interaction: str,
    motion: Motion,
    seed: int,
    playback: Playback = NOMINAL,
) -> NDArray[np.float32]:
    """Return the waveform of one impact, (N,) float32 in [-1, 1], which begins and ends at 0.

    The seed varies the modes, as no two real impacts are the same.
    """
    modes = _varied(vibration.modes, seed)
    length_s = contact_s(interaction, motion)
    level = level_of(vibration, interaction, motion, playback.full_scale_db)
    gains = log_gains(vibration, DAMPING[interaction])
    level *= math.exp(np.interp(math.log(length_s), np.log(LENGTHS_S), gains))
    damping = DAMPING[interaction]
    limits = leaves_band(vibration, damping)
    wave = level * struck(modes, length_s, damping, playback.rate_hz, limits=limits)
    wave = playback.correction.apply(wave, playback.rate_hz)
    peak = float(np.abs(wave).max())
    return np.asarray(wave / max(peak, 1.0), dtype=np.float32)


def strength(interaction: str, motion: Motion) -> float:
    """Share of its level (0..1) that an impact reaches by its speed and force."""
    held = 0.7 + 0.6 * motion.force_n / (motion.force_n + LOUD_FORCE_N)
    push = held * motion.speed_mps / LOUD_SPEED_MPS
    if interaction == "press":
        push += motion.force_n / LOUD_FORCE_N
    return 1.0 - math.exp(-push)


def hardness(vibration: Vibration) -> float:
    """Perceived strength of an impact on this, as a share (0..1) of that on the hardest."""
    return float(min(vibration.modes[0].frequency_hz / HARDEST_HZ, 1.0) ** HARDNESS)


def level_of(
    vibration: Vibration, interaction: str, motion: Motion, full_scale_db: float | None
) -> float:
    """Return the level of an impact, in units of `perceived_amplitude`.

    `full_scale_db` is that of `equaliser.Playback`.
    """
    plain = full_strength(interaction) * hardness(vibration)
    if full_scale_db is None:
        return plain * strength(interaction, motion)
    least = least_level(vibration, interaction) * 10.0 ** (-full_scale_db / 20.0)
    return float(math.hypot(plain, least) * strength(interaction, motion) ** COMPRESSION)


@lru_cache(maxsize=256)
def least_level(vibration: Vibration, interaction: str) -> float:
    """Return the level of the strongest impact at which the least one is felt.

    It is that of a speaker whose full scale is at the threshold of the palm.
    """
    motion = Motion(LEAST_MPS, LEAST_N)
    damping = DAMPING[interaction]

    def least() -> _Floats:
        limits = leaves_band(vibration, damping)
        length_s = contact_s(interaction, motion)
        wave = struck(vibration.modes, length_s, damping, RATE_HZ, limits=limits)
        needed_db = LEAST_DB - sensation_db(wave, 0.0)
        return np.array([10.0 ** (needed_db / 20.0) * perceived_amplitude(wave)])

    name = f"least {interaction} {vibration!r}"
    return float(CACHE.get(name, least)[0] / strength(interaction, motion) ** COMPRESSION)


def full_strength(interaction: str) -> float:
    """Return the level of the hardest impact, in units of `perceived_amplitude`."""
    return LEVEL[interaction] * STRIKE_AMPLITUDE


@lru_cache(maxsize=256)
def leaves_band(vibration: Vibration, damping: float) -> bool:
    """Whether these modes ring above the band under a pulse of any of the lengths."""

    def highest_db() -> _Floats:
        waves = _struck_at_each_length(vibration, damping)
        return np.array([max(above_band_db(wave, RATE_HZ) for wave in waves)])

    return bool(CACHE.get(f"above band {damping!r} {vibration!r}", highest_db)[0] > BAND_DB)


def struck(
    modes: tuple[Mode, ...], contact_s: float, damping: float, rate_hz: int, *, limits: bool
) -> _Floats:
    """Return the response of modes to one soft pulse, (N,), faded out at the end.

    The equations are at the head of the file. `contact_s` is the length of the pulse, `damping` a
    factor of all decays; `limits` filters the result to the band of touch.
    """
    slowest = min(mode.decay_per_s for mode in modes) * damping
    count = int(min(contact_s + 6.0 / slowest, LONGEST_IMPACT_S) * rate_hz)
    pulse = int(contact_s * rate_hz)
    decay, turns, gain = np.array([(m.decay_per_s, m.frequency_hz, m.gain) for m in modes]).T
    # While the pulse lasts (`pushed`) the closed form is evaluated; afterwards (`free`) each mode
    # rings on from its last value. The gain is rotated by s / |s|, which leaves no constant part.
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
    if limits:
        wave = low_passed(wave, EDGE_HZ, rate_hz)
        wave[0] = 0.0  # which the filter leaves at 1e-18
    fade = min(int(END_FADE_S * rate_hz), count // 2)
    wave[-fade:] *= 0.5 + 0.5 * np.cos(np.linspace(0.0, math.pi, fade))
    return wave


def above_band_db(wave: _Floats, rate_hz: int) -> float:
    """Share in dB of an event's energy (N,) that lies above BAND_END_HZ, under a Hann window."""
    padded = np.pad(wave, wave.size // 2)
    power = np.abs(np.fft.rfft(padded * np.hanning(padded.size))) ** 2
    first = int(BAND_END_HZ * padded.size / rate_hz) + 1
    return float(10.0 * np.log10((power[first:].sum() + 1e-300) / (power.sum() + 1e-300)))


@lru_cache(maxsize=1)  # used twice in a row: for `leaves_band` and for the levels
def _struck_at_each_length(vibration: Vibration, damping: float) -> tuple[_Floats, ...]:
    return tuple(
        struck(vibration.modes, length_s, damping, RATE_HZ, limits=False) for length_s in LENGTHS_S
    )


def _ring_out(start: _Complex, pole: _Complex, count: int) -> _Floats:
    """Sum of Im(start e^(pole n)) over the modes, (count,).

    e^(pole n) is split into strides of 128 samples times steps within one, and their products are
    one product of matrices, which is ten times faster.
    """
    steps = np.exp(pole * np.arange(128))
    strides = start * np.exp(pole * (128 * np.arange(-(-count // 128))))
    rows = np.concatenate((strides.real, strides.imag)).T
    return np.asarray(rows @ np.concatenate((steps.imag, steps.real))).ravel()[:count]


def contact_s(interaction: str, motion: Motion) -> float:
    """Return the length of the pulse of this impact, s."""
    slow = math.pow(max(motion.speed_mps, 0.05), -0.2)
    hard = math.pow(1.0 + motion.force_n / HARD_N, -0.1)
    return max(CONTACT_S[interaction] * slow * hard, SHORTEST_S)


def _varied(modes: tuple[Mode, ...], seed: int) -> tuple[Mode, ...]:
    """Return the modes as one blow excites them."""
    rng = np.random.default_rng(seed)
    varied = 2.0 * (seed * GOLDEN % 1.0) - 1.0
    level, pitch = 1.0 - LEVEL_VARIES * varied, 1.0 + PITCH_VARIES * varied
    struck_modes = []
    for order, mode in enumerate(modes):
        tune, place = rng.uniform(-1.0, 1.0, 2).tolist()
        gain = mode.gain * level * (10.0 ** (PLACE_DB / 20.0 * place) if order else 1.0)
        hertz = mode.frequency_hz * pitch * (1.0 + TUNE_VARIES * tune)
        struck_modes.append(Mode(hertz, mode.decay_per_s, gain))
    return tuple(struck_modes)


@lru_cache(maxsize=256)
def log_gains(vibration: Vibration, damping: float) -> _Floats:
    """Return the logarithm of the levelling gain at each of LENGTHS_S, (7,)."""
    return CACHE.get(
        f"gains {damping!r} {vibration!r}", lambda: _computed_log_gains(vibration, damping)
    )


def _computed_log_gains(vibration: Vibration, damping: float) -> _Floats:
    waves = _struck_at_each_length(vibration, damping)
    if leaves_band(vibration, damping):
        waves = tuple(struck(vibration.modes, s, damping, RATE_HZ, limits=True) for s in LENGTHS_S)
    return np.asarray(-np.log(np.array([perceived_amplitude(wave) for wave in waves])))
