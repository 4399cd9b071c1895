"""Plans the vibration of the next moments, for actuators other than the palm speaker. Pure.

A plan is rendered from the same commands by the same voices that the speaker plays, but at PLAN_HZ
instead of 48 kHz, which suffices because their band ends at 1 kHz. The voices follow the commands
up to now. A fork of them then runs ahead by HORIZON_S as if no other command came; the next plan
replaces that guess.

The level of a period is sqrt(2) times its rms, so a full-scale sine has level 1. Its frequency is
that of a sine whose samples differ as much from one to the next: the energy of the differences over
the energy of the wave is 4 sin^2(pi f / PLAN_HZ) for a sine of frequency f. Amplitudes in a plan
are on the scale of controllers (`controller_scale.py`), and the gain multiplies them. The figures
are explained in docs/physics.md 4.6.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from hapticvlm.materials import Material
from hapticvlm.rendering.vibration.controller_scale import (
    MIN_IMPACT,
    Form,
    controller_amplitude,
    loudness,
)
from hapticvlm.rendering.vibration.equaliser import Playback
from hapticvlm.rendering.vibration.filters import resample
from hapticvlm.rendering.vibration.patterns import Pattern
from hapticvlm.rendering.vibration.vibration import RATE_HZ
from hapticvlm.rendering.vibration.voices import Command, Voices

PLAN_HZ = 4000
HORIZON_S = 0.1
PERIOD_S: dict[Form, float] = {"amplitude": 0.0125, "parametric": 0.005}
FREQUENCY_S = 0.015  # window over which a frequency is estimated
MIN_IMPACT_S = 0.0125  # for which an impact lasts at least, so that a controller plays it
MIN_AMPLITUDE = 1e-3  # below it a plan is silence
LOWEST_HZ = 20.0
HIGHEST_HZ = 1000.0
PLAYBACK = Playback(PLAN_HZ, full_scale_db=None)
STALE_S = 0.5  # a longer gap is not rendered, since every impact and fade ends within it

_Wave = NDArray[np.float32]


@dataclass(frozen=True, slots=True)
class Pulse:
    """An impact that begins `at_s` after the plan, with its amplitude (0..1) and frequency."""

    at_s: float
    amplitude: float
    frequency_hz: float


@dataclass(frozen=True, slots=True)
class VibrationPlan:
    """Amplitudes 0..1 (N,), one for each period, and frequencies in Hz (N,) or none.

    An empty plan means silence.
    """

    period_s: float
    amplitude: tuple[float, ...] = ()
    frequency_hz: tuple[float, ...] = ()
    pulses: tuple[Pulse, ...] = ()


class VibrationPlanner:
    """Plans the vibration of one hand from the same commands that the speaker receives."""

    def __init__(
        self, table: Mapping[str, Material], patterns: Iterable[Pattern] = (), gain: float = 1.0
    ) -> None:
        """Fill the caches of all materials in `table`, which takes a part of a second.

        `patterns` are recordings that replace some materials; `gain` (0..1) scales every plan.
        """
        resampled = [_at_plan_rate(pattern) for pattern in patterns]
        self._table = table
        self.gain = gain
        self._voices = Voices(1.0, table, PLAYBACK, resampled)
        self._rendered_until: float | None = None
        self._renewal: Command | None = None
        self._expires_at = -math.inf

    def apply(self, command: Command, now: float) -> None:
        """Apply a command; a mere renewal is deferred to the next plan, so it costs nothing."""
        self._expires_at = command.expires_at
        if not command.onset:
            self._renewal = command
            return
        self._advance(now)
        self._voices.apply(command)

    def rest(self) -> None:
        """Plan silence until the next command."""
        self._voices.silence()
        self._renewal = None
        self._rendered_until = None

    def plan(self, form: Form, now: float) -> VibrationPlan:
        """Return the vibration from `now` (s) on if no other command comes; empty for silence."""
        # The impacts that begin now are read first, since advancing the voices may start them.
        impacts = self._voices.beginning()
        self._advance(now)
        period_s = PERIOD_S[form]
        ahead_s = min(HORIZON_S, self._expires_at - now)
        if self._voices.is_silent or ahead_s <= 0.0:
            return VibrationPlan(period_s)
        wave = self._voices.fork().render(round(HORIZON_S * PLAN_HZ), now)
        count = max(1, math.floor(ahead_s / period_s + 1e-9))
        amplitude = self._amplitude(wave, form, has_impact=bool(impacts))[:count]
        if float(amplitude.max()) < MIN_AMPLITUDE:
            return VibrationPlan(period_s)
        played = tuple(np.round(amplitude, 4).tolist())
        if form == "amplitude":
            return VibrationPlan(period_s, played)
        frequency = tuple(np.round(frequencies(wave, period_s)[:count], 1).tolist())
        return VibrationPlan(period_s, played, frequency, self._pulses(impacts))

    def _amplitude(
        self, wave: NDArray[np.float32], form: Form, *, has_impact: bool
    ) -> NDArray[np.float64]:
        """Return the controller's amplitude, 0..1, in each period of the wave (N,), (periods,)."""
        played = amplitudes(wave, form)
        if has_impact:
            beginning = played[: round(MIN_IMPACT_S / PERIOD_S[form])]
            beginning[:] = np.maximum(beginning, MIN_IMPACT)
        return played * self.gain

    def _pulses(self, impacts: list[tuple[str, float]]) -> tuple[Pulse, ...]:
        peaks = controller_amplitude(np.array([peak for _, peak in impacts]), "parametric")
        names = (name for name, _ in impacts)
        return tuple(
            Pulse(
                0.0, round(peak * self.gain, 4), self._table[name].vibration.modes[0].frequency_hz
            )
            for name, peak in zip(names, np.maximum(peaks, MIN_IMPACT).tolist(), strict=True)
        )

    def _advance(self, now: float) -> None:
        """Advance the voices to `now` under the commands so far."""
        since = self._rendered_until
        self._rendered_until = now
        elapsed_s = 0.0 if since is None else min(max(now - since, 0.0), STALE_S)
        count = round(elapsed_s * PLAN_HZ)
        if count and not self._voices.is_silent:
            self._voices.render(count, now - elapsed_s)
        if self._renewal is not None:
            self._voices.apply(self._renewal)
            self._renewal = None


def amplitudes(wave: _Wave, form: Form) -> NDArray[np.float64]:
    """Return what a controller plays of a wave (N,) at PLAN_HZ: one value a period, (periods,)."""
    drive = loudness(wave, PLAN_HZ) if form == "amplitude" else wave
    return controller_amplitude(levels(drive, PERIOD_S[form]), form)


def levels(wave: _Wave, period_s: float) -> NDArray[np.float64]:
    """Level of each period of a wave (N,) at PLAN_HZ, 0..1, (periods,)."""
    return np.asarray(np.minimum(unlimited_levels(wave, period_s), 1.0))


def unlimited_levels(wave: _Wave, period_s: float) -> NDArray[np.float64]:
    """Level of each period of a wave (N,) at PLAN_HZ that may be above 1, (periods,)."""
    size = round(period_s * PLAN_HZ)
    rows = wave[: wave.size // size * size].reshape(-1, size).astype(np.float64)
    return np.asarray(np.sqrt(2.0 * np.mean(rows**2, axis=1)))


def frequencies(wave: _Wave, period_s: float) -> NDArray[np.float64]:
    """Frequency of each period of a wave (N,) at PLAN_HZ, Hz, (periods,)."""
    size = round(period_s * PLAN_HZ)
    window = round(FREQUENCY_S * PLAN_HZ)
    # Running sums give the energy of the wave and of its differences over any window at once.
    samples = wave.astype(np.float64)
    energy = np.concatenate(([0.0], np.cumsum(samples**2)))
    steps = np.concatenate(([0.0, 0.0], np.cumsum(np.diff(samples) ** 2)))
    middles = np.arange(wave.size // size) * size + size // 2
    begin = np.clip(middles - window // 2, 0, wave.size - 1)
    end = np.clip(middles + window // 2, 1, wave.size)
    share = (steps[end] - steps[begin]) / np.maximum(energy[end] - energy[begin], 1e-12)
    hertz = np.arcsin(np.clip(np.sqrt(share) / 2.0, 0.0, 1.0)) * PLAN_HZ / np.pi
    return np.asarray(np.clip(hertz, LOWEST_HZ, HIGHEST_HZ))


def _at_plan_rate(pattern: Pattern) -> Pattern:
    samples = resample(pattern.samples, 1, RATE_HZ // PLAN_HZ)
    return replace(pattern, samples=samples.astype(np.float32))
