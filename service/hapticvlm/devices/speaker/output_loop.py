"""Keeps the audio engine playing on a virtual clock, or on a real output that may come and go.

Both have the same three methods for the engine's process: `start`, `poll_output` (called every
`poll_interval_s`) and `stop`. Neither knows what is played.
"""

from __future__ import annotations

import math
import threading
import time

from hapticvlm.devices.speaker.engine import AudioSettings, Engine
from hapticvlm.devices.speaker.output import Output, OutputError
from hapticvlm.processes.priority import request_priority
from hapticvlm.rendering.vibration.vibration import RATE_HZ

POLL_INTERVAL_S = 0.05
RETRY_S = 1.0


class VirtualClock:
    """Requests one block after the other on absolute deadlines and drops them.

    It runs in a thread of its own, as the callback of a real output does.
    """

    poll_interval_s = None

    def __init__(self, engine: Engine, settings: AudioSettings) -> None:
        self._engine = engine
        self._settings = settings
        self._stopped = threading.Event()
        self._thread = threading.Thread(target=self._play, name="virtual clock", daemon=True)

    def start(self) -> tuple[str, str]:
        """Start and return the output's name and the system's name of it (none)."""
        self._thread.start()
        return "simulated speaker", ""

    def poll_output(self, now: float) -> None:
        """Do nothing: if the thread ends, the engine's beats stop and the gateway notices."""

    def stop(self) -> None:
        """Stop playing."""
        self._stopped.set()
        self._thread.join(1.0)

    def _play(self) -> None:
        engine = self._engine
        block = self._settings.block
        engine.realtime = self._settings.realtime and request_priority()
        period = block / RATE_HZ
        deadline = time.monotonic()
        while not self._stopped.is_set():
            engine.fill(block)
            deadline += period
            # Deadlines are absolute, so a late block does not delay the ones after it, and the
            # clock does not drift by the time that rendering takes. A block that is late by more
            # than its own length is an underrun. Then the deadlines start again from now, because
            # playing the missed blocks in a burst would shift every later touch.
            remaining_s = deadline - time.monotonic()
            if remaining_s > 0:
                time.sleep(remaining_s)
            elif remaining_s < -period:
                engine.underruns += 1
                deadline = time.monotonic()


class Player:
    """Keeps an engine playing on a real output, and reopens the output when it was lost."""

    poll_interval_s = POLL_INTERVAL_S

    def __init__(self, engine: Engine, settings: AudioSettings) -> None:
        self._engine = engine
        self._settings = settings
        self._output: Output | None = None
        self._system_name = ""
        self._underruns_before = 0
        self._watched_at = self._awake_since = self._retry_at = -math.inf

    def start(self) -> tuple[str, str]:
        """Open the output and return its name and the system's name of it. Raises OutputError."""
        output = Output(self._engine.fill, self._settings.realtime, hands=self._settings.channels)
        output.system_name = self._system_name
        output.open(self._settings.output, self._settings.block)
        output.wait_until_steady(self._engine.beat)
        self._output = output
        self._engine.has_output = True
        self._system_name = output.system_name
        return output.name, output.system_name

    def poll_output(self, now: float) -> None:
        """Watch the output: rest while it is lost, and retry it every RETRY_S."""
        if now - self._watched_at > 5 * POLL_INTERVAL_S:
            self._awake_since = now  # this process slept, so the output may have slept too
        self._watched_at = now
        if self._output is None:
            self._reopen(now)
        else:
            self._follow(self._output, now)
        self._engine.beat()

    def stop(self) -> None:
        """Stop playing."""
        if self._output is not None:
            self._output.close()

    def _follow(self, output: Output, now: float) -> None:
        if output.failure is not None:
            raise RuntimeError("rendering failed") from output.failure
        self._engine.realtime = output.has_priority
        self._engine.underruns = self._underruns_before + output.underruns
        if output.is_lost(now, self._awake_since):
            # A lost output reports nothing and requests nothing, so we have to close it. The engine
            # itself continues. Orders that arrive until the output is back are dropped
            # (`rest_unplayed`), so that no old touch is played then.
            self._underruns_before = self._engine.underruns
            output.close()
            self._output = None
            self._engine.has_output = False
            self._retry_at = now

    def _reopen(self, now: float) -> None:
        self._engine.rest_unplayed()
        if now < self._retry_at:
            return
        try:
            self.start()
        except OutputError:
            self._retry_at = time.monotonic() + RETRY_S
