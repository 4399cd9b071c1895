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
from collections import deque
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, replace
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any, Generic, TypeVar

import msgspec
import numpy as np

from hapticvlm.messages import MAX_MESSAGE_BYTES, Frame
from hapticvlm.processes.supervised import START_S, Child
from hapticvlm.recognition.encoders.loading import load_encoder
from hapticvlm.recognition.frame_recogniser import FrameRecogniser, Recognition
from hapticvlm.recognition.galleries.gallery import load_gallery
from hapticvlm.recognition.galleries.user_materials import UserMaterial

MAX_ENROL_PER_OBJECT = 8
MAX_ENROL_BYTES = 32 * 1024 * 1024
NICE = 5
SLOT_BYTES = MAX_MESSAGE_BYTES + 4096
STUCK_S = 20.0
DOWNLOAD_S = 600.0  # a named network may first have to come over the network

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
    """What to load (None = what ships with the package), and what to run it on.

    `own` are the materials of the gallery folder that the rest of the service knows.
    """

    encoder: str | None = None
    gallery: Path | None = None
    own: tuple[UserMaterial, ...] = ()
    device: str = "cpu"
    threads: int = 1

    @property
    def start_s(self) -> float:
        """How long loading may take, s."""
        return START_S if self.encoder is None else DOWNLOAD_S


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
        self._child = Child(
            "recogniser", run_recogniser, self._arguments, self._begin, settings.start_s
        )
        self._answer: Callable[[Recognition], None] | None = None
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

    def start(self, answer: Callable[[Recognition], None]) -> None:
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

    def done(self, look: Recognition) -> bool:
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
        encoder = load_encoder(settings.encoder, device=settings.device, threads=settings.threads)
        recogniser = FrameRecogniser(
            encoder, load_gallery(settings.gallery, encoder=encoder, own=settings.own)
        )
        recogniser.warm_up()
    except Exception as error:  # noqa: BLE001 - the gateway must hear why, whatever a model threw
        control.send(("failed", f"cannot load the models: {error}"))
        return
    gallery_name = settings.gallery.resolve().name if settings.gallery else "shipped"
    control.send(("ready", Loaded(encoder.name, gallery_name)))
    data = np.frombuffer(memoryview(slot), np.uint8).data
    with suppress(EOFError, OSError):
        while True:
            number, length, subject, asked_at, anew = control.recv()
            waited_ms = (time.monotonic() - asked_at) * 1000.0
            try:
                look = recogniser.recognise(bytes(data[:length]), subject, waited_ms, anew=anew)
            except Exception:  # a picture that trips a bug of ours must not take the others down
                logger.exception("a look failed")
                look = Recognition(
                    None, {}, error="looking at this picture failed", is_our_fault=True
                )
            control.send(replace(look, number=number))


def _lower_priority() -> None:
    if hasattr(os, "sched_setscheduler"):
        with suppress(OSError):
            os.sched_setscheduler(0, os.SCHED_OTHER, os.sched_param(0))
    if hasattr(os, "nice"):
        os.nice(NICE)
