"""Renders sustained textures: the relief of a surface, read by the hand that moves over it. Pure.

Sliding. A surface is a loop of noise in space (`loops.py`), and the hand reads it at speed / pitch
periods a second. Frequency and movement therefore always fit together: a hand that moves twice as
fast feels twice the frequency, as on a real surface. Above 250 Hz the rate is bent into the band of
touch, because a hand that crosses 0.5 mm of weave at 1 m/s would make 2 kHz, which nobody feels.

Stick-slip. A surface with friction catches the skin, stretches it and releases it at a critical
displacement. The releases come at speed / critical displacement. The harder the surface is pressed
the more of it sticks; above some speed it no longer catches.

Carving adds fibre breaks to sliding: single grains on the resonance of the material. Swinging has
no surface: the loop is read at the rate at which vortices leave a cylinder, 0.2 v / d, where d is
the thickness of the object that is swung; the rougher it is, the broader is its noise.

Level. Each loop is driven as strongly as its band needs to be felt equally. How strongly a surface
is felt then follows its roughness, and its stick-slip follows its friction. All figures are in
docs/physics.md 4.3.
"""

from __future__ import annotations

import copy
import math
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from hapticvlm.materials import Mode, Vibration
from hapticvlm.rendering.vibration import impacts, loops
from hapticvlm.rendering.vibration.equaliser import NOMINAL, Playback
from hapticvlm.rendering.vibration.loops import Loop
from hapticvlm.rendering.vibration.perceived_level import GRID_HZ, perceived_amplitude
from hapticvlm.rendering.vibration.smoothing import SmoothedValue
from hapticvlm.rendering.vibration.vibration import RATE_HZ, Motion

_Floats = NDArray[np.float64]

# Figures without a source are our choice, to be tuned by hand on real speakers.
RMS = 0.12  # of full scale at 250 Hz and roughness 1: leaves 12 dB of drive and peaks of 3 times it
LOWEST_HZ = 20.0
SLOW_SPEED_MPS = 0.12  # half level of a slide
LIGHT_FORCE_N = 0.5  # half of what force adds; without force the level is 30 %
SLIP_M = 4e-3  # critical displacement (physics.md 4.3)
SLIPS_HZ = (20.0, 120.0)
STUCK_N = 2.0  # at which half of the surface that can stick does
CATCH_MPS = 3.0  # per share that sticks: at this speed half of it no longer catches
STROUHAL = 0.2  # of a cylinder (physics.md 4.3)
SWING_SPEED_MPS = 2.5
_SWING_BANDWIDTH = (0.4, 1.0)  # of a smooth object, of a fully rough one
BREAK_PERIODS = 2.5  # width of a fibre in periods of the surface: 4 mm in wood (physics.md 4.3)
BREAKS_HZ = (10.0, 60.0)
_TOO_HARD_HZ = 200.0  # a material that rings higher is not carved: the blade slips and chatters
_CHATTER = 0.7
_GRAIN_HZ = (40.0, 250.0)
_GRAIN_DECAY = 120.0
GRAIN_S = 0.04
GRAIN_CONTACT_S = 2.4e-3
_GRAIN_AMPLITUDE = 7.0
_GRAIN_PEAK = 0.85
CARVE_RUB = 0.6  # share of plain rubbing that is felt between the breaks
BEST_HZ = 250.0  # a palm is most sensitive here (physics.md 4.1)
HIGHEST_HZ = 360.0  # needs 12 dB more drive than 250 Hz (perception.drive_threshold_db)
BEND_HZ = 150.0  # our choice: 286 and 400 Hz stay 17 % apart, about one step of frequency


def rendered_hz(frequency_hz: float) -> float:
    """Bend a frequency into 0..HIGHEST_HZ; strictly increasing, and unchanged up to BEST_HZ."""
    if frequency_hz <= BEST_HZ:
        return frequency_hz
    room = HIGHEST_HZ - BEST_HZ
    return BEST_HZ - room * math.expm1((BEST_HZ - frequency_hz) / BEND_HZ)


class Texture:
    """Plays one sustained texture; its state makes consecutive blocks join."""

    def __init__(
        self,
        vibration: Vibration,
        interaction: str,
        seed: int,
        playback: Playback = NOMINAL,
        thickness_m: float | None = None,
    ) -> None:
        """Start a texture of this interaction; the seed sets where in its loops it begins.

        `thickness_m` is that of a swung object; None takes the usual one of its material.
        """
        self._vibration = vibration
        self._interaction = interaction
        self._rng = np.random.default_rng(seed)
        self._in_air = interaction == "swing"
        self._period_m = vibration.pitch_m
        if self._in_air:
            self._period_m = (vibration.swung_m if thickness_m is None else thickness_m) / STROUHAL
        bandwidth = shed(vibration.roughness) if self._in_air else vibration.bandwidth
        loop = loops.noise(bandwidth, 0.0 if self._in_air else vibration.roughness)
        self._surface = _Reader(loop, self._rng.random(), playback)
        self._sticks = sticks(vibration, interaction)
        self._slips = (
            _Reader(loops.stick_slip(), self._rng.random(), playback) if self._sticks else None
        )
        is_carved = interaction == "carve" and not is_hard(vibration)
        self._breaks = _Breaks(vibration, self._rng, playback) if is_carved else None

    def fork(self) -> Texture:
        """Return an independent copy in the same state."""
        forked = copy.copy(self)
        forked._surface = self._surface.fork()
        forked._slips = None if self._slips is None else self._slips.fork()
        forked._breaks = None if self._breaks is None else self._breaks.fork()
        return forked

    def render(self, count: int, motion: Motion) -> NDArray[np.float32]:
        """Next `count` samples, (count,) float32, under a motion that holds for all of them."""
        rough = 1.0 if self._in_air else self._vibration.roughness
        moved, rubbed, slipped = strengths(self._interaction, rough, self._sticks, motion)
        wave = np.zeros(count)
        wave += self._surface.read(count, centre_hz(motion.speed_mps / self._period_m), rubbed)
        if self._slips is not None:
            wave += self._slips.read(count, slips_hz(motion.speed_mps), slipped)
        if self._breaks is not None:
            wave = CARVE_RUB * wave + self._breaks.render(count, moved, motion.speed_mps)
        return np.asarray(wave, dtype=np.float32)


def strengths(
    interaction: str, rough: float, stick: float, motion: Motion
) -> tuple[float, float, float]:
    """Return the strength (0..1) of the movement, of its rubbing and of its slips.

    `rough` is the roughness of the surface, and 1 in the air; `stick` the share that can catch.
    """
    moved = share(interaction, motion)
    caught = catching(stick, motion)
    # Rubbing and stick-slip share one energy: the square of the share that catches goes into
    # slips, and the rest stays with the rubbing.
    return moved, moved * rough * math.sqrt(1.0 - caught**2), moved * caught


def centre_hz(periods_hz: float) -> float:
    """Return the frequency at which a relief is felt that a hand crosses at this rate, Hz."""
    return max(rendered_hz(periods_hz), LOWEST_HZ)


def slips_hz(speed_mps: float) -> float:
    """Return how often a sticking surface slips at this speed, Hz."""
    return min(max(speed_mps / SLIP_M, SLIPS_HZ[0]), SLIPS_HZ[1])


def share(interaction: str, motion: Motion) -> float:
    """Share of its full strength (0..1) that a texture reaches by speed and force."""
    speed = motion.speed_mps
    if interaction == "swing":
        return 1.0 - math.exp(-speed * speed / SWING_SPEED_MPS**2)
    pressed = 0.3 + 0.7 * motion.force_n / (motion.force_n + LIGHT_FORCE_N)
    return pressed * speed / (speed + SLOW_SPEED_MPS)


def catching(stick: float, motion: Motion) -> float:
    """Share (0..1) of a surface that catches and slips at this force and speed.

    `stick` is the share that can; a harder press keeps it catching up to a higher speed.
    """
    # The held share saturates with the force. With the speed v it falls as 1 / (1 + (v / limit)^2):
    # beyond the limit the skin slides on before the surface can catch it again.
    held = stick * motion.force_n / (motion.force_n + STUCK_N)
    limit_mps = CATCH_MPS * held
    if limit_mps == 0.0:
        return 0.0
    return held * (limit_mps / math.hypot(limit_mps, motion.speed_mps)) ** 2


@lru_cache(maxsize=64)
def grain(vibration: Vibration, playback: Playback) -> _Floats:
    """Return one grain, (GRAIN_S * rate_hz,): the first mode within wood's range, levelled."""
    modes = (grain_mode(vibration),)
    # The level is that of the grain at RATE_HZ, whatever the rate it is rendered at: the energy of
    # a sum over samples depends on their number.
    wave = impacts.struck(modes, GRAIN_CONTACT_S, 1.0, playback.rate_hz, limits=False)
    wave = playback.correction.apply(grain_gain(modes[0]) * wave, playback.rate_hz)
    wave = wave[: int(GRAIN_S * playback.rate_hz)]
    return np.asarray(wave * min(1.0, _GRAIN_PEAK / np.abs(wave).max()))


def grain_mode(vibration: Vibration) -> Mode:
    """Return the mode of a grain: the first one of the material, within wood's range."""
    mode = vibration.modes[0]
    frequency_hz = min(max(mode.frequency_hz, _GRAIN_HZ[0]), _GRAIN_HZ[1])
    return Mode(frequency_hz, max(mode.decay_per_s, _GRAIN_DECAY), 1.0)


def grain_gain(mode: Mode) -> float:
    """Return the gain of a grain of this mode, at which it is as strong as any other."""
    wave = impacts.struck((mode,), GRAIN_CONTACT_S, 1.0, RATE_HZ, limits=False)
    return _GRAIN_AMPLITUDE / perceived_amplitude(wave)


class _Reader:
    """Reads a loop at a rate and a level that follow their targets smoothly."""

    def __init__(self, loop: Loop, place: float, playback: Playback) -> None:
        self._loop = loop
        self._playback = playback
        self._at = place * loop.size
        self._centre: SmoothedValue | None = None
        self._level = SmoothedValue()

    def fork(self) -> _Reader:
        """Return an independent copy in the same state."""
        forked = copy.copy(self)
        forked._centre = None if self._centre is None else self._centre.fork()
        forked._level = self._level.fork()
        return forked

    def read(self, count: int, centre_hz: float, strength: float) -> _Floats | float:
        """Next `count` samples around `centre_hz`, (count,), or 0.0 for silence.

        `strength` is a share (0..1) of full strength.
        """
        if self._centre is None:
            self._centre = SmoothedValue(centre_hz)
        centres = self._centre.follow(centre_hz, count, self._playback.rate_hz)
        drive = float(np.interp(centre_hz, GRID_HZ, self._loop.drive))
        target = RMS * strength * drive * self._playback.correction.gain(centre_hz)
        level = self._level.follow(target, count, self._playback.rate_hz)
        at = self._move(count, centres)
        if isinstance(level, float) and level == 0.0:
            return 0.0
        return self._loop.read(at) * level

    def _move(self, count: int, centres: _Floats | float) -> _Floats:
        per_hz = self._loop.samples / self._playback.rate_hz
        if isinstance(centres, float):
            at = self._at + _counts(count) * (centres * per_hz)
        else:
            at = self._at + np.cumsum(centres) * per_hz
        if count:
            self._at = float(at[-1]) % self._loop.size
        return at


class _Breaks:
    """Plays fibre breaks under a moving blade, with the tails of earlier ones."""

    def __init__(self, vibration: Vibration, rng: np.random.Generator, playback: Playback) -> None:
        self._rng = rng
        self._rate_hz = playback.rate_hz
        self._spacing_m = BREAK_PERIODS * vibration.pitch_m
        self._draws: list[float] = []
        self._drawn = 0
        self._grain = grain(vibration, playback)
        self._tail = np.zeros(self._grain.size)
        self._to_next = rng.random()  # distance to the next break, in mean spacings
        self._level = SmoothedValue()
        self.begun = 0

    def fork(self) -> _Breaks:
        """Return an independent copy in the same state."""
        forked = copy.copy(self)
        forked._level = self._level.fork()
        return forked

    def _draw(self, low: float, high: float) -> float:
        """Return the next random number; copies share the drawn numbers and so the same future."""
        if self._drawn == len(self._draws):
            self._draws.append(self._rng.random())
        self._drawn += 1
        return low + (high - low) * self._draws[self._drawn - 1]

    def render(self, count: int, target: float, speed_mps: float) -> _Floats:
        """Next `count` samples, (count,), with a level that follows `target`."""
        level = self._level.follow(target, count, self._rate_hz)
        wave = np.concatenate((self._tail, np.zeros(count)))
        per_sample = breaks_hz(self._spacing_m, speed_mps) / self._rate_hz
        # The blade moves on by a share of a spacing per sample. A negative distance means that a
        # break lies within this block; the distance from it to the block's end gives its sample.
        self._to_next -= per_sample * count
        while self._to_next < 0.0:
            begin = max(count + math.floor(self._to_next / per_sample), 0)
            now = level if isinstance(level, float) else float(level[begin])
            strength = self._draw(0.4, 1.0) * now
            wave[begin : begin + self._grain.size] += strength * self._grain
            self._to_next += self._draw(0.5, 1.5)
            self.begun += 1
        self._tail = wave[count:]
        return wave[:count]


def breaks_hz(spacing_m: float, speed_mps: float) -> float:
    """Return how often fibres of this mean distance break, Hz; 0 for a blade at rest."""
    rate = min(max(speed_mps / spacing_m, BREAKS_HZ[0]), BREAKS_HZ[1])
    return rate if speed_mps > 0.0 else 0.0


def is_hard(vibration: Vibration) -> bool:
    """Whether it is too hard to carve: the first mode rises with the stiffness of a material."""
    return vibration.modes[0].frequency_hz > _TOO_HARD_HZ


def sticks(vibration: Vibration, interaction: str) -> float:
    """Return the share of a surface that can catch and slip."""
    if interaction == "swing":
        return 0.0
    if interaction == "carve" and is_hard(vibration):
        return max(vibration.stick, _CHATTER * (1.0 - vibration.roughness))
    return vibration.stick


def shed(roughness: float) -> float:
    """Bandwidth of the noise of a swung object, relative to its frequency."""
    smooth, rough = _SWING_BANDWIDTH
    return smooth + (rough - smooth) * roughness


@lru_cache(maxsize=8)
def _counts(count: int) -> _Floats:
    return np.arange(1.0, count + 1.0)
