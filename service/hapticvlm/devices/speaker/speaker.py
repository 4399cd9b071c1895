"""The gateway's end of the palm speaker: starts the audio engine, writes commands, watches it.

A dead engine is restarted and reported; meanwhile commands go into a ring nobody reads, and the new
engine starts behind them, so nothing late is played. It starts with the gain the old one had. An
output that is unplugged is reported when it goes; the engine lives on and plays when it is back. An
engine is called silent only by a watch that was awake itself: a machine that slept, or was too busy
to run either, has no dead engine.
"""

from __future__ import annotations

import dataclasses
import logging
import time
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hapticvlm.devices.errors import DeviceError
from hapticvlm.devices.faults import SPEAKER_GONE
from hapticvlm.devices.speaker.audio import run_engine
from hapticvlm.devices.speaker.engine import AudioSettings
from hapticvlm.devices.speaker.ring import (
    SAMPLES,
    EngineStatus,
    PersistentState,
    Release,
    RestAll,
    Ring,
)
from hapticvlm.processes.supervised import Child, ChildError
from hapticvlm.rendering.vibration.voices import Command

logger = logging.getLogger(__name__)

BEAT_TIMEOUT_S = 1.0
MAX_WATCH_GAP_S = 0.25  # the gateway watches ten times a second
FADE_AND_CLOSE_S = 5.0
WINDOW_SAMPLES = 128  # samples


class Speaker:
    """One audio engine process and its ring; start it, then command it."""

    def __init__(self, settings: AudioSettings) -> None:
        self._settings = settings
        self._ring = Ring.create([material.name for material in settings.materials])
        self._underruns_before = 0
        self._rested = 0
        self._had_output = True
        self._measured_until = 0
        self._watched_at = float("-inf")
        self._awake_since = float("-inf")
        self._child = Child("audio engine", run_engine, self._arguments, self._begin)
        self.name = settings.output

    @property
    def settings(self) -> AudioSettings:
        """How the engine plays now."""
        return self._settings

    @property
    def simulated(self) -> bool:
        """Whether nothing is really played."""
        return self._settings.output == "simulated"

    @property
    def pid(self) -> int | None:
        """Process id of the engine."""
        return self._child.pid

    @property
    def restarts(self) -> int:
        """How often the engine had to be restarted."""
        return self._child.restarts

    @property
    def plays(self) -> bool:
        """Whether the engine is up and has its output; what is commanded before is not played."""
        return self._child.ready_at is not None and not self._lacks_output

    @property
    def faults(self) -> tuple[str, ...]:
        """Names of what is wrong with the output now."""
        return (SPEAKER_GONE.name,) if self._lacks_output else ()

    def begin(self) -> None:
        """Let the engine start, and do not wait for it; `start` does."""
        self._child.begin()

    def start(self) -> None:
        """Start the engine and wait until it plays; raises DeviceError if it can't."""
        try:
            self._child.start()
        except ChildError as error:
            raise DeviceError(str(error)) from None

    def play(self, command: Command) -> int:
        """Write one command into the ring and return its number; never blocks."""
        return self._ring.put(command, time.monotonic())

    def release(self, hand: int) -> None:
        """Fade one hand."""
        self._ring.put(Release(hand), time.monotonic())

    def rest(self) -> None:
        """Fade everything."""
        # The order to rest goes both ways: through the ring, where it takes its place among the
        # commands, and into the state beside it, which survives a ring that was written over. The
        # number ties them: the engine rests once, and a command behind the order is played.
        self._rested = self._ring.put(RestAll(), time.monotonic())
        self._ring.set_persistent(PersistentState(self._settings.gain, self._rested))

    def set_gain(self, gain: float) -> None:
        """Set the vibration gain (0..1)."""
        self._settings = dataclasses.replace(self._settings, gain=gain)
        self._ring.set_persistent(PersistentState(gain, self._rested))

    @property
    def gain(self) -> float:
        """The vibration gain in force."""
        return self._settings.gain

    def status(self) -> EngineStatus:
        """Return the engine's newest report."""
        return self._ring.status()

    @property
    def underruns(self) -> int:
        """Underruns of this and earlier engines."""
        return self._underruns_before + self._ring.status().underruns

    def delays(self, first: int, last: int) -> NDArray[np.float32]:
        """Return how long commands first..last waited for their block, s."""
        return self._ring.delays(first, last)

    def loudest(self) -> float:
        """Return the rms of the loudest 2.7 ms since this was last called (1 s at most)."""
        since = self._measured_until
        self._measured_until = self._ring.status().samples
        played = self._ring.waveform(min(max(0, self._measured_until - since), SAMPLES))
        stretches = played[: played.size // WINDOW_SAMPLES * WINDOW_SAMPLES].reshape(
            -1, WINDOW_SAMPLES
        )
        squares = np.einsum("ij,ij->i", stretches, stretches)
        return float(np.sqrt(np.max(squares, initial=0.0) / WINDOW_SAMPLES))

    def waveform(self, count: int) -> NDArray[np.float32]:
        """Return the newest samples played."""
        return self._ring.waveform(count)

    def waveform_until(self, count: int) -> tuple[int, NDArray[np.float32]]:
        """Return how many samples were ever played, and the newest of them."""
        return self._ring.waveform_until(count)

    def supervise(self, now: float) -> str | None:
        """Restart a dead or silent engine; return what happened to it, or to its output."""
        # Whoever watches may itself have slept (a laptop's lid, a machine too busy to run us). Then
        # the engine's last beat is old although nothing is wrong with it. So an engine counts as
        # silent only after BEAT_TIMEOUT_S of a watch that was awake all the time.
        if now - self._watched_at > MAX_WATCH_GAP_S:
            self._awake_since = now
        self._watched_at = now
        alive_at = max(self._ring.status().beat_at, self._child.ready_at or now)
        is_well = now - max(alive_at, self._awake_since) <= BEAT_TIMEOUT_S
        # Read before `supervise`, which may replace the engine: the new one counts from 0, and what
        # the old one had counted must not vanish from the figures.
        underruns = self.underruns
        trouble = self._child.supervise(now, is_well=is_well)
        if trouble is None:
            return self._watch_output()
        self._underruns_before = underruns
        return f"{trouble}; vibration rests meanwhile"

    def close(self) -> None:
        """Fade out, stop the engine and wait for it."""
        self._child.close(FADE_AND_CLOSE_S)

    @property
    def _lacks_output(self) -> bool:
        """Whether the engine reports that its output is gone; one that never beat does not."""
        status = self._ring.status()
        return status.beat_at > 0.0 and not status.has_output

    def _watch_output(self) -> str | None:
        """Return that the output went, if it has just gone."""
        had_output = self._had_output
        has_output = not self._lacks_output
        self._had_output = has_output
        if has_output and not had_output:
            logger.warning("the audio output %s is back", self.name)
        if has_output or not had_output:
            return None
        return f"the audio output {self.name} is gone; vibration rests until it is back"

    def _arguments(self) -> tuple[Any, ...]:
        settings = self._settings
        wav = self._settings.wav
        if wav is not None and self._child.restarts:  # what the engine before wrote stays
            again = wav.with_stem(f"{wav.stem}-{self._child.restarts + 1}")
            settings = dataclasses.replace(settings, wav=again)
        return self._ring.shared, settings

    def _begin(self, names: tuple[str, ...]) -> None:
        self.name = names[0]
