"""The audio engine: its own process, its stream always open, and all sound I/O.

Renders vibration block by block from the commands in the shared ring, so that a touch is done when
its command is in the ring. Everything a command starts ends by itself when its lease lapses, also
when the gateway hangs; when the gateway dies the engine fades and exits. The simulated speaker is a
virtual clock on absolute deadlines that plays into nothing; both write a WAV when asked. A real
output that goes is opened again when it is back, and what was commanded meanwhile is not played.

The callback renders. A thread that renders a block ahead, for the callback only to copy, was tried
on PulseAudio at 128 samples: sound came 3 ms later, with as many gaps.
"""

from __future__ import annotations

import gc
import logging
import signal
import threading
import time
from collections import deque
from contextlib import suppress
from multiprocessing.connection import Connection
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from hapticvlm.devices.speaker import table_cache
from hapticvlm.devices.speaker.engine import FADE_S, AudioSettings, Engine
from hapticvlm.devices.speaker.output import lock_memory
from hapticvlm.devices.speaker.output_loop import Player, VirtualClock
from hapticvlm.devices.speaker.ring import Ring
from hapticvlm.processes.priority import request_priority
from hapticvlm.processes.supervised import Started
from hapticvlm.rendering.vibration.cache import CACHE
from hapticvlm.rendering.vibration.vibration import RATE_HZ

if TYPE_CHECKING:
    from hapticvlm.devices.speaker.ring import Shared

MAX_CHANNELS = 2
MAX_QUEUED_BLOCKS = 20_000
_CURE = "`hapticvlm doctor` lists the outputs; without --speaker none is needed"

logger = logging.getLogger(__name__)


def run_engine(shared: Shared, settings: AudioSettings, control: Connection) -> None:
    """Entry point of the engine process; ends on a message or when the gateway is gone."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, _raise_terminated)
    ring = Ring(shared, tuple(material.name for material in settings.materials))
    table_cache.load(CACHE)
    engine = Engine(ring, settings)
    table_cache.save(CACHE)
    try:
        wav = WavFile(settings.wav, settings.columns) if settings.wav else None
    except (OSError, RuntimeError) as error:  # soundfile's own error is a RuntimeError
        Started(error=f"cannot write --wav {settings.wav}: {error}").send(control)
        return
    if wav is not None:
        engine.on_block = wav.append
    engine.level = settings.level
    # The first block costs far more than the others: tables are filled and code is met for the
    # first time. It is rendered here and thrown away, before an output waits for it. Then the
    # garbage collector is switched off, since its pause would be a gap that a palm feels, and
    # what `fill` makes is freed without it. Last, what is in use is kept from being paged out.
    engine.fill(settings.block)
    gc.collect()
    gc.disable()
    if settings.realtime:
        lock_memory()
    player: VirtualClock | Player
    simulated = settings.output == "simulated"
    player = VirtualClock(engine, settings) if simulated else Player(engine, settings)
    try:
        name = player.start()
    except Exception as error:  # noqa: BLE001 - the gateway must learn why, whatever the driver threw
        text = f"cannot open audio output {settings.output!r}: {error}; {_CURE}"
        Started(error=text).send(control)
        return
    if settings.realtime:
        request_priority()  # or it could be put aside while the audio thread waits for it
    Started((name,)).send(control)
    with suppress(EOFError, OSError, _Terminated):
        while not control.poll(player.poll_interval_s):
            player.poll_output(time.monotonic())
    signal.signal(signal.SIGTERM, signal.SIG_IGN)
    engine.fade_out()
    time.sleep(FADE_S)
    player.stop()
    if wav is not None:
        wav.close()


class _Terminated(Exception):
    """Asked to end by a signal: fade first."""


def _raise_terminated(*_: object) -> None:
    raise _Terminated


class WavFile:
    """Writes what was played, sample-exact (32-bit float), from a thread of its own.

    Two channels are the left and the right hand, one is both.
    """

    def __init__(self, path: Path, channels: int = 1) -> None:
        import soundfile

        self._file = soundfile.SoundFile(
            path, "w", samplerate=RATE_HZ, channels=channels, format="WAV", subtype="FLOAT"
        )
        self._queue: deque[NDArray[np.float32]] = deque(maxlen=MAX_QUEUED_BLOCKS)
        self._closing = threading.Event()
        self._thread = threading.Thread(target=self._write, name="wav writer", daemon=True)
        self._thread.start()

    def append(self, block: NDArray[np.float32]) -> None:
        """Queue one block; never blocks."""
        # Called from the audio thread, so the file is written by another. A deque's append is
        # atomic and takes no lock; beyond its bound the oldest block goes, so a disk that hangs
        # costs a part of the file and no memory.
        self._queue.append(block)

    def close(self) -> None:
        """Write what is queued and finish the file."""
        self._closing.set()
        self._thread.join(5.0)
        self._file.close()

    def _write(self) -> None:
        try:
            while not self._closing.wait(0.2):
                self._drain()
            self._drain()
        except (OSError, RuntimeError) as error:  # the disk is full; what is played goes on
            logger.error("the WAV file ends here: %s", error)

    def _drain(self) -> None:
        while self._queue:
            self._file.write(self._queue.popleft())


def read_wav(path: Path, longest_s: float) -> tuple[NDArray[np.float64], int]:
    """Read a sound file: samples (N, channels) and their rate, Hz. Raises OSError, ValueError."""
    import soundfile

    if not path.is_file():
        raise FileNotFoundError(f"{path}: no such file")
    try:
        with soundfile.SoundFile(path) as file:
            if file.channels > MAX_CHANNELS:
                raise ValueError(f"{path}: {file.channels} channels; mix it down to 1 or 2")
            if file.frames > longest_s * file.samplerate:
                seconds = file.frames / file.samplerate
                raise ValueError(f"{path}: lasts {seconds:.3g} s; cut it to {longest_s:g} s")
            return file.read(dtype="float64", always_2d=True), int(file.samplerate)
    except soundfile.SoundFileError as error:
        raise ValueError(f"{path}: not a sound file that can be read: {error}") from None


def write_wav(path: Path, samples: NDArray[np.float32]) -> None:
    """Write samples (N,) at RATE_HZ as a 32-bit float WAV file."""
    import soundfile

    soundfile.write(path, samples, RATE_HZ, format="WAV", subtype="FLOAT")
