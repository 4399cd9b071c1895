"""The audio engine: its own process, its stream always open, and all sound I/O.

Renders vibration block by block from the commands in the shared ring, so that a touch is done when
its command is in the ring. Everything a command starts ends by itself when its lease lapses, also
when the gateway hangs; when the gateway dies the engine fades and exits. The simulated speaker is a
virtual clock on absolute deadlines that plays into nothing; both write a WAV when asked.
"""

from __future__ import annotations

import gc
import os
import signal
import threading
import time
from collections import deque
from collections.abc import Callable, Generator, Mapping
from contextlib import suppress
from dataclasses import dataclass
from multiprocessing.connection import Connection
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from hapticvlm.devices.ring import EngineStatus, Gain, LetGo, Order, RestAll, Ring
from hapticvlm.materials import MATERIALS, Material
from hapticvlm.rendering.vibration import RATE_HZ
from hapticvlm.rendering.voices import Command, Voices

if TYPE_CHECKING:
    from hapticvlm.devices.ring import Shared

FIFO_PRIORITY = 20
FADE_S = 0.05
MAX_WAITING_BLOCKS = 20_000


@dataclass(frozen=True, slots=True)
class AudioSettings:
    """How the engine plays: `output` is "simulated", "default" or part of a device's name.

    `materials` are those it can render, in the order in which the ring counts them.
    """

    output: str = "simulated"
    block: int = 128
    wav: Path | None = None
    realtime: bool = True
    gain: float = 1.0
    materials: tuple[Material, ...] = tuple(MATERIALS.values())


class Engine:
    """Turns ring commands into blocks; `fill` is all the audio callback calls."""

    def __init__(
        self, ring: Ring, gain: float = 1.0, table: Mapping[str, Material] = MATERIALS
    ) -> None:
        self._ring = ring
        self._voices = Voices(gain=gain, table=table)
        self._is_leaving = False
        self._newest = ring.newest
        self._lost = self._samples = 0
        self.underruns = 0
        self.realtime = False
        self.tee: Callable[[NDArray[np.float32]], None] | None = None

    def fill(self, count: int) -> NDArray[np.float32]:
        """Return the next `count` samples, (count,) float32 within [-1, 1]."""
        now = time.monotonic()
        for number, written_at, order in self._ring.take(self._newest):
            self._newest = number
            if order is None:
                self._lost += 1
                continue
            if not self._is_leaving:
                self._obey(order)
            self._ring.note_delay(number, now - written_at)
        block = self._voices.render(count, now)
        self._samples += count
        if self.tee is not None:
            self.tee(block)
        self._ring.report(self._status(now), block)
        return block

    def leave(self) -> None:
        """Fade everything and obey nothing from now on."""
        self._is_leaving = True
        self._voices.rest()

    def _obey(self, order: Order) -> None:
        match order:
            case Command():
                self._voices.obey(order)
            case LetGo():
                self._voices.release(order.hand)
            case RestAll():
                self._voices.rest()
            case Gain():
                self._voices.gain = order.gain

    def _status(self, now: float) -> EngineStatus:
        return EngineStatus(
            beat_at=now,
            level=self._voices.level,
            underruns=self.underruns,
            lost=self._lost,
            scrubbed=self._voices.scrubbed,
            samples=self._samples,
            newest=self._newest,
            realtime=self.realtime,
        )


def run_engine(shared: Shared, settings: AudioSettings, control: Connection) -> None:
    """Entry point of the engine process; ends on a message or when the gateway is gone."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, _leave)
    table = {material.name: material for material in settings.materials}
    engine = Engine(Ring(shared, tuple(table)), settings.gain, table)
    wav = WavFile(settings.wav) if settings.wav else None
    if wav is not None:
        engine.tee = wav.append
    engine.fill(settings.block)
    gc.collect()
    gc.disable()
    try:
        stop, name = _open(engine, settings)
    except Exception as error:  # noqa: BLE001 - the gateway must hear why, whatever the driver threw
        control.send(("failed", f"cannot open audio output {settings.output!r}: {error}"))
        return
    control.send(("ready", name))
    with suppress(EOFError, OSError, _Leave):
        control.recv()
    signal.signal(signal.SIGTERM, signal.SIG_IGN)
    engine.leave()
    time.sleep(FADE_S)
    stop()
    if wav is not None:
        wav.close()


class _Leave(Exception):
    """Asked to end by a signal: fade first."""


def _leave(*_: object) -> None:
    raise _Leave


def _open(engine: Engine, settings: AudioSettings) -> tuple[Callable[[], None], str]:
    """Start playing; return how to stop and the output's name."""
    if settings.output == "simulated":
        return _open_simulated(engine, settings), "simulated speaker"
    return _open_device(engine, settings)


def _open_simulated(engine: Engine, settings: AudioSettings) -> Callable[[], None]:
    stopped = threading.Event()

    def play() -> None:
        engine.realtime = settings.realtime and _take_priority()
        period = settings.block / RATE_HZ
        deadline = time.monotonic()
        while not stopped.is_set():
            engine.fill(settings.block)
            deadline += period
            ahead = deadline - time.monotonic()
            if ahead > 0:
                time.sleep(ahead)
            elif ahead < -period:
                engine.underruns += 1
                deadline = time.monotonic()

    thread = threading.Thread(target=play, name="virtual clock", daemon=True)
    thread.start()

    def stop() -> None:
        stopped.set()
        thread.join(1.0)

    return stop


def _open_device(engine: Engine, settings: AudioSettings) -> tuple[Callable[[], None], str]:
    import miniaudio

    found = None
    if settings.output != "default":
        devices = miniaudio.Devices().get_playbacks()
        wanted = settings.output.lower()
        found = next((device for device in devices if wanted in device["name"].lower()), None)
        if found is None:
            names = ", ".join(device["name"] for device in devices) or "none"
            raise LookupError(f"no such output; this machine has: {names}")

    def blocks() -> Generator[NDArray[np.float32], int, None]:
        engine.realtime = False
        due = time.monotonic()
        count = yield np.empty(0, np.float32)
        engine.realtime = settings.realtime and _take_priority()
        while True:
            now = time.monotonic()
            engine.underruns += now > due + 2 * count / RATE_HZ and due > 0
            due = now + count / RATE_HZ
            count = yield engine.fill(count)

    stream = blocks()
    next(stream)
    device = miniaudio.PlaybackDevice(
        output_format=miniaudio.SampleFormat.FLOAT32,
        nchannels=1,
        sample_rate=RATE_HZ,
        buffersize_msec=max(1, round(settings.block * 1000 / RATE_HZ)),
        device_id=found["id"] if found else None,
        app_name="HapticVLM",
    )
    if "null" in device.backend.lower():
        device.close()
        raise LookupError("this machine has no audio output")
    device.start(stream)
    return device.close, found["name"] if found else f"default output ({device.backend})"


def _take_priority() -> bool:
    """Ask for real-time priority for the calling thread; tell whether it was permitted."""
    if not hasattr(os, "sched_setscheduler"):
        return False
    try:
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(FIFO_PRIORITY))
    except OSError:
        return False
    return True


class WavFile:
    """Writes what was played, sample-exact (32-bit float), from a thread of its own."""

    def __init__(self, path: Path) -> None:
        import soundfile

        self._file = soundfile.SoundFile(
            path, "w", samplerate=RATE_HZ, channels=1, format="WAV", subtype="FLOAT"
        )
        self._waiting: deque[NDArray[np.float32]] = deque(maxlen=MAX_WAITING_BLOCKS)
        self._closing = threading.Event()
        self._thread = threading.Thread(target=self._write, name="wav writer", daemon=True)
        self._thread.start()

    def append(self, block: NDArray[np.float32]) -> None:
        """Queue one block; never blocks."""
        self._waiting.append(block)

    def close(self) -> None:
        """Write what is queued and finish the file."""
        self._closing.set()
        self._thread.join(5.0)
        self._file.close()

    def _write(self) -> None:
        while not self._closing.wait(0.2):
            self._drain()
        self._drain()

    def _drain(self) -> None:
        while self._waiting:
            self._file.write(self._waiting.popleft())


def write_wav(path: Path, samples: NDArray[np.float32]) -> None:
    """Write samples (N,) at RATE_HZ as a 32-bit float WAV file."""
    import soundfile

    soundfile.write(path, samples, RATE_HZ, format="WAV", subtype="FLOAT")
