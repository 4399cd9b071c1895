"""Mixes the impacts and textures of both hands into blocks, and limits the mix. Pure.

Time and commands are arguments; this module knows neither a sound card nor a scene. A hand sounds
only while its lease runs: every command sets the end of the lease, and after it the hand fades by
itself. Every change of a voice is a linear fade of FADE_S, so a sound that ends is silent within
20 ms at any block size.

The mix leaves through a limiter with look-ahead, which turns down whatever would leave [-1, 1].
Clipping the peaks sample by sample would put energy above the band of touch. So the sound is
delayed by DELAY_S, which lets the limiter know each peak DELAY_S before it comes out:

1. Each sample needs a reduction that brings it to CEILING, and that reduction decays over
   RELEASE_S.
2. The largest reduction of the last DELAY_S is held. It begins when the peak goes in and lasts
   until the peak comes out.
3. A moving average over DELAY_S smooths it. It is complete when the peak comes out, and it changes
   too slowly to widen the band.

A signal that stays within CEILING passes unchanged, only later.
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

FADE_S = 0.012  # with the delay of one chunk still well within the 20 ms after a lease
DELAY_S = 1.0 / 600.0  # 80 samples at 48 kHz; 5.5 ms of a tap are noticed (physics.md 4.4)
RELEASE_S = 0.1  # our choice: longer than a period of 20 Hz, so the gain does not follow a wave
CEILING = 0.99
_NEGLIGIBLE = 1e-6  # a smaller reduction has ended
CHUNK = 256  # samples, so that a long block cannot hide the end of a lease
# Bounds per hand, for the cost of a block.
MAX_RINGING = 4
MAX_IMPACTS = 8
MAX_FADING_TEXTURES = 2

_Floats = NDArray[np.float64]
_STILL = Motion(0.0, 0.0)


class Command(msgspec.Struct, frozen=True, gc=False):
    """The motion of one hand now, with the lease of its vibration.

    `hand` is 0 for the left and 1 for the right one. `material` is None when there is nothing to
    feel. `onset` starts an impact. The lease ends at `expires_at`, in s of the clock of `render`.
    `gain` (0..1) is below 1 for a material that is not sure. `thickness_m` is that of a swung
    object; None takes the usual one of its material. `hum` is what is felt of a thing that vibrates
    by itself.
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
    """The mixer of both hands: applies commands, renders blocks, counts what it drops.

    `gain` (0..1) may be changed at any time. `table` holds the materials that can be rendered,
    `patterns` the recordings that replace some. `fills_caches` computes the tables of all materials
    at once, so that no first touch has to.
    """

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
        self.scrubbed = 0  # voices and commands dropped because they were not finite
        self.dropped = 0  # impacts dropped because too many were sounding
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
        """Return an independent copy in the same state: it renders the future without commands."""
        forked = copy.copy(self)
        forked._hands = (self._hands[0].fork(), self._hands[1].fork())
        forked._limiter = self._limiter.fork()
        return forked

    def silence(self) -> None:
        """Drop everything at once, without a fade; for a mixer that is not played."""
        for hand in self._hands:
            hand.rest()
            hand.voices.clear()
        self._limiter.clear()

    @property
    def is_silent(self) -> bool:
        """Whether nothing sounds and nothing is about to."""
        is_idle = not any(
            hand.voices or hand.texture or hand.press or hand.hum for hand in self._hands
        )
        return is_idle and self._limiter.is_empty

    def beginning(self) -> list[tuple[str, float]]:
        """Return the material and the peak (0..1) of each impact that begins in the next block."""
        return [
            (voice.key[0], float(np.abs(voice.source).max()))
            for hand in self._hands
            for voice in hand.impacts()
            if voice.at == 0 and isinstance(voice.source, np.ndarray)
        ]

    def apply(self, command: Command) -> None:
        """Apply a command from the next block on; one with NaN or inf is dropped and counted."""
        numbers = (command.motion.speed_mps, command.motion.force_n, command.gain)
        if not all(map(math.isfinite, numbers)):
            self.scrubbed += 1
            return
        hand = self._hands[command.hand]
        hand.expires_at = command.expires_at
        hand.hum = command.hum
        if command.material not in self._table:
            hand.texture = hand.press = None
            return
        hand.press = command if self._yields(command) else None
        if command.onset and command.interaction != "swing":
            self._strike(hand, command)
        is_held = command.onset or command.interaction in IMPACTS
        starts_texture = command.interaction in TEXTURES or not is_held
        hand.texture = command if starts_texture else None

    def release(self, hand: int) -> None:
        """Fade one hand."""
        self._hands[hand].rest()

    def rest(self) -> None:
        """Fade everything."""
        for hand in self._hands:
            hand.rest()

    def render(self, count: int, now: float) -> NDArray[np.float32]:
        """Next `count` samples, (count,) float32 in [-1, 1].

        `now` is the time in s of the first sample, which comes out of the limiter DELAY_S later.
        """
        wave = np.zeros(count, np.float32)
        if self.is_silent:  # in silence the gain may change at once
            self._gain = self.gain
            self.level = 0.0
            return wave
        for begin in range(0, count, CHUNK):
            part = wave[begin : begin + CHUNK]
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
                # NaN and inf make the sum of squares non-finite. Only the voice that produced them
                # is dropped, and the others continue.
                if math.isfinite(float(np.dot(block, block))):
                    part += block
                else:
                    self.scrubbed += 1
                    voice.ended = True
                    hand.texture = hand.press = None
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
        if len(impacts) >= MAX_IMPACTS:
            self.dropped += 1
            return
        ringing = [voice for voice in impacts if voice.aim > 0.0]
        if len(ringing) >= MAX_RINGING:
            ringing[0].aim = 0.0
        kind = command.interaction if command.interaction in IMPACTS else "tap"
        key = str(command.material), kind
        wave = self._impact(key, command)
        gain = min(command.gain, 1.0)
        hand.voices.append(Voice(wave, command.motion, key, gain=gain, aim=gain))

    def _impact(self, key: tuple[str, str], command: Command) -> NDArray[np.float32]:
        pattern = self._patterns.get(key)
        if pattern is not None:
            return pattern.impact(command.motion, self._playback)
        facts = self._table[key[0]].vibration
        return impact(facts, key[1], command.motion, command.seed, self._playback)

    def _follow(self, hand: _Hand) -> None:
        """Cross-fade the hand's textures towards the newest command's, a bounded number at once."""
        command = hand.texture
        textures = hand.textures()
        key = None if command is None else _texture_key(command)
        gain = 0.0 if command is None else min(command.gain, 1.0)
        current = None
        for voice in textures:
            voice.aim = 0.0
            if command and (voice.key, voice.thickness_m) == (key, command.thickness_m):
                current = voice
                voice.motion = command.motion
                voice.aim = gain
        if command is None or key is None or current is not None:
            return
        if len(textures) <= MAX_FADING_TEXTURES:
            source = self._texture(key, command)
            thickness_m = command.thickness_m
            voice = Voice(source, command.motion, key, 0.0, gain, thickness_m=thickness_m)
            hand.voices.append(voice)

    def _yields(self, command: Command) -> bool:
        """Whether this is a press on something that yields; a recorded press is only played."""
        material, kind = str(command.material), command.interaction
        if kind != "press" or (material, kind) in self._patterns:
            return False
        return math.isfinite(self._table[material].vibration.stiffness)

    def _press(self, hand: _Hand) -> None:
        """Continue the press of the newest command, or start one on another material."""
        yielding = [voice for voice in hand.voices if isinstance(voice.source, Grains)]
        for voice in yielding:
            voice.aim = 0.0
        if hand.press is None:
            return
        key = str(hand.press.material), "grains"
        current = next((voice for voice in yielding if voice.key == key), None)
        gain = min(hand.press.gain, 1.0)
        if current is None:
            facts = self._table[key[0]].vibration
            source = Grains(facts, hand.press.seed, self._playback)
            current = Voice(source, hand.press.motion, key, gain)
            hand.voices.append(current)
        current.motion = hand.press.motion
        current.aim = gain

    def _hum(self, hand: _Hand) -> None:
        """Start, continue or end the hand's hum as the newest command says."""
        humming = [voice for voice in hand.voices if isinstance(voice.source, Tone)]
        for voice in humming:
            voice.aim = 0.0 if hand.hum is None else hand.hum.level
            if hand.hum is not None and isinstance(voice.source, Tone):
                voice.source.hum = hand.hum
        if hand.hum is not None and not humming:
            tone = Tone(hand.hum, self._playback)
            level = hand.hum.level
            hand.voices.append(Voice(tone, _STILL, ("", "hum"), gain=0.0, aim=level))

    def _texture(self, key: tuple[str, str], command: Command) -> Texture | PatternTexture:
        pattern = self._patterns.get(key)
        if pattern is not None:
            return PatternTexture(pattern, self._rate_hz)
        facts = self._table[key[0]].vibration
        return Texture(facts, key[1], command.seed, self._playback, command.thickness_m)


@dataclass(slots=True)
class _Hand:
    voices: list[Voice] = field(default_factory=list)
    texture: Command | None = None  # command of the texture to play
    press: Command | None = None  # command of the press to play, on something that yields
    hum: Hum | None = None
    expires_at: float = -math.inf

    def fork(self) -> _Hand:
        return replace(self, voices=[voice.fork() for voice in self.voices])

    def rest(self) -> None:
        self.texture = self.press = self.hum = None
        self.expires_at = -math.inf
        # An impact that has not begun yet (`at` is 0) is dropped; everything else fades.
        self.voices = [voice for voice in self.voices if voice.at or voice.key[1] not in IMPACTS]
        for voice in self.voices:
            voice.aim = 0.0

    def impacts(self) -> list[Voice]:
        return [voice for voice in self.voices if voice.key[1] in IMPACTS]

    def textures(self) -> list[Voice]:
        return [voice for voice in self.voices if voice.key[1] in TEXTURES]


class Limiter:
    """Keeps a sequence of blocks within CEILING, as explained at the head of the file.

    Its state is the end of the last block: the samples that are still delayed, and the reductions
    that they need.
    """

    def __init__(self, rate_hz: int) -> None:
        self.delay = round(DELAY_S * rate_hz)
        self._fall = math.exp(-1.0 / (RELEASE_S * rate_hz))
        window = np.sin(np.pi * np.arange(1, self.delay + 2) / (self.delay + 2))
        self._window = window / window.sum()
        self._delayed = np.zeros(self.delay, np.float32)
        self._reductions = np.zeros(2 * self.delay)

    def fork(self) -> Limiter:
        """Return an independent copy in the same state."""
        return copy.copy(self)

    @property
    def is_empty(self) -> bool:
        """Whether only zeros are still to come out."""
        return not self._delayed.any()

    def clear(self) -> None:
        """Drop the delayed samples."""
        self._delayed = np.zeros_like(self._delayed)
        self._reductions = np.zeros_like(self._reductions)

    def apply(self, part: NDArray[np.float32]) -> None:
        """Replace `part` (N,) in place by the N samples that come out, `delay` samples later."""
        if part.size == 0:
            return
        line = np.concatenate((self._delayed, part))
        self._delayed = line[part.size :]
        part[:] = line[: part.size]
        earlier = self._reductions
        size = np.abs(line[self.delay :])
        if float(size.max()) <= CEILING and not earlier.any():
            return
        reductions = np.concatenate((earlier, self._release(size, float(earlier[-1]))))
        self._reductions = reductions[-earlier.size :]
        if float(self._reductions.max()) < _NEGLIGIBLE:
            self._reductions = np.zeros_like(earlier)
        highest = np.lib.stride_tricks.sliding_window_view(reductions, self.delay + 1).max(axis=1)
        part *= (1.0 - np.convolve(highest, self._window, "valid")).astype(np.float32)

    def _release(self, size: _Floats, before: float) -> _Floats:
        """Return the reduction (N,) for samples of this size (N,), after a reduction of `before`.

        Each is the larger of what its sample needs and what is left of the earlier ones.
        """
        # An exponential decay of the running maximum, without a loop: divide by the decay, take the
        # running maximum, multiply by the decay again.
        needed = 1.0 - CEILING / np.maximum(size.astype(np.float64), CEILING)
        fallen = self._fall ** np.arange(1.0, size.size + 1.0)
        return np.asarray(fallen * np.maximum(np.maximum.accumulate(needed / fallen), before))


def _texture_key(command: Command) -> tuple[str, str]:
    return str(
        command.material
    ), command.interaction if command.interaction in TEXTURES else "slide"


def _fill_caches(materials: Iterable[Material], playback: Playback) -> None:
    """Compute the tables of these materials, so that no first touch has to."""
    for material in materials:
        for kind in IMPACTS:
            impact(material.vibration, kind, Motion(1.0, 1.0), 0, playback)
        for kind in TEXTURES:
            Texture(material.vibration, kind, 0, playback)
