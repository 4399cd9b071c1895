"""Plays one waveform on one output, without the service's audio engine, for calibration.

An exception or Ctrl-C in the middle fades the waveform within FADE_S.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np
from numpy.typing import NDArray

from hapticvlm.devices.speaker.output import Output, OutputError
from hapticvlm.rendering.vibration.vibration import RATE_HZ

BLOCK = 512
FADE_S = 0.05
_POLL_S = 0.02


class _Waveform:
    """What is being played; one object for each, so that the threads never mix two of them."""

    def __init__(self, samples: NDArray[np.float32]) -> None:
        self.samples = samples
        self.played = 0  # samples
        self.ended = threading.Event()


class WavePlayer:
    """A player that is silent until `play` is called.

    `fill` runs in the thread of the audio output, everything else in that of the caller.
    """

    def __init__(self, name: str) -> None:
        self.name = name
        self._waveform = _Waveform(np.zeros(0, np.float32))
        self._waveform.ended.set()
        self._gain = self._aim = 1.0

    def fill(self, count: int) -> NDArray[np.float32]:
        """Return the next `count` samples, (count,) float32 within [-1, 1]."""
        block = np.zeros(count, np.float32)
        waveform = self._waveform  # read once: `play` may replace it at any moment
        part = waveform.samples[waveform.played : waveform.played + count]
        block[: part.size] = part
        waveform.played += part.size
        # A waveform that is cut off would click, loudly on a speaker under a palm. So a fade lowers
        # the gain by a straight line, which goes on across blocks until it reaches 0.
        if self._aim < 1.0:
            gains = np.maximum(self._gain - np.arange(1, count + 1) / (FADE_S * RATE_HZ), self._aim)
            block = (block * gains).astype(np.float32)
            self._gain = float(gains[-1])
        if waveform.played >= waveform.samples.size or self._gain == 0.0:
            waveform.ended.set()
        return np.clip(block, np.float32(-1.0), np.float32(1.0))

    def play(self, wave: NDArray[np.float32]) -> None:
        """Play a waveform, (N,) at RATE_HZ, and return at its end.

        Raises OutputError when the output stops asking for samples.
        """
        self._waveform = waveform = _Waveform(np.asarray(wave, np.float32))
        deadline = time.monotonic() + 2.0 * wave.size / RATE_HZ + 5.0
        while not waveform.ended.wait(_POLL_S):
            if time.monotonic() > deadline:
                raise OutputError(f"{self.name} stopped asking for samples")

    def fade(self) -> None:
        """Fade out what plays, and wait until it is silent."""
        self._aim = 0.0
        self._waveform.ended.wait(1.0)


@contextmanager
def open_player(name: str) -> Iterator[WavePlayer]:
    """Open the output of this name; "simulated" plays into nothing. Raises OutputError."""
    if name == "simulated":
        with _simulated(WavePlayer("simulated speaker")) as player:
            yield player
        return
    player = WavePlayer(name)
    output = Output(player.fill, realtime=False)
    output.open(name, BLOCK)
    try:
        output.wait_until_steady(lambda: None)
        player.name = output.name
        yield player
    finally:
        player.fade()
        output.close()


@contextmanager
def _simulated(player: WavePlayer) -> Iterator[WavePlayer]:
    """Request samples from a thread, at the rate at which a real output would."""
    stopped = threading.Event()

    def request() -> None:
        while not stopped.wait(BLOCK / RATE_HZ):
            player.fill(BLOCK)

    thread = threading.Thread(target=request, name="simulated output", daemon=True)
    thread.start()
    try:
        yield player
    finally:
        player.fade()
        stopped.set()
        thread.join(1.0)
