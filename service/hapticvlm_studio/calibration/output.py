"""One waveform on one output, from begin to end, without the audio engine: for calibration.

Whatever ends it early, an exception or Ctrl-C, fades it within FADE_S.
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


class Sounding:
    """An output that is silent until it is given something to play."""

    def __init__(self, name: str) -> None:
        self.name = name
        self.played = 0  # samples of the waveform so far
        self._wave = np.zeros(0, np.float32)
        self._gain = self._aim = 1.0
        self._ended = threading.Event()
        self._ended.set()

    def fill(self, count: int) -> NDArray[np.float32]:
        """Return the next `count` samples, (count,) float32 within [-1, 1]."""
        block = np.zeros(count, np.float32)
        part = self._wave[self.played : self.played + count]
        block[: part.size] = part
        self.played += part.size
        if self._aim < 1.0:
            gains = np.maximum(self._gain - np.arange(1, count + 1) / (FADE_S * RATE_HZ), self._aim)
            block = (block * gains).astype(np.float32)
            self._gain = float(gains[-1])
        if self.played >= self._wave.size or self._gain == 0.0:
            self._ended.set()
        return np.clip(block, np.float32(-1.0), np.float32(1.0))

    def play(self, wave: NDArray[np.float32]) -> None:
        """Play a waveform (N,) at RATE_HZ to its end. Raises OutputError when the output stops."""
        self._ended.clear()
        self.played, self._wave = 0, np.asarray(wave, np.float32)
        gives_up_at = time.monotonic() + 2.0 * wave.size / RATE_HZ + 5.0
        while not self._ended.wait(_POLL_S):
            if time.monotonic() > gives_up_at:
                raise OutputError(f"{self.name} stopped asking for samples")

    def fade(self) -> None:
        """Fade what sounds, and wait for its end."""
        self._aim = 0.0
        self._ended.wait(1.0)


@contextmanager
def opened(wanted: str) -> Iterator[Sounding]:
    """Open the output called so; "simulated" plays into nothing. Raises OutputError."""
    if wanted == "simulated":
        with _clocked(Sounding("simulated speaker")) as sounding:
            yield sounding
        return
    sounding = Sounding(wanted)
    output = Output(sounding.fill, realtime=False)
    output.open(wanted, BLOCK)
    try:
        output.settle(lambda: None)
        sounding.name = output.name
        yield sounding
    finally:
        sounding.fade()
        output.close()


@contextmanager
def _clocked(sounding: Sounding) -> Iterator[Sounding]:
    """Ask for samples as fast as they are played."""
    stopped = threading.Event()

    def ask() -> None:
        while not stopped.wait(BLOCK / RATE_HZ):
            sounding.fill(BLOCK)

    thread = threading.Thread(target=ask, name="simulated output", daemon=True)
    thread.start()
    try:
        yield sounding
    finally:
        sounding.fade()
        stopped.set()
        thread.join(1.0)
