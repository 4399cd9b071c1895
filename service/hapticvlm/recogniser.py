"""The recogniser: a process of its own that decodes pictures, embeds them and matches the gallery.

The gateway hands it one frame at a time through shared memory and gets evidence back; whatever
waits meanwhile sits in a mailbox where the newest frame wins. Knows no sockets and no sessions.
"""

from __future__ import annotations

import ctypes
import logging
import multiprocessing
import os
import signal
import threading
import time
from collections import OrderedDict, deque
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, replace
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any, Generic, TypeVar

import msgspec
import numpy as np
from numpy.typing import NDArray

from hapticvlm.child import Child
from hapticvlm.messages import MAX_MESSAGE_BYTES, Frame
from hapticvlm.recognition import pictures
from hapticvlm.recognition.encoder import Encoder, load_encoder
from hapticvlm.recognition.gallery import Gallery, load_gallery
from hapticvlm.recognition.ladder import Evidence
from hapticvlm.recognition.own import OwnMaterial

MAX_ENROL_PER_OBJECT = 8
MAX_ENROL_BYTES = 32 * 1024 * 1024
MAX_SEEN = 1024
NICE = 5
SLOT_BYTES = MAX_MESSAGE_BYTES + 4096
STUCK_S = 20.0

T = TypeVar("T")

logger = logging.getLogger(__name__)


class QueueFull(Exception):
    """Too much waits to be enrolled; the client sends too fast."""


class Mailbox(Generic[T]):
    """What waits of one connection, all of it bounded; the newest wins.

    What a hand touches comes first; live frames and frames to enrol take turns after it.
    """

    def __init__(self) -> None:
        self._live: T | None = None
        self._touched: dict[str, T] = {}
        self._enrol: deque[tuple[T, str | None, int]] = deque()
        self._enrol_next = False

    def put_live(self, item: T) -> T | None:
        """Keep the newest live frame; return the one it supersedes."""
        superseded, self._live = self._live, item
        return superseded

    def put_touch(self, item: T, hand: str) -> T | None:
        """Keep the newest look for this hand; return the one it supersedes."""
        superseded = self._touched.get(hand)
        self._touched[hand] = item
        return superseded

    def put_enrol(self, item: T, object_id: str | None, size_bytes: int) -> None:
        """Queue a view of an object. Raises QueueFull."""
        same = sum(waiting[1] == object_id for waiting in self._enrol)
        held_bytes = sum(waiting[2] for waiting in self._enrol)
        if same >= MAX_ENROL_PER_OBJECT or held_bytes + size_bytes > MAX_ENROL_BYTES:
            raise QueueFull
        self._enrol.append((item, object_id, size_bytes))

    def take(self) -> T | None:
        """Remove and return what to look at next, if anything waits."""
        if self._touched:
            return self._touched.pop(next(iter(self._touched)))
        if self._enrol and (self._enrol_next or self._live is None):
            self._enrol_next = False
            return self._enrol.popleft()[0]
        self._enrol_next = True
        item, self._live = self._live, None
        return item


@dataclass(frozen=True, slots=True)
class RecogniserSettings:
    """What to load: None = what ships with the package.

    `own` are the materials of the gallery folder that the rest of the service knows.
    """

    encoder: str | None = None
    gallery: Path | None = None
    own: tuple[OwnMaterial, ...] = ()


@dataclass(frozen=True, slots=True)
class Look:
    """What came of looking at a frame: evidence, None for an unchanged picture, or an error."""

    evidence: Evidence | None
    stages_ms: dict[str, float]
    error: str | None = None
    is_our_fault: bool = False
    number: int = 0


@dataclass(frozen=True, slots=True)
class Loaded:
    """What the recogniser runs."""

    encoder: str
    gallery: str


class Recogniser:
    """The gateway's end: one look at a time, answers through a callback from a reader thread."""

    def __init__(self, settings: RecogniserSettings) -> None:
        self._settings = settings
        self._slot = multiprocessing.get_context("spawn").RawArray("B", SLOT_BYTES)
        self._bytes = np.frombuffer(memoryview(self._slot), np.uint8)
        self._child = Child("recogniser", run_recogniser, self._arguments, self._begin)
        self._answer: Callable[[Look], None] | None = None
        self._asked_at: float | None = None
        self._asked = 0
        self.loaded = Loaded("none", "none")
        self.busy_s = 0.0

    @property
    def pid(self) -> int | None:
        """Process id of the recogniser."""
        return self._child.pid

    @property
    def restarts(self) -> int:
        """How often the process had to be restarted."""
        return self._child.restarts

    @property
    def is_busy(self) -> bool:
        """Whether it cannot take a look now: one is under way, or it is not ready."""
        return self._asked_at is not None or self._child.ready_at is None

    def start(self, answer: Callable[[Look], None]) -> None:
        """Start the process and wait until its models are loaded; raises ChildError if not.

        `answer` is called from a thread of ours for each look and must only pass it on.
        """
        self._answer = answer
        self._child.start()

    def look(self, frame: Frame, subject: str, now: float, *, anew: bool) -> None:
        """Hand over one frame; only while not busy.

        `subject` names what it shows, to notice an unchanged picture; `anew` = look all the same.
        """
        data = msgspec.msgpack.encode(msgspec.structs.replace(frame, id=1))  # 0 is no wire id
        self._bytes[: len(data)] = np.frombuffer(data, np.uint8)
        self._asked_at = now
        self._asked += 1
        with suppress(OSError):
            self._child.control.send((self._asked, len(data), subject, now, anew))

    def done(self, look: Look) -> bool:
        """Take note of an answer; false if it is to a question of long ago."""
        if look.number != self._asked or self._asked_at is None:
            return False
        self.busy_s += time.monotonic() - self._asked_at
        self._asked_at = None
        return True

    def supervise(self, now: float) -> str | None:
        """Restart a dead or stuck process; return what happened, if anything."""
        is_stuck = self._asked_at is not None and now - self._asked_at > STUCK_S
        trouble = self._child.supervise(now, is_well=not is_stuck)
        if trouble is not None:
            self._asked_at = None
            self._asked += 1
        return trouble

    def close(self) -> None:
        """Stop the process."""
        self._child.close(0.0)

    def _arguments(self) -> tuple[Any, ...]:
        return self._slot, self._settings

    def _begin(self, loaded: Loaded) -> None:
        self.loaded = loaded
        control, answer = self._child.control, self._answer
        assert answer is not None

        def read() -> None:
            with suppress(EOFError, OSError):
                while True:
                    answer(control.recv())

        threading.Thread(target=read, name="recogniser answers", daemon=True).start()


def run_recogniser(
    slot: ctypes.Array[ctypes.c_ubyte], settings: RecogniserSettings, control: Connection
) -> None:
    """Entry point of the recogniser process; ends when the gateway is gone."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    _lower_priority()
    try:
        encoder = load_encoder(settings.encoder)
        gallery = load_gallery(settings.gallery, encoder=encoder, own=settings.own)
    except Exception as error:  # noqa: BLE001 - the gateway must hear why, whatever a model threw
        control.send(("failed", f"cannot load the models: {error}"))
        return
    gallery_name = settings.gallery.resolve().name if settings.gallery else "shipped"
    control.send(("ready", Loaded(encoder.name, gallery_name)))
    eye = Eye(encoder, gallery)
    data = np.frombuffer(memoryview(slot), np.uint8).data
    with suppress(EOFError, OSError):
        while True:
            number, length, subject, asked_at, anew = control.recv()
            waited_ms = (time.monotonic() - asked_at) * 1000.0
            try:
                look = eye.look(bytes(data[:length]), subject, waited_ms, anew=anew)
            except Exception:  # a picture that trips a bug of ours must not take the others down
                logger.exception("a look failed")
                look = Look(None, {}, "looking at this picture failed", is_our_fault=True)
            control.send(replace(look, number=number))


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
        self._seen: OrderedDict[str, NDArray[np.float32]] = OrderedDict()

    def look(self, data: bytes, subject: str, waited_ms: float, *, anew: bool) -> Look:
        """Decode, compare with the last picture of the same object, embed and match."""
        stages = {"queue": waited_ms}
        started = time.perf_counter()
        frame = msgspec.msgpack.decode(data, type=Frame)
        try:
            crop = pictures.crop(frame, self._encoder.side)
        except pictures.PictureError as error:
            return Look(None, stages, str(error))
        stages["decode"], started = _lap(started)
        unchanged = self._is_unchanged(subject, crop)
        if unchanged and frame.purpose == "live" and not anew:
            return Look(None, stages)
        embedding = self._encoder.embed([crop])[0]
        stages["encode"], started = _lap(started)
        if not np.isfinite(embedding).all():
            return Look(None, stages, "the encoder gave no finite embedding", is_our_fault=True)
        evidence = self._gallery.match(embedding)
        stages["match"], _ = _lap(started)
        return Look(evidence, stages)

    def _is_unchanged(self, subject: str, crop: pictures.Crop) -> bool:
        signature = pictures.signature(crop)
        before = self._seen.get(subject)
        if before is not None and not pictures.has_changed(before, signature):
            return True
        self._seen[subject] = signature
        self._seen.move_to_end(subject)
        if len(self._seen) > MAX_SEEN:
            self._seen.popitem(last=False)
        return False


def _lap(started: float) -> tuple[float, float]:
    now = time.perf_counter()
    return (now - started) * 1000.0, now
