"""The gateway's end of the palm speaker: starts the audio engine, writes commands, watches it.

A dead engine is restarted and reported; meanwhile commands go into a ring nobody reads, and the new
engine starts behind them, so nothing late is played.
"""

from __future__ import annotations

import multiprocessing
import time
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess

import numpy as np
from numpy.typing import NDArray

from hapticvlm.devices.audio import AudioSettings, run_engine
from hapticvlm.devices.peltier import DeviceError
from hapticvlm.devices.ring import EngineStatus, Gain, LetGo, RestAll, Ring
from hapticvlm.rendering.voices import Command

START_S = 10.0
SILENT_S = 1.0
RESTART_S = 1.0


class Speaker:
    """One audio engine process and its ring; start it, then command it."""

    def __init__(self, settings: AudioSettings) -> None:
        self._settings = settings
        self._ring = Ring.create()
        self._process: BaseProcess | None = None
        self._control: Connection | None = None
        self._started_at = 0.0
        self._underruns_before = 0
        self._gain = 1.0
        self.name = settings.output
        self.restarts = 0

    @property
    def simulated(self) -> bool:
        """Whether nothing is really played."""
        return self._settings.output == "simulated"

    @property
    def pid(self) -> int | None:
        """Process id of the engine."""
        return self._process.pid if self._process else None

    def start(self) -> None:
        """Start the engine and wait until it plays; raises DeviceError if it can't."""
        self._spawn()
        assert self._control is not None
        if not self._control.poll(START_S):
            self.close()
            raise DeviceError("the audio engine did not start within 10 s")
        answer, text = self._control.recv()
        if answer == "failed":
            self.close()
            raise DeviceError(text)
        self.name = text

    def obey(self, command: Command) -> int:
        """Write one command into the ring and return its number; never blocks."""
        return self._ring.put(command, time.monotonic())

    def let_go(self, hand: int) -> None:
        """Fade one hand."""
        self._ring.put(LetGo(hand), time.monotonic())

    def rest(self) -> None:
        """Fade everything."""
        self._ring.put(RestAll(), time.monotonic())

    def set_gain(self, gain: float) -> None:
        """Set the vibration gain (0..1)."""
        self._gain = gain
        self._ring.put(Gain(gain), time.monotonic())

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

    def waveform(self, count: int) -> NDArray[np.float32]:
        """Return the newest samples played."""
        return self._ring.waveform(count)

    def supervise(self, now: float) -> str | None:
        """Restart a dead or silent engine; return what happened, if anything."""
        process = self._process
        if process is None or now - self._started_at < RESTART_S:
            return None
        silent = now - max(self._ring.status().beat_at, self._started_at) > SILENT_S
        if process.is_alive() and not silent:
            return None
        why = "hung" if process.is_alive() else f"died (exit code {process.exitcode})"
        self._underruns_before = self.underruns
        self._end()
        self._spawn()
        self.restarts += 1
        self._ring.put(Gain(self._gain), time.monotonic())
        return f"the audio engine {why} and was restarted; vibration rested meanwhile"

    def close(self) -> None:
        """Fade out, stop the engine and wait for it."""
        if self._control is not None:
            self._control.close()
        if self._process is not None:
            self._process.join(2.0)
        self._end()

    def _spawn(self) -> None:
        context = multiprocessing.get_context("spawn")
        self._control, theirs = context.Pipe()
        self._process = context.Process(
            target=run_engine,
            args=(self._ring.shared, self._settings, theirs),
            name="hapticvlm audio engine",
            daemon=True,
        )
        self._process.start()
        theirs.close()
        self._started_at = time.monotonic()

    def _end(self) -> None:
        if self._process is not None and self._process.is_alive():
            self._process.kill()
            self._process.join(1.0)
        self._process = self._control = None
