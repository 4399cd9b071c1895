"""Runs the audio engine in a process of its own, with its stream always open; reads sound files.

The engine renders vibration block by block from the commands in the shared ring, so the gateway's
part of a touch is done when its command is in the ring. Everything that a command starts carries a
lease and ends when the lease ends, so a gateway that hangs leaves nothing on. When the gateway
dies, its end of the control pipe closes, and the engine fades out and exits.

The simulated speaker is a virtual clock on absolute deadlines that plays to no device; it and a
real output write a WAV file when one is requested. A real output that disappears is opened again
when it is back, and commands from the time between are dropped.

Threads of this process: the main thread waits on the control pipe and watches the output; the
audio system's thread (or the virtual clock's) renders in its callback; a third one writes the WAV
file. The callback renders the block itself. A thread that renders one block ahead, so that the
callback would only copy, plays each touch 3 ms later on PulseAudio at 128 samples and has as many
gaps.
"""

from __future__ import annotations

import errno
import gc
import io
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

from hapticvlm import documents
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
_HEAD_BYTES = 4096  # in which a WAV file begins its samples
_MAX_BYTES_PER_S = 384_000 * MAX_CHANNELS * 8
_REMEDY = "`hapticvlm doctor` lists the outputs; without --speaker none is needed"

logger = logging.getLogger(__name__)


def run_engine(shared: Shared, settings: AudioSettings, control: Connection) -> None:
    """Run the engine process until a message or the end of the control pipe asks it to stop.

    The first message that it sends on `control` is a `Started`, with the output's name or the
    reason why it cannot play.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    ring = Ring(shared, tuple(material.name for material in settings.materials))
    table_cache.load(CACHE)
    engine = Engine(ring, settings)
    table_cache.save(CACHE)
    try:
        wav = WavFile(settings.wav, settings.columns) if settings.wav else None
    except (OSError, RuntimeError) as error:  # soundfile's own error is a RuntimeError
        message = (
            f"cannot write --wav {settings.wav}: {documents.reason(error)}; choose another file"
        )
        Started(error=message).send(control)
        return
    if wav is not None:
        engine.on_block = wav.append
    engine.level = settings.level
    # The first block costs far more than the others, because tables are filled and code runs for
    # the first time. It is rendered here and dropped, before an output waits for it. Then the
    # garbage collector is switched off: its pause would be a gap that a palm feels, and `fill`
    # creates no reference cycles, so its memory is freed without it. Last, the memory in use is
    # locked, because a page fault in the callback would be a gap as well.
    engine.fill(settings.block)
    gc.collect()
    gc.disable()
    if settings.realtime:
        lock_memory()
    player: VirtualClock | Player
    simulated = settings.output == "simulated"
    player = VirtualClock(engine, settings) if simulated else Player(engine, settings)
    try:
        names = player.start()
    except Exception as error:  # noqa: BLE001 - the gateway must learn why, whatever the driver threw
        message = f"cannot open audio output {settings.output!r}: {error}; {_REMEDY}"
        Started(error=message).send(control)
        return
    if settings.realtime:
        request_priority()  # otherwise it could be preempted while the audio thread waits for it
    # Until now SIGTERM ends the process at once, for nothing has been played.
    Started(names).send(control)
    with suppress(EOFError, OSError, _Terminated):
        signal.signal(signal.SIGTERM, _raise_terminated)
        while not control.poll(player.poll_interval_s):
            player.poll_output(time.monotonic())
    signal.signal(signal.SIGTERM, signal.SIG_IGN)
    engine.fade_out()
    time.sleep(FADE_S)
    player.stop()
    if wav is not None:
        wav.close()


class _Terminated(Exception):
    """Raised in the main thread on SIGTERM, so that the engine fades out before it exits."""


def _raise_terminated(*_: object) -> None:
    raise _Terminated


class WavFile:
    """Writes the samples that were played to a file, from a thread of its own.

    The format is 32-bit float at RATE_HZ. Two channels are the left and the right hand; one
    channel is the mix of both.
    """

    def __init__(self, path: Path, channels: int = 1) -> None:
        import soundfile

        documents.kept_mode(path)  # opening a pipe would wait for its reader
        self._lock = path.open("ab")  # soundfile gives no reason
        if not documents.locks(self._lock):
            raise OSError(errno.EBUSY, "another program writes to it")
        self._file = soundfile.SoundFile(
            path, "w", samplerate=RATE_HZ, channels=channels, format="WAV", subtype="FLOAT"
        )
        self._queue: deque[NDArray[np.float32]] = deque(maxlen=MAX_QUEUED_BLOCKS)
        self._closing = threading.Event()
        self._thread = threading.Thread(target=self._write, name="wav writer", daemon=True)
        self._thread.start()

    def append(self, block: NDArray[np.float32]) -> None:
        """Queue one block, (N,) or (N, 2) float32; never blocks."""
        # The audio thread calls this, so another thread writes the file. Appending to a deque is
        # atomic and takes no lock. When the queue is full the oldest block is dropped, so a disk
        # that hangs costs a part of the file, but no memory and no gap in the sound.
        self._queue.append(block)

    def close(self) -> None:
        """Write the queued blocks and finish the file; waits for at most 5 s."""
        self._closing.set()
        self._thread.join(5.0)
        self._file.close()
        self._lock.close()

    def _write(self) -> None:
        try:
            while not self._closing.wait(0.2):
                self._drain()
            self._drain()
        except (OSError, RuntimeError) as error:  # the disk is full, for example
            text = "%s ends here, playing continues: %s Free some space on its disk"
            logger.error(text, self._file.name, error)

    def _drain(self) -> None:
        while self._queue:
            self._file.write(self._queue.popleft())


def read_wav(path: Path, longest_s: float) -> tuple[NDArray[np.float64], int]:
    """Read a sound file of at most `longest_s` seconds and MAX_CHANNELS channels.

    Returns its samples, (N, channels) float64 with full scale at 1, and its rate in Hz. Raises
    OSError if it cannot be read, ValueError if it is not such a sound file.
    """
    import soundfile

    if not path.is_file():
        raise FileNotFoundError(f"{path}: no such file")
    try:
        with soundfile.SoundFile(_with_sizes(path, longest_s)) as file:
            if file.channels > MAX_CHANNELS:
                raise ValueError(f"{path}: {file.channels} channels; mix it down to 1 or 2")
            if file.frames > longest_s * file.samplerate:
                seconds = file.frames / file.samplerate
                raise ValueError(f"{path}: lasts {seconds:.3g} s; cut it to {longest_s:g} s")
            return file.read(dtype="float64", always_2d=True), int(file.samplerate)
    except soundfile.LibsndfileError as error:  # its whole text names an object in memory
        problem = f"not a readable sound file: {error.error_string.rstrip('.')}"
        raise ValueError(f"{path}: {problem}; use a WAV file") from None
    except soundfile.SoundFileError as error:
        problem = f"not a readable sound file: {documents.reason(error)}"
        raise ValueError(f"{path}: {problem}; use a WAV file") from None


def _with_sizes(path: Path, longest_s: float) -> Path | io.BytesIO:
    """Return the file, or its repaired bytes if a recorder that lost power left the sizes at 0."""
    with documents.open_file(path) as file:
        head = file.read(_HEAD_BYTES)
    at = head.find(b"data\0\0\0\0") if head[:4] == b"RIFF" and head[8:12] == b"WAVE" else -1
    start = at + 8
    # A chunk after an empty one has a name; samples hardly begin with four printable characters.
    if at < 0 or len(head) < start + 4 or all(32 <= byte < 127 for byte in head[start : start + 4]):
        return path
    content = documents.read_bytes(path, round(longest_s * _MAX_BYTES_PER_S))
    sizes = (len(content) - 8, len(content) - start)
    riff, data = (size.to_bytes(4, "little") for size in sizes)
    return io.BytesIO(content[:4] + riff + content[8 : at + 4] + data + content[start:])
