"""The recogniser: a process of its own that decodes pictures, embeds them and matches the gallery.

The gateway hands it one frame at a time through shared memory and gets evidence back; whatever
waits meanwhile sits in a mailbox where the newest frame wins. Knows no sockets and no sessions.
"""

from __future__ import annotations

import ctypes
import multiprocessing
import os
import signal
import threading
import time
from collections import OrderedDict, deque
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess
from pathlib import Path
from typing import Any

import msgspec
import numpy as np

from hapticvlm.messages import MAX_MESSAGE_BYTES, Frame
from hapticvlm.recognition import pictures
from hapticvlm.recognition.encoder import Encoder, load_encoder
from hapticvlm.recognition.gallery import Gallery, load_gallery
from hapticvlm.recognition.ladder import Evidence

MAX_ENROL_PER_OBJECT = 8
MAX_ENROL = 256
MAX_SEEN = 1024
NICE = 5
START_S = 20.0
RESTART_S = 2.0
STUCK_S = 20.0


class QueueFull(Exception):
    """The enrol queue of an object is full; the client sends too fast."""


class Mailbox:
    """What waits of one connection: the newest live frame, and a bounded queue to enrol.

    Live and enrol frames take turns, so that neither starves the other.
    """

    def __init__(self) -> None:
        self._newest: Frame | None = None
        self._enrol: deque[Frame] = deque()
        self._enrol_next = False

    def put(self, frame: Frame) -> Frame | None:
        """Keep `frame`; return the live frame it supersedes. Raises QueueFull for enrol."""
        if frame.purpose == "enrol":
            same = sum(waiting.object_id == frame.object_id for waiting in self._enrol)
            if same >= MAX_ENROL_PER_OBJECT or len(self._enrol) >= MAX_ENROL:
                raise QueueFull
            self._enrol.append(frame)
            return None
        superseded, self._newest = self._newest, frame
        return superseded

    def take(self) -> Frame | None:
        """Remove and return what to look at next, if anything waits."""
        if self._enrol and (self._enrol_next or self._newest is None):
            self._enrol_next = False
            return self._enrol.popleft()
        self._enrol_next = True
        frame, self._newest = self._newest, None
        return frame


@dataclass(frozen=True, slots=True)
class RecogniserSettings:
    """What to load: None = what ships with the package."""

    encoder: str | None = None
    gallery: Path | None = None


@dataclass(frozen=True, slots=True)
class Look:
    """What came of looking at a frame: evidence, None for an unchanged picture, or an error."""

    evidence: Evidence | None
    stages_ms: dict[str, float]
    error: str | None = None
    is_our_fault: bool = False


@dataclass(frozen=True, slots=True)
class Loaded:
    """What the recogniser runs."""

    encoder: str
    gallery: str


class Recogniser:
    """The gateway's end: one look at a time, answers through a callback from a reader thread."""

    def __init__(self, settings: RecogniserSettings) -> None:
        self._settings = settings
        self._slot = multiprocessing.get_context("spawn").RawArray(
            "B", 2 * MAX_MESSAGE_BYTES + 4096
        )
        self._bytes = np.frombuffer(self._slot, np.uint8)
        self._process: BaseProcess | None = None
        self._control: Connection | None = None
        self._started_at = 0.0
        self._asked_at: float | None = None
        self._answer: Callable[[Look], None] | None = None
        self.loaded = Loaded("none", "none")
        self.restarts = 0
        self.busy_s = 0.0

    @property
    def pid(self) -> int | None:
        """Process id of the recogniser."""
        return self._process.pid if self._process else None

    @property
    def is_busy(self) -> bool:
        """Whether a look is under way."""
        return self._asked_at is not None

    def start(self, answer: Callable[[Look], None]) -> None:
        """Start the process and wait until its models are loaded; raises RuntimeError if not.

        `answer` is called from a thread of ours for each look and must only pass it on.
        """
        self._answer = answer
        self._spawn()
        assert self._control is not None
        if not self._control.poll(START_S):
            self.close()
            raise RuntimeError("the recogniser did not start within 20 s")
        try:
            loaded = self._control.recv()
        except EOFError:
            loaded = "the recogniser died while it loaded its models"
        if isinstance(loaded, str):
            self.close()
            raise RuntimeError(loaded)
        self.loaded = loaded
        self._listen()

    def look(self, frame: Frame, owner: str, now: float, *, anew: bool) -> None:
        """Hand over one frame of connection `owner`; only while not busy.

        `anew` = also if its picture has not changed.
        """
        assert self._control is not None
        data = msgspec.msgpack.encode(frame)
        self._bytes[: len(data)] = np.frombuffer(data, np.uint8)
        self._asked_at = now
        with suppress(OSError):
            self._control.send((len(data), owner, now, anew))

    def done(self) -> None:
        """Say that the answer was taken: the next look may begin."""
        if self._asked_at is not None:
            self.busy_s += time.monotonic() - self._asked_at
        self._asked_at = None

    def supervise(self, now: float) -> str | None:
        """Restart a dead or stuck process; return what happened, if anything."""
        process = self._process
        if process is None or now - self._started_at < RESTART_S:
            return None
        stuck = self._asked_at is not None and now - self._asked_at > STUCK_S
        if process.is_alive() and not stuck:
            return None
        why = "hung" if process.is_alive() else f"died (exit code {process.exitcode})"
        self._end()
        self._spawn()
        self._asked_at = None
        self.restarts += 1
        self._listen(skip_first=True)
        return f"the recogniser {why} and was restarted; the frame it looked at is lost"

    def close(self) -> None:
        """Stop the process."""
        self._end()

    def _spawn(self) -> None:
        context = multiprocessing.get_context("spawn")
        self._control, theirs = context.Pipe()
        self._process = context.Process(
            target=run_recogniser,
            args=(self._slot, self._settings, theirs),
            name="hapticvlm recogniser",
            daemon=True,
        )
        self._process.start()
        theirs.close()
        self._started_at = time.monotonic()

    def _listen(self, *, skip_first: bool = False) -> None:
        control, answer = self._control, self._answer
        assert control is not None
        assert answer is not None

        def read() -> None:
            with suppress(EOFError, OSError):
                if skip_first:
                    control.recv()
                while True:
                    answer(control.recv())

        threading.Thread(target=read, name="recogniser answers", daemon=True).start()

    def _end(self) -> None:
        if self._process is not None:
            self._process.kill()
            self._process.join(2.0)
        self._process = self._control = None


def run_recogniser(
    slot: ctypes.Array[ctypes.c_ubyte], settings: RecogniserSettings, control: Connection
) -> None:
    """Entry point of the recogniser process; ends when the gateway is gone."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    _lower_priority()
    try:
        encoder = load_encoder(settings.encoder)
        gallery = load_gallery(settings.gallery, encoder=encoder)
    except Exception as error:  # noqa: BLE001 - the gateway must hear why, whatever a model threw
        control.send(f"cannot load the models: {error}")
        return
    control.send(Loaded(encoder.name, settings.gallery.name if settings.gallery else "shipped"))
    eye = Eye(encoder, gallery)
    data = np.frombuffer(memoryview(slot), np.uint8).data
    with suppress(EOFError, OSError):
        while True:
            length, owner, asked_at, anew = control.recv()
            waited_ms = (time.monotonic() - asked_at) * 1000.0
            control.send(eye.look(bytes(data[:length]), owner, waited_ms, anew=anew))


def _lower_priority() -> None:
    if hasattr(os, "sched_setscheduler"):
        with suppress(OSError):
            os.sched_setscheduler(0, os.SCHED_OTHER, os.sched_param(0))
    if hasattr(os, "nice"):
        os.nice(NICE)


class Eye:
    """Looks at pictures one after the other; remembers what each object looked like."""

    def __init__(self, encoder: Encoder, gallery: Gallery) -> None:
        self._encoder = encoder
        self._gallery = gallery
        self._seen: OrderedDict[tuple[str, str | None], Any] = OrderedDict()

    def look(self, data: bytes, owner: str, waited_ms: float, *, anew: bool) -> Look:
        """Decode, compare with the last picture of the same object, embed and match."""
        stages = {"queue": waited_ms}
        started = time.perf_counter()
        frame = msgspec.msgpack.decode(data, type=Frame)
        try:
            crop = pictures.crop(frame, self._encoder.side)
        except pictures.PictureError as error:
            return Look(None, stages, str(error))
        stages["decode"], started = _lap(started)
        unchanged = self._is_unchanged((owner, frame.object_id), crop)
        if unchanged and frame.purpose == "live" and not anew:
            return Look(None, stages)
        embedding = self._encoder.embed([crop])[0]
        stages["encode"], started = _lap(started)
        if not np.isfinite(embedding).all():
            return Look(None, stages, "the encoder gave no finite embedding", is_our_fault=True)
        evidence = self._gallery.match(embedding)
        stages["match"], _ = _lap(started)
        return Look(evidence, stages)

    def _is_unchanged(self, key: tuple[str, str | None], crop: pictures.Crop) -> bool:
        signature = pictures.signature(crop)
        before = self._seen.get(key)
        if before is not None and not pictures.has_changed(before, signature):
            return True
        self._seen[key] = signature
        self._seen.move_to_end(key)
        if len(self._seen) > MAX_SEEN:
            self._seen.popitem(last=False)
        return False


def _lap(started: float) -> tuple[float, float]:
    now = time.perf_counter()
    return (now - started) * 1000.0, now
