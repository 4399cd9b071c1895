"""Mixes both hands' impacts and textures into blocks, and limits them. Pure.

Time and commands are arguments. Knows commands and samples, no sound card and no scene. A hand
sounds only while its lease runs: a command sets its end, and past that the hand fades by itself.
Every change of voice is a linear fade of FADE_S, so whatever ends is silent within 20 ms at any
block size.

The mix leaves through a look-ahead limiter, which turns down what would leave [-1, 1] beforehand.
Bending peaks sample by sample would put energy above the band of touch. Instead the sound waits
DELAY_S and the gain it needs is known that much earlier: the largest reduction of the last DELAY_S,
released over RELEASE_S, is averaged over DELAY_S, so it is complete when the peak comes out and too
slow to widen the band. A signal within range passes unchanged, only later.
"""

from __future__ import annotations

import copy
import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace

import msgspec
import numpy as np
from numpy.typing import NDArray

from hapticvlm.materials import MATERIALS, Material
from hapticvlm.rendering.vibration.equaliser import NOMINAL, Playback
from hapticvlm.rendering.vibration.grains import Grains
from hapticvlm.rendering.vibration.hum import Hum, Tone
from hapticvlm.rendering.vibration.impacts import impact
from hapticvlm.rendering.vibration.patterns import Pattern, PatternTexture
from hapticvlm.rendering.vibration.textures import Texture
from hapticvlm.rendering.vibration.vibration import IMPACTS, TEXTURES, Motion
from hapticvlm.rendering.vibration.voice import Voice, ramp

DELAY_S = 1.0 / 600.0  # 80 samples at 48 kHz; of a tap, 5.5 ms are noticed (physics.md 4.4)
RELEASE_S = 0.1  # our choice: longer than a period of 20 Hz, so that the gain follows no wave
CEILING = 0.99
_NEGLIGIBLE = 1e-6  # a reduction as small as that has ended
_Floats = NDArray[np.float64]
_STILL = Motion(0.0, 0.0)
FADE_S = 0.012  # s, with one chunk of delay still well inside the 20 ms a lease allows
_CHUNK = 256  # samples, so that a long block cannot hide the end of a lease
# per hand: bounds a block's cost
_MAX_RINGING = 4
_MAX_IMPACTS = 8
_MAX_FADING_TEXTURES = 2


class Command(msgspec.Struct, frozen=True, gc=False):
    """What one hand does now: hand 0 left, 1 right; no material is nothing to feel.

    `onset` starts an impact; `expires_at` is in seconds of the clock that `render` is given. `gain`
    (0..1) is below 1 for a material that is not sure. `thickness_m` is that of what is swung, None
    what is usual for its material. `hum` is what is felt of a thing that vibrates by itself.
    """

    hand: int
    material: str | None
    interaction: str
    onset: bool
    motion: Motion
    seed: int
    expires_at: float
    gain: float = 1.0
    thickness_m: float | None = None
    hum: Hum | None = None


class Voices:
    """The mixer: applies commands, renders blocks, counts what it had to drop."""

    def __init__(
        self,
        gain: float = 1.0,
        table: Mapping[str, Material] = MATERIALS,
        playback: Playback = NOMINAL,
        patterns: Iterable[Pattern] = (),
        *,
        fills_caches: bool = True,
    ) -> None:
        self.gain = gain
        self.level = 0.0  # rms of the last block
        self.scrubbed = 0  # voices and commands dropped for not being finite
        self.dropped = 0  # impacts refused because too many were sounding
        self._playback = playback
        self._rate_hz = playback.rate_hz
        self._table = table
        self._patterns = {pattern.key: pattern for pattern in patterns}
        self._step = 1.0 / (FADE_S * playback.rate_hz)
        self._gain = gain
        self._limiter = Limiter(playback.rate_hz)
        self._hands = (_Hand(), _Hand())
        if fills_caches:
            _fill_caches(table.values(), playback)

    def fork(self) -> Voices:
        """Return a copy in the same state that goes its own way: what comes if nothing changes."""
        forked = copy.copy(self)
        forked._hands = (self._hands[0].fork(), self._hands[1].fork())
        forked._limiter = self._limiter.fork()
        return forked

    def silence(self) -> None:
        """Drop everything at once, without a fade: for a copy that is not played."""
        for hand in self._hands:
            hand.rest()
            hand.voices.clear()
        self._limiter.clear()

    @property
    def is_silent(self) -> bool:
        """Whether nothing sounds and nothing is about to."""
        is_idle = not any(
            hand.voices or hand.wanted or hand.pressed or hand.hum for hand in self._hands
        )
        return is_idle and self._limiter.is_empty

    def beginning(self) -> list[tuple[str, float]]:
        """Return material and peak (0..1) of the impacts that begin with the next block."""
        return [
            (voice.key[0], float(np.abs(voice.source).max()))
            for hand in self._hands
            for voice in hand.impacts()
            if voice.at == 0 and isinstance(voice.source, np.ndarray)
        ]

    def apply(self, command: Command) -> None:
        """Apply a command from the next block on."""
        numbers = (command.motion.speed_mps, command.motion.force_n, command.gain)
        if not all(map(math.isfinite, numbers)):
            self.scrubbed += 1
            return
        hand = self._hands[command.hand]
        hand.expires_at = command.expires_at
        hand.hum = command.hum
        if command.material not in self._table:
            hand.wanted = hand.pressed = None
            return
        hand.pressed = command if self._yields(command) else None
        if command.onset and command.interaction != "swing":
            self._strike(hand, command)
        is_held = command.onset or command.interaction in IMPACTS
        starts_texture = command.interaction in TEXTURES or not is_held
        hand.wanted = command if starts_texture else None

    def release(self, hand: int) -> None:
        """Fade one hand."""
        self._hands[hand].rest()

    def rest(self) -> None:
        """Fade everything."""
        for hand in self._hands:
            hand.rest()

    def render(self, count: int, now: float) -> NDArray[np.float32]:
        """Next `count` samples, (count,) float32 in [-1, 1]; `now` sounds DELAY_S into them."""
        wave = np.zeros(count, np.float32)
        if self.is_silent:  # as most blocks of a day are; nobody hears a gain that changes at once
            self._gain = self.gain
            self.level = 0.0
            return wave
        for begin in range(0, count, _CHUNK):
            part = wave[begin : begin + _CHUNK]
            self._mix_into(part, now + begin / self._rate_hz)
        self.level = math.sqrt(float(np.dot(wave, wave)) / count) if count else 0.0
        return wave

    def _mix_into(self, part: NDArray[np.float32], now: float) -> None:
        for hand in self._hands:
            if not hand.expires_at >= now:
                hand.rest()
            self._follow(hand)
            self._press(hand)
            self._hum(hand)
            for voice in hand.voices:
                block = voice.render(part.size, self._step)
                if math.isfinite(float(np.dot(block, block))):
                    part += block
                else:
                    self.scrubbed += 1
                    voice.ended = True
                    hand.wanted = hand.pressed = None
            hand.voices = [voice for voice in hand.voices if not voice.ended]
        if self._gain != self.gain:
            gains = ramp(self._gain, self.gain, part.size, self._step)
            self._gain = float(gains[-1])
            part *= gains
        elif self._gain != 1.0:
            part *= np.float32(self._gain)
        self._limiter.apply(part)

    def _strike(self, hand: _Hand, command: Command) -> None:
        impacts = hand.impacts()
        if len(impacts) >= _MAX_IMPACTS:
            self.dropped += 1
            return
        ringing = [voice for voice in impacts if voice.aim > 0.0]
        if len(ringing) >= _MAX_RINGING:
            ringing[0].aim = 0.0
        kind = command.interaction if command.interaction in IMPACTS else "tap"
        key = str(command.material), kind
        wave = self._impact(key, command)
        gain = min(command.gain, 1.0)
        hand.voices.append(Voice(wave, command.motion, key, gain=gain, aim=gain))

    def _impact(self, key: tuple[str, str], command: Command) -> NDArray[np.float32]:
        pattern = self._patterns.get(key)
        if pattern is not None:
            return pattern.impact(command.motion)
        facts = self._table[key[0]].vibration
        return impact(facts, key[1], command.motion, command.seed, self._playback)

    def _follow(self, hand: _Hand) -> None:
        """Cross-fade the hand's textures towards the wanted one, never more than a few at once."""
        wanted = hand.wanted
        textures = hand.textures()
        key = None if wanted is None else _texture_key(wanted)
        gain = 0.0 if wanted is None else min(wanted.gain, 1.0)
        fitting = None
        for voice in textures:
            voice.aim = 0.0
            if wanted and (voice.key, voice.thickness_m) == (key, wanted.thickness_m):
                fitting = voice
                voice.motion = wanted.motion
                voice.aim = gain
        if wanted is None or key is None or fitting is not None:
            return
        if len(textures) <= _MAX_FADING_TEXTURES:
            source = self._texture(key, wanted)
            thickness_m = wanted.thickness_m
            voice = Voice(source, wanted.motion, key, 0.0, gain, thickness_m=thickness_m)
            hand.voices.append(voice)

    def _yields(self, command: Command) -> bool:
        """Whether this presses what gives way; a recorded press is played as it was recorded."""
        material, kind = str(command.material), command.interaction
        if kind != "press" or (material, kind) in self._patterns:
            return False
        return math.isfinite(self._table[material].vibration.stiffness)

    def _press(self, hand: _Hand) -> None:
        """Let what is pressed give way as the newest command has it; another thing, anew."""
        yielding = [voice for voice in hand.voices if isinstance(voice.source, Grains)]
        for voice in yielding:
            voice.aim = 0.0
        if hand.pressed is None:
            return
        key = str(hand.pressed.material), "grains"
        fitting = next((voice for voice in yielding if voice.key == key), None)
        gain = min(hand.pressed.gain, 1.0)
        if fitting is None:
            facts = self._table[key[0]].vibration
            source = Grains(facts, hand.pressed.seed, self._playback)
            fitting = Voice(source, hand.pressed.motion, key, gain)
            hand.voices.append(fitting)
        fitting.motion = hand.pressed.motion
        fitting.aim = gain

    def _hum(self, hand: _Hand) -> None:
        """Let the hand's hum go on, begin or end as the newest command has it."""
        humming = [voice for voice in hand.voices if isinstance(voice.source, Tone)]
        for voice in humming:
            voice.aim = 0.0 if hand.hum is None else hand.hum.level
            if hand.hum is not None and isinstance(voice.source, Tone):
                voice.source.hum = hand.hum
        if hand.hum is not None and not humming:
            tone = Tone(hand.hum, self._playback)
            level = hand.hum.level
            hand.voices.append(Voice(tone, _STILL, ("", "hum"), gain=0.0, aim=level))

    def _texture(self, key: tuple[str, str], wanted: Command) -> Texture | PatternTexture:
        pattern = self._patterns.get(key)
        if pattern is not None:
            return PatternTexture(pattern, self._rate_hz)
        facts = self._table[key[0]].vibration
        return Texture(facts, key[1], wanted.seed, self._playback, wanted.thickness_m)


@dataclass(slots=True)
class _Hand:
    voices: list[Voice] = field(default_factory=list)
    wanted: Command | None = None  # the texture to feel, when there is one
    pressed: Command | None = None  # the press to feel, if what is pressed gives way
    hum: Hum | None = None
    expires_at: float = -math.inf

    def fork(self) -> _Hand:
        return replace(self, voices=[voice.fork() for voice in self.voices])

    def rest(self) -> None:
        self.wanted = self.pressed = self.hum = None
        self.expires_at = -math.inf
        self.voices = [it for it in self.voices if it.at or it.key[1] not in IMPACTS]
        for voice in self.voices:
            voice.aim = 0.0

    def impacts(self) -> list[Voice]:
        return [voice for voice in self.voices if voice.key[1] in IMPACTS]

    def textures(self) -> list[Voice]:
        return [voice for voice in self.voices if voice.key[1] in TEXTURES]


class Limiter:
    """Keeps a wave of blocks within CEILING; its state is what the next blocks need of the last."""

    def __init__(self, rate_hz: int) -> None:
        self.delay = round(DELAY_S * rate_hz)
        self._fall = math.exp(-1.0 / (RELEASE_S * rate_hz))
        window = np.sin(np.pi * np.arange(1, self.delay + 2) / (self.delay + 2))
        self._window = window / window.sum()
        self._waiting = np.zeros(self.delay, np.float32)
        self._reductions = np.zeros(2 * self.delay)

    def fork(self) -> Limiter:
        """Return a copy that goes its own way."""
        return copy.copy(self)

    @property
    def is_empty(self) -> bool:
        """Whether nothing waits to come out."""
        return not self._waiting.any()

    def clear(self) -> None:
        """Forget what waits."""
        self._waiting = np.zeros_like(self._waiting)
        self._reductions = np.zeros_like(self._reductions)

    def apply(self, part: NDArray[np.float32]) -> None:
        """Replace (N,) by the N samples that come out, each `delay` samples after it went in."""
        if part.size == 0:
            return
        line = np.concatenate((self._waiting, part))
        self._waiting = line[part.size :]
        part[:] = line[: part.size]
        known = self._reductions
        size = np.abs(line[self.delay :])
        if float(size.max()) <= CEILING and not known.any():
            return
        wanted = np.concatenate((known, self._release(size, float(known[-1]))))
        self._reductions = wanted[-known.size :]
        if float(self._reductions.max()) < _NEGLIGIBLE:
            self._reductions = np.zeros_like(known)
        highest = np.lib.stride_tricks.sliding_window_view(wanted, self.delay + 1).max(axis=1)
        part *= (1.0 - np.convolve(highest, self._window, "valid")).astype(np.float32)

    def _release(self, size: _Floats, before: float) -> _Floats:
        """Reduction that each sample of this size (N,) needs, or what is left of earlier ones."""
        needed = 1.0 - CEILING / np.maximum(size.astype(np.float64), CEILING)
        fallen = self._fall ** np.arange(1.0, size.size + 1.0)
        return np.asarray(fallen * np.maximum(np.maximum.accumulate(needed / fallen), before))


def _texture_key(command: Command) -> tuple[str, str]:
    return str(
        command.material
    ), command.interaction if command.interaction in TEXTURES else "slide"


def _fill_caches(materials: Iterable[Material], playback: Playback) -> None:
    """Fill the caches of these materials, so that no first touch pays for them."""
    for material in materials:
        for kind in IMPACTS:
            impact(material.vibration, kind, Motion(1.0, 1.0), 0, playback)
        for kind in TEXTURES:
            Texture(material.vibration, kind, 0, playback)
