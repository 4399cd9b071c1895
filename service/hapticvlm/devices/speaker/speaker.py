"""Starts the audio engine, writes commands into its ring and supervises it: the gateway's end.

A dead engine is restarted and reported. Until then commands go into a ring that nobody reads, and
the new engine begins after them, so nothing is played late; it starts with the gain of the old one.
An output that is unplugged is reported once; the engine keeps running and plays again when the
output is back.

The engine proves that it is alive by a beat in every status. An engine without a beat for SILENT_S
counts as hung, but only if this process was awake during that time: on a machine that slept, or was
too busy to run either process, the old beat says nothing about the engine.
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
from hapticvlm.devices.speaker.channels import JACK
from hapticvlm.devices.speaker.engine import AudioSettings
from hapticvlm.devices.speaker.output_state import OutputState, OutputWatch, output_state
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

SILENT_S = 1.0  # without a beat until the engine counts as hung
MAX_WATCH_GAP_S = 0.25  # the gateway watches ten times a second; after a longer gap it was asleep
FADE_AND_CLOSE_S = 5.0
WINDOW_SAMPLES = 128  # over which `loudest` takes the rms: 2.7 ms


class Speaker:
    """One audio engine process and its ring; call `start`, then command it.

    Only the gateway's event loop calls it. No method but `start` and `close` blocks.
    """

    def __init__(self, settings: AudioSettings) -> None:
        self._settings = settings
        self._ring = Ring.create([material.name for material in settings.materials])
        self._underruns_before = 0
        self._rested = 0
        self._had_output = True
        self._watch: OutputWatch | None = None
        self._was_silent = False
        self._measured_until = 0
        self._watched_at = float("-inf")
        self._awake_since = float("-inf")
        self._child = Child("audio engine", run_engine, self._arguments, self._begin)
        self.name = settings.output
        self._system_name = ""

    @property
    def settings(self) -> AudioSettings:
        """Settings of the engine, with the gain that is in force."""
        return self._settings

    @property
    def simulated(self) -> bool:
        """Whether the samples go to no device."""
        return self._settings.output == "simulated"

    @property
    def pid(self) -> int | None:
        """Process id of the engine."""
        return self._child.pid

    @property
    def restarts(self) -> int:
        """Number of restarts of the engine."""
        return self._child.restarts

    @property
    def plays(self) -> bool:
        """Whether the engine runs, and what it plays reaches its output as far as is known."""
        return self._child.ready_at is not None and not self.faults

    @property
    def faults(self) -> tuple[str, ...]:
        """Names of the output's current faults."""
        if self._lacks_output:
            return (SPEAKER_GONE.name,)
        state = self._state
        return () if state is None or state.fault is None else (state.fault.name,)

    def begin(self) -> None:
        """Begin to start the engine without waiting for it; `start` waits."""
        self._child.begin()

    def start(self) -> None:
        """Start the engine and wait until it plays. Raises DeviceError, saying why it cannot."""
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
        # The order to rest goes both ways: through the ring, where it keeps its place among the
        # commands, and into the persistent state, which survives an overwritten ring. Both carry
        # the number of the order, so the engine rests once, and a later command is played.
        self._rested = self._ring.put(RestAll(), time.monotonic())
        self._ring.set_persistent(PersistentState(self._settings.gain, self._rested))

    def set_gain(self, gain: float) -> None:
        """Set the vibration gain (0..1)."""
        self._settings = dataclasses.replace(self._settings, gain=gain)
        self._ring.set_persistent(PersistentState(gain, self._rested))

    def status(self) -> EngineStatus:
        """Return the engine's newest report."""
        return self._ring.status()

    @property
    def underruns(self) -> int:
        """Number of underruns of this engine and all earlier ones."""
        return self._underruns_before + self._ring.status().underruns

    def delays(self, first: int, last: int) -> NDArray[np.float32]:
        """Return the time in s that commands first..last waited for their block, (N,)."""
        return self._ring.delays(first, last)

    def loudest(self) -> float:
        """Return the rms (0..1) of the loudest 2.7 ms since the last call, at most 1 s ago."""
        since = self._measured_until
        self._measured_until = self._ring.status().samples
        played = self._ring.waveform(min(max(0, self._measured_until - since), SAMPLES))
        whole = played[: played.size // WINDOW_SAMPLES * WINDOW_SAMPLES]
        windows = whole.reshape(-1, WINDOW_SAMPLES)
        squares = np.einsum("ij,ij->i", windows, windows)
        return float(np.sqrt(np.max(squares, initial=0.0) / WINDOW_SAMPLES))

    def waveform_until(self, count: int) -> tuple[int, NDArray[np.float32]]:
        """Return the number of samples ever played, and the newest `count` of them."""
        return self._ring.waveform_until(count)

    def supervise(self, now: float) -> str | None:
        """Restart a dead or hung engine; return what happened to it or its output, else None.

        Call it about ten times a second; `now` is on the monotonic clock, s.
        """
        # This process may have slept itself (a closed lid, a machine too busy to run it). Then the
        # engine's last beat is old although nothing is wrong with the engine. So the time without a
        # beat is counted only from when this process was awake.
        if now - self._watched_at > MAX_WATCH_GAP_S:
            self._awake_since = now
        self._watched_at = now
        alive_at = max(self._ring.status().beat_at, self._child.ready_at or now)
        is_well = now - max(alive_at, self._awake_since) <= SILENT_S
        # Read this before `supervise`, which may replace the engine: the new one counts from 0, and
        # the count of the old one must not be lost.
        underruns = self.underruns
        trouble = self._child.supervise(now, is_well=is_well)
        if trouble is None:
            return self._watch_output()
        self._underruns_before = underruns
        return f"{trouble}; vibration rests meanwhile"

    def watch_state(self) -> str | None:
        """Return a message if the output fell silent since the last call."""
        state = self._state
        fault = None if state is None else state.fault
        was_silent, self._was_silent = self._was_silent, fault is not None
        if was_silent or state is None or fault is None:
            return None
        return f"the audio output {self.name} is {state.text}; {fault.remedy}"

    def close(self) -> None:
        """Fade out, stop the engine and wait for it."""
        if self._watch is not None:
            self._watch.close()
        self._child.close(FADE_AND_CLOSE_S)

    @property
    def _lacks_output(self) -> bool:
        """Whether the engine reports that its output is gone; false before its first beat."""
        status = self._ring.status()
        return status.beat_at > 0.0 and not status.has_output

    @property
    def _state(self) -> OutputState | None:
        return None if self._watch is None else self._watch.state

    def _watch_output(self) -> str | None:
        """Return a message if the output has just disappeared."""
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
        if wav is not None and self._child.restarts:  # keep the file of the engine before
            next_wav = wav.with_stem(f"{wav.stem}-{self._child.restarts + 1}")
            settings = dataclasses.replace(settings, wav=next_wav)
        return self._ring.shared, settings

    def _begin(self, names: tuple[str, ...]) -> None:
        self.name, self._system_name = names
        is_known = not self.simulated and self._settings.output.lower() != JACK
        if is_known and self._watch is None:
            self._watch = OutputWatch(self._ask_state)

    def _ask_state(self) -> OutputState | None:
        name = self._system_name or "default"
        return output_state(name, pid=self._child.pid or 0, hands=self._settings.channels)
