"""The onlooker: a process of its own that asks a vision-language model about a frame.

It loads while the service already runs, answers one question at a time, and is ended and started
again when it takes longer than it may; one that cannot be loaded twice running is given up and said
to be absent. No answer is an answer too: whoever asked is always told. Knows no sockets of clients
and no sessions; a picture leaves this machine only when the settings name a url.
"""

from __future__ import annotations

import ctypes
import multiprocessing
import os
import signal
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from math import ceil
from multiprocessing.connection import Connection
from typing import Any

import msgspec
import numpy as np

from hapticvlm.messages import Frame, Region
from hapticvlm.processes.recogniser import SLOT_BYTES
from hapticvlm.processes.supervised import Child
from hapticvlm.recognition.ladder import Evidence
from hapticvlm.recognition.vlm.answers import Picture, Reading, Vlm, VlmError, VlmSettings

LOAD_S = 900.0  # a model may first have to come over the network
GRACE_S = 5.0  # beyond the model's own time limit, before the process is ended
TRIES = 2
NICE = 15
SIDE = 448  # px, more than any image-token budget here needs


@dataclass(frozen=True, slots=True)
class Question:
    """What to ask of a frame: the ambient temperature, or which of `names` its object is."""

    frame: Frame
    names: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Answer:
    """What the model said: a reading, evidence, or why there is neither."""

    number: int
    what: Reading | Evidence | None
    error: str | None = None


class Onlooker:
    """The gateway's end: one question at a time, answers through a callback from a thread."""

    def __init__(self, settings: VlmSettings) -> None:
        self.settings = settings
        self._slot = multiprocessing.get_context("spawn").RawArray("B", SLOT_BYTES)
        self._bytes = np.frombuffer(memoryview(self._slot), np.uint8)
        self._child = Child("vlm", run_onlooker, self._arguments, self._ready, LOAD_S)
        self._tell: Callable[[Answer], None] | None = None
        self._asked_at: float | None = None
        self._asked = 0
        self._failed_loads = 0
        self.absent: str | None = None
        self.name: str | None = None

    @property
    def is_busy(self) -> bool:
        """Whether it cannot take a question now: one is under way, or it is not ready."""
        return self._asked_at is not None or self._child.ready_at is None

    @property
    def restarts(self) -> int:
        """How often the process had to be restarted."""
        return self._child.restarts

    @property
    def pid(self) -> int | None:
        """Process id of the onlooker."""
        return self._child.pid

    def start(self, tell: Callable[[Answer], None]) -> None:
        """Start the process and return; `tell` is called from a thread and must only pass on."""
        self._tell = tell
        self._child.begin()

    def ask(self, question: Question, now: float) -> None:
        """Hand over one question; only while not busy."""
        data = msgspec.msgpack.encode(msgspec.structs.replace(question.frame, id=1))
        self._bytes[: len(data)] = np.frombuffer(data, np.uint8)
        self._asked_at = now
        self._asked += 1
        with suppress(OSError):
            self._child.control.send((self._asked, len(data), question.names))

    def done(self, answer: Answer) -> bool:
        """Take note of an answer; false if it is to a question given up."""
        if answer.number != self._asked or self._asked_at is None:
            return False
        self._asked_at = None
        return True

    def supervise(self, now: float) -> str | None:
        """Restart a dead or late process; return what happened, if anything."""
        if self.absent is not None:
            return None
        late_s = self.settings.timeout_s + GRACE_S
        is_late = self._asked_at is not None and now - self._asked_at > late_s
        trouble = self._child.supervise(now, is_well=not is_late)
        if trouble is None:
            return None
        self._asked_at = None
        self._asked += 1
        self._failed_loads = self._failed_loads + 1 if self.name is None else 0
        if self._failed_loads >= TRIES:
            self._child.close(0.0)
            self.absent = f"{trouble.rsplit(';', 1)[0]}; given up, ambient_c falls to the default"
            return self.absent
        return trouble

    def close(self) -> None:
        """Stop the process."""
        self._child.close(0.0)

    def _arguments(self) -> tuple[Any, ...]:
        return self._slot, self.settings

    def _ready(self, name: str) -> None:
        self.name, self._failed_loads = name, 0
        control, tell = self._child.control, self._tell
        assert tell is not None

        def read() -> None:
            with suppress(EOFError, OSError):
                while True:
                    tell(control.recv())

        threading.Thread(target=read, name="vlm answers", daemon=True).start()


def run_onlooker(
    slot: ctypes.Array[ctypes.c_ubyte], settings: VlmSettings, control: Connection
) -> None:
    """Entry point of the process; ends when the gateway is gone."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    if hasattr(os, "nice"):
        os.nice(NICE)
    try:
        from hapticvlm.recognition.vlm.load import load_vlm

        vlm = load_vlm(settings)
    except Exception as error:  # noqa: BLE001 - the gateway must hear why, whatever a model threw
        control.send(("failed", f"cannot load the vlm: {error}"))
        return
    control.send(("ready", vlm.name))
    data = np.frombuffer(memoryview(slot), np.uint8).data
    with suppress(EOFError, OSError):
        while True:
            number, length, names = control.recv()
            frame = msgspec.msgpack.decode(bytes(data[:length]), type=Frame)
            control.send(answer(vlm, number, Question(frame, names)))
    vlm.close()


def answer(vlm: Vlm, number: int, question: Question) -> Answer:
    """Ask the model; an error of any kind is an answer."""
    from hapticvlm.recognition import pictures
    from hapticvlm.recognition.vlm.prompts import highlight

    started = time.monotonic()
    try:
        picture, region = pictures.whole(question.frame, SIDE)
        if not question.names:
            return Answer(number, vlm.ambient(picture))
        context = highlight(picture, region)
        return Answer(number, vlm.material(context, _within(picture, region), question.names))
    except (VlmError, pictures.PictureError) as error:
        return Answer(number, None, str(error))
    except Exception as error:  # noqa: BLE001 - whatever a model throws must not end the process
        seconds = time.monotonic() - started
        return Answer(number, None, f"{type(error).__name__} after {seconds:.1f} s: {error}")


def _within(picture: Picture, region: Region) -> Picture:
    height, width = picture.shape[:2]
    top, left = int(region.y * height), int(region.x * width)
    bottom, right = ceil((region.y + region.h) * height), ceil((region.x + region.w) * width)
    return picture[top:bottom, left:right]
