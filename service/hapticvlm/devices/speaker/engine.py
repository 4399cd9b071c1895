"""What the engine process plays: its settings, and blocks rendered from the ring's commands.

`fill` is all that an audio callback calls; who calls it is not known here. One palm speaker gets
both hands mixed. An output with a channel for each hand gets them apart: two mixers, each of which
is given the orders of one hand.
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
from hapticvlm.rendering.vibration.equaliser import NOMINAL, Correction, Playback
from hapticvlm.rendering.vibration.patterns import Pattern
from hapticvlm.rendering.vibration.vibration import RATE_HZ
from hapticvlm.rendering.vibration.voices import Command, Voices

FADE_S = 0.05
REPORTED_SILENCE_S = 0.02  # of silence are reported at once


@dataclass(frozen=True, slots=True)
class AudioSettings:
    """How the engine plays: `output` is "simulated", "default", "jack" or part of a name.

    `level` (0..1) is the most of full scale that reaches the output, whatever gain a scene sets.
    `materials` are those it can render, in the order in which the ring counts them; `patterns` are
    recordings that stand in for some of them, `correction` is what a measured speaker needs.
    `channels` are those of the hands, None where both share one speaker.
    """

    output: str = "simulated"
    block: int = 128
    wav: Path | None = None
    realtime: bool = True
    gain: float = 1.0
    level: float = 1.0
    materials: tuple[Material, ...] = tuple(MATERIALS.values())
    patterns: tuple[Pattern, ...] = ()
    correction: Correction = NOMINAL.correction
    channels: Channels | None = None

    @property
    def columns(self) -> int:
        """Of what is rendered: one for both hands, or one for each."""
        return 1 if self.channels is None else 2

    def voices(self) -> tuple[Voices, ...]:
        """Make the mixer of both hands, or one for each hand."""
        table = {material.name: material for material in self.materials}
        playback = Playback(correction=self.correction)
        return tuple(
            Voices(self.gain, table, playback, self.patterns, fills_caches=number == 0)
            for number in range(self.columns)
        )


class Engine:
    """Turns ring commands into blocks; `fill` is all the audio callback calls."""

    def __init__(self, ring: Ring, settings: AudioSettings = AudioSettings()) -> None:
        self._ring = ring
        self._mixers = settings.voices()
        self._is_leaving = False
        # A restarted engine begins behind all that was ever commanded: a touch of a second ago must
        # not be played now.
        self._newest = ring.newest
        self._rested = ring.newest
        self._lost = 0
        self._samples = 0
        self._is_idle = False
        self._seen_numbers = (-1, -1)
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
        """Return the next samples, float32 within [-1, 1]: (count,), or a column a hand."""
        # This runs in the audio system's own thread, which must be done before the output runs dry.
        # So nothing here waits: no lock, no file, no allocation that grows. Everything it knows
        # comes out of the ring, and what it says goes back into it.
        #
        # An engine plays silence for most of a day, 375 blocks a second, and carrying out nothing,
        # mixing nothing and reporting it costs as much as a hand. So once all that was ordered is
        # done and nothing sounds, it looks at two numbers and hands out the same zeros. It wakes
        # within the block in which an order comes, as if it had never slept.
        if self._is_idle and self._ring.numbers == self._seen_numbers:
            return self._sleep(count)
        now = time.monotonic()
        self._report_silence(now)
        self._seen_numbers = self._ring.numbers
        for number, written_at, order in self._ring.take(self._newest):
            self._newest = number
            if order is None:
                self._lost += 1
                continue
            if not self._is_leaving:
                self._apply(order)
            if isinstance(order, RestAll):
                self._rested = number
            self._ring.note_delay(number, now - written_at)
        # Gain and "rest everything" must hold even if the orders that said so were overwritten in a
        # full ring: they stand beside it, and are compared every block.
        self._follow_persistent()
        block = self._bounded(self._render(count, now))
        self._samples += count
        if self.on_block is not None:
            self.on_block(block)
        mono = block if block.ndim == 1 else np.clip(block.sum(axis=1), -1.0, 1.0)
        self._ring.report(self._status(now), mono)
        is_done = (self._newest, self._applied_state) == self._seen_numbers
        self._is_idle = is_done and not self._level and all(it.is_silent for it in self._mixers)
        return block

    def _render(self, count: int, now: float) -> NDArray[np.float32]:
        blocks = [mixer.render(count, now) for mixer in self._mixers]
        return blocks[0] if len(blocks) == 1 else np.stack(blocks, axis=1)

    @property
    def _level(self) -> float:
        """Rms of the last block, of both hands together."""
        return math.hypot(*(mixer.level for mixer in self._mixers))

    def _mixer(self, hand: int) -> Voices:
        return self._mixers[hand % len(self._mixers)]

    def _rest(self) -> None:
        for mixer in self._mixers:
            mixer.rest()

    def _sleep(self, count: int) -> NDArray[np.float32]:
        """Return `count` zeros, the same each time, and report now and then."""
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
        """Report without playing: the engine is well although nothing asks it for samples."""
        self._ring.report(self._status(time.monotonic()), np.empty(0, np.float32))

    def rest_unplayed(self) -> None:
        """End what sounds while nothing plays, and pass over what is commanded meanwhile."""
        self._seen_numbers = self._ring.numbers
        for number, _, _ in self._ring.take(self._newest):
            self._newest = number
        self._follow_persistent()
        self._rest()
        self._render(round(FADE_S * RATE_HZ), time.monotonic())

    def fade_out(self) -> None:
        """Fade everything and carry out nothing from now on."""
        self._is_leaving = True
        self._rest()

    def _bounded(self, block: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return the block at the output's level; one that is not finite is silence, counted."""
        if not math.isfinite(float(np.vdot(block, block))):
            self._scrubbed += 1
            return np.zeros_like(block)
        block = block if self.level == 1.0 else block * np.float32(self.level)
        return np.clip(block, np.float32(-1.0), np.float32(1.0))

    def _follow_persistent(self) -> None:
        """Apply the gain, and rest if the order to do so was lost with others."""
        if self._applied_state == self._seen_numbers[1]:
            return
        state = self._ring.persistent()
        if state is None:
            return  # half written: it is looked for again in the next block
        for mixer in self._mixers:
            mixer.gain = state.gain
        if self._rested < state.rested:
            if state.rested > self._newest:
                return  # the order itself is still to come
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
