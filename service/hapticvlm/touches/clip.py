"""Reduces a touch to what every haptic format can hold: the envelope of one tone. Pure.

The voices of the service render the touch as a waveform with many frequencies; the formats have one
amplitude and one frequency at a time. The amplitude is sqrt(2) times the root mean square, so a
full-scale sine is 1. The frequency is that of a sine that changes equally quickly.

Points are STEP_S apart and joined by straight lines, as the formats prescribe. Sampling the
envelope at the points is not enough: a line from the peak of an impact to the next point has more
energy than the impact that decays in between. So the points are fitted, such that every WINDOW_S of
the lines has the energy that the speaker plays in it.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from hapticvlm.rendering.vibration.controller_scale import MIN_LEVEL, controller_amplitude
from hapticvlm.rendering.vibration.filters import resample
from hapticvlm.rendering.vibration.vibration import RATE_HZ
from hapticvlm.rendering.vibration.vibration_plan import PLAN_HZ, frequencies
from hapticvlm.touches.heat import Heat
from hapticvlm.touches.sound import Sound

STEP_S = 0.005
WINDOW_S = 0.02
_STEP = round(STEP_S * PLAN_HZ)
_WINDOW = round(WINDOW_S * PLAN_HZ)
_ROUNDS = 12  # of the fit, each of which about halves the error
_MAX_GAIN = 4.0  # of one round, where nearly nothing is played

_Values = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Clip:
    """A touch: `wave`, (N,) float32 at RATE_HZ, and `played`, the same at PLAN_HZ.

    `played` is filled up to a whole number of windows.
    """

    material: str
    interaction: str
    wave: NDArray[np.float32]
    played: NDArray[np.float32]
    heat: Heat

    @property
    def name(self) -> str:
        """The name of its file, without an ending."""
        return f"{self.material}-{self.interaction}"

    @property
    def times_s(self) -> _Values:
        """Times of the points, (points,) in s, from 0 to the end."""
        return np.arange(self.played.size // _STEP + 1, dtype=np.float64) * STEP_S

    @property
    def frequency_hz(self) -> _Values:
        """Frequency at each point, (points,) in Hz."""
        each = frequencies(self.played, STEP_S)  # of each step; the last point has that before it
        return np.append(each, each[-1])

    def points(self, power: float = 1.0) -> _Values:
        """Return the points, (points,) 0..1, whose lines to this power are the amplitude."""
        wanted = window_levels(np.sqrt(2.0) * self.played)
        return _fitted(self.played, wanted, power)


def clip(sound: Sound, heat: Heat) -> Clip:
    """Return the clip of a touch."""
    played = resample(sound.wave, 1, RATE_HZ // PLAN_HZ).astype(np.float32)
    windows = max(played.size // _WINDOW, 1)
    whole = np.zeros(windows * _WINDOW, np.float32)
    part = played[: whole.size]
    whole[: part.size] = part
    interaction = sound.interaction or "touch"
    return Clip(sound.material.name, interaction, sound.wave, whole, heat)


def for_controllers(of: Clip) -> Clip:
    """Return the clip with the strength that controllers need (`controller_scale`)."""
    # A controller hardly plays what a palm speaker plays softly, so soft parts are raised. The gain
    # follows the level of each step, joined by lines so that it does not jump.
    squared = np.square(of.played.reshape(-1, _STEP), dtype=np.float64)
    level = np.sqrt(2.0 * squared.mean(axis=1))
    gain = controller_amplitude(level, "parametric") / np.maximum(level, MIN_LEVEL)
    centres = (np.arange(gain.size) + 0.5) * _STEP
    gains = np.interp(np.arange(of.played.size), centres, gain)
    return replace(of, played=np.asarray(of.played * gains, dtype=np.float32))


def _fitted(wave: NDArray[np.float32], wanted: _Values, power: float = 1.0) -> _Values:
    """Return points, (points,) 0..1, whose lines to this power have these levels of windows.

    They begin with the shape of `wave`, (N,) at PLAN_HZ; `wanted` is (windows,).
    """
    padded = np.pad(2.0 * np.square(wave, dtype=np.float64), _STEP // 2)
    levels: _Values = np.sqrt(padded.reshape(-1, _STEP).mean(axis=1)) ** (1.0 / power)
    at = np.arange(levels.size) * STEP_S
    centres = (np.arange(wanted.size) + 0.5) * WINDOW_S
    # Each round compares the windows of the lines with those wanted and multiplies the points by
    # the ratio. A point shared by two windows gets a gain between theirs; repeated, they settle.
    for _ in range(_ROUNDS):
        read = window_levels(line(levels) ** power)
        gain = np.clip(wanted / np.maximum(read, 1e-9), 1.0 / _MAX_GAIN, _MAX_GAIN)
        levels *= np.interp(at, centres, gain) ** (1.0 / power)
        levels = np.minimum(levels, 1.0)
    return levels


def line(values: _Values) -> _Values:
    """Return points STEP_S apart joined by straight lines, sampled at PLAN_HZ."""
    at = np.arange((values.size - 1) * _STEP) / _STEP
    return np.asarray(np.interp(at, np.arange(values.size), values), dtype=np.float64)


def window_levels(amplitude: _Values) -> _Values:
    """Return the root mean square of each WINDOW_S of an amplitude at PLAN_HZ, (windows,)."""
    rows = amplitude[: amplitude.size // _WINDOW * _WINDOW].reshape(-1, _WINDOW)
    return np.asarray(np.sqrt(np.mean(rows**2, axis=1)))
