"""Renders blocks of vibration from the orders in the ring.

An audio callback calls `Engine.fill` and nothing else; this module does not know the output behind
the callback. A palm speaker gets the mix of both hands from one mixer. An output with a channel for
each hand gets two mixers, and each receives the orders of one hand.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from hapticvlm.devices.speaker.channels import Channels
from hapticvlm.devices.speaker.ring import EngineStatus, Order, Release, RestAll, Ring
from hapticvlm.materials import MATERIALS, Material
from hapticvlm.rendering.vibration.equaliser import NOMINAL, Playback
from hapticvlm.rendering.vibration.patterns import Pattern
from hapticvlm.rendering.vibration.sound_voice import SoundBlocks
from hapticvlm.rendering.vibration.vibration import RATE_HZ, VOICES
from hapticvlm.rendering.vibration.voices import Command, Voices

FADE_S = 0.05
REPORTED_SILENCE_S = 0.02  # silence is reported in pieces of this length


@dataclass(frozen=True, slots=True)
class AudioSettings:
    """Settings of the engine, which do not change while it runs.

    `output` is "simulated", "default", "jack" or a part of an output's name, `block` the number of
    samples per callback. `gain` (0..1) is the scene's, which it may change later; `level` (0..1) is
    the share of full scale that reaches the output at most, whatever the gain. `materials` are
    those that can be rendered, in the order in which the ring numbers them. `patterns` are
    recordings that replace some of them, and `playback` has what is known of speaker and hand.
    `channels` maps the hands to channels; None means that both share one speaker. `voice` is "true"
    for a palm speaker, or "sound" for one that people hear; pages receive the true one anyway.
    """

    output: str = "simulated"
    block: int = 128
    wav: Path | None = None
    realtime: bool = True
    gain: float = 1.0
    level: float = 1.0
    materials: tuple[Material, ...] = tuple(MATERIALS.values())
    patterns: tuple[Pattern, ...] = ()
    playback: Playback = NOMINAL
    channels: Channels | None = None
    voice: str = VOICES[0]

    @property
    def columns(self) -> int:
        """Number of columns of a block: one for both hands, or one for each hand."""
        return 1 if self.channels is None else 2

    def voices(self) -> tuple[Voices, ...]:
        """Create one mixer for both hands, or one for each hand."""
        table = {material.name: material for material in self.materials}
        return tuple(
            Voices(self.gain, table, self.playback, self.patterns, fills_caches=number == 0)
            for number in range(self.columns)
        )


class Engine:
    """Turns the orders in the ring into blocks; the audio callback calls `fill` and nothing else.

    One thread at a time uses an engine: the audio thread while an output is open, and the thread
    that watches the output while none is (`beat`, `rest_unplayed`).
    """

    def __init__(self, ring: Ring, settings: AudioSettings = AudioSettings()) -> None:
        self._ring = ring
        self._mixers = settings.voices()
        self._sound = SoundBlocks() if settings.voice == "sound" else None
        self._is_leaving = False
        # A restarted engine begins after the newest order, because a touch from a second ago must
        # not be played now.
        self._newest = ring.newest
        self._rested = ring.newest
        self._lost = 0
        self._samples = 0
        self._is_idle = False
        self._seen_numbers = ring.numbers
        self._applied_state = 0
        self._silence = np.zeros(0, np.float32)
        self._unreported = 0
        self._scrubbed = 0
        self.level = 1.0
        self.underruns = 0
        self.realtime = False
        self.has_output = True
        self.on_block: Callable[[NDArray[np.float32]], None] | None = None

    def fill(self, count: int) -> NDArray[np.float32]:
        """Return the next samples, float32 in [-1, 1]: (count,), or (count, 2), a column a hand."""
        # This runs in the audio system's own thread, which must finish before the output runs dry.
        # So nothing here waits: it takes no lock, opens no file and makes no allocation that grows.
        # It reads orders from the ring and writes its status to the ring, and both never block.
        #
        # For most of a day the engine plays silence, 375 blocks a second, and the whole cycle of
        # reading, mixing and reporting nothing would cost as much as a hand. So when every order is
        # carried out and nothing sounds, it compares two numbers and returns the same zeros again.
        # It wakes within the block in which an order arrives, so this adds no delay.
        if self._is_idle and self._ring.numbers == self._seen_numbers:
            return self._sleep(count)
        now = time.monotonic()
        self._report_silence(now)
        self._seen_numbers = self._ring.numbers
        for number, written_at, order in self._ring.take(self._newest):
            self._newest = number
            if order is None:  # it was overwritten before the engine read it
                self._lost += 1
                continue
            if not self._is_leaving:
                self._apply(order)
            if isinstance(order, RestAll):
                self._rested = number
            self._ring.note_delay(number, now - written_at)
        # The gain and "rest everything" must take effect even if their orders were overwritten in a
        # full ring. So they are also kept beside the ring, and compared in every block.
        self._follow_persistent()
        block = self._bounded(self._render(count, now))
        self._samples += count
        played = block if self._sound is None else self._as_sound(self._sound, block)
        if self.on_block is not None:
            self.on_block(played)
        mono = block if block.ndim == 1 else np.clip(block.sum(axis=1), -1.0, 1.0)
        self._ring.report(self._status(now), mono)
        is_done = (self._newest, self._applied_state) == self._seen_numbers
        self._is_idle = (
            is_done
            and not self._level
            and all(mixer.is_silent for mixer in self._mixers)
            and (self._sound is None or self._sound.is_silent)
        )
        return played

    def _as_sound(self, sound: SoundBlocks, block: NDArray[np.float32]) -> NDArray[np.float32]:
        # The sound voice levels what it gets, so the limit of the output is applied again.
        heard = sound.render(block)
        return heard if self.level == 1.0 else heard * np.float32(self.level)

    def _render(self, count: int, now: float) -> NDArray[np.float32]:
        blocks = [mixer.render(count, now) for mixer in self._mixers]
        return blocks[0] if len(blocks) == 1 else np.stack(blocks, axis=1)

    @property
    def _level(self) -> float:
        """Rms of the last block, both hands together, 0..1."""
        return math.hypot(*(mixer.level for mixer in self._mixers))

    def _mixer(self, hand: int) -> Voices:
        return self._mixers[hand % len(self._mixers)]

    def _rest(self) -> None:
        for mixer in self._mixers:
            mixer.rest()

    def _sleep(self, count: int) -> NDArray[np.float32]:
        """Return `count` zeros, the same array each time, and report every REPORTED_SILENCE_S."""
        if len(self._silence) != count:
            hands = len(self._mixers)
            self._silence = np.zeros(count if hands == 1 else (count, hands), np.float32)
            self._silence.flags.writeable = False
        self._samples += count
        self._unreported += count
        if self.on_block is not None:
            self.on_block(self._silence)
        if self._unreported >= REPORTED_SILENCE_S * RATE_HZ:
            self._report_silence(time.monotonic())
        return self._silence

    def _report_silence(self, now: float) -> None:
        if self._unreported:
            self._ring.report(self._status(now), np.zeros(self._unreported, np.float32))
            self._unreported = 0

    def beat(self) -> None:
        """Report without playing: the engine is alive although no output requests samples."""
        self._ring.report(self._status(time.monotonic()), np.empty(0, np.float32))

    def rest_unplayed(self) -> None:
        """End all sounds while there is no output, and drop the orders that arrive meanwhile."""
        self._seen_numbers = self._ring.numbers
        for number, _, _ in self._ring.take(self._newest):
            self._newest = number
        self._follow_persistent()
        self._rest()
        self._render(round(FADE_S * RATE_HZ), time.monotonic())

    def fade_out(self) -> None:
        """Fade everything and ignore all orders from now on."""
        self._is_leaving = True
        self._rest()

    def _bounded(self, block: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return the block at the output's level; one with NaN or inf becomes silence, counted."""
        if not math.isfinite(float(np.vdot(block, block))):
            self._scrubbed += 1
            return np.zeros_like(block)
        block = block if self.level == 1.0 else block * np.float32(self.level)
        return np.clip(block, np.float32(-1.0), np.float32(1.0))

    def _follow_persistent(self) -> None:
        """Apply the persistent state: the gain, and a rest whose order was lost."""
        if self._applied_state == self._seen_numbers[1]:
            return
        state = self._ring.persistent()
        if state is None:
            return  # it is being written: the next block reads it
        for mixer in self._mixers:
            mixer.gain = state.gain
        if self._rested < state.rested:
            if state.rested > self._newest:
                return  # the order itself is still in the ring
            self._rested = state.rested
            self._rest()
        self._applied_state = self._seen_numbers[1]

    def _apply(self, order: Order) -> None:
        match order:
            case Command():
                self._mixer(order.hand).apply(order)
            case Release():
                self._mixer(order.hand).release(order.hand)
            case RestAll():
                self._rest()

    def _status(self, now: float) -> EngineStatus:
        return EngineStatus(
            beat_at=now,
            level=self._level,
            underruns=self.underruns,
            lost=self._lost,
            scrubbed=sum(mixer.scrubbed for mixer in self._mixers) + self._scrubbed,
            samples=self._samples,
            newest=self._newest,
            realtime=self.realtime,
            has_output=self.has_output,
        )
