"""Runs a vision-language model in its own process and asks it about frames.

The model loads while the service already runs. The process answers one question at a time, and is
killed and restarted when an answer takes too long. A model that fails to load twice in a row is
given up and reported as absent. Every question gets a reply, which may be an error. Knows no client
sockets and no sessions; a picture leaves this machine only if the settings name a URL.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from multiprocessing.connection import Connection

import msgspec

from hapticvlm.errors import out_of_memory
from hapticvlm.evidence.ladder import Evidence
from hapticvlm.evidence.reading import Reading
from hapticvlm.messages import Frame
from hapticvlm.processes.model_worker import (
    ModelWorker,
    Serve,
    Slot,
    WorkerPlan,
    WorkerReply,
    serve_requests,
)
from hapticvlm.processes.priority import lower_priority
from hapticvlm.processes.supervised import Started
from hapticvlm.vlm.contract import Vlm, VlmError, VlmSettings
from hapticvlm.vlm.limits import GRACE_S, LOAD_S, LOADS, NICE, SIDE


@dataclass(frozen=True, slots=True)
class Question:
    """A question about a frame: the material of its object among `names`, or, with (), ambient."""

    frame: Frame
    names: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class VlmReply:
    """The model's reply: a reading, evidence, or an error."""

    reading: Reading | None = None
    evidence: Evidence | None = None
    error: str | None = None

    @property
    def value(self) -> Reading | Evidence | None:
        """The reading or the evidence; None after an error."""
        return self.reading or self.evidence


class VlmWorker:
    """The gateway's end: one question at a time, replies through a callback from a thread."""

    def __init__(self, settings: VlmSettings) -> None:
        self.settings = settings
        self.absent: str | None = None
        limit_s = settings.timeout_s + GRACE_S
        self.worker: ModelWorker[VlmReply] = ModelWorker(
            WorkerPlan("vlm", run_vlm, settings, VlmReply, limit_s, LOAD_S)
        )
        self._failed_loads = 0

    @property
    def name(self) -> str | None:
        """The name of the model; None until one was loaded."""
        return next(iter(self.worker.names), None)

    @property
    def is_busy(self) -> bool:
        """Whether it cannot take a question now: another one runs, or the model is not loaded."""
        return self.worker.is_busy

    def start(self, deliver: Callable[[WorkerReply[VlmReply]], None]) -> None:
        """Start the process and return."""
        self.worker.begin(deliver)

    def ask(self, question: Question, now: float) -> None:
        """Hand over one question; only while not busy."""
        data = msgspec.msgpack.encode(question.frame)
        self.worker.request(data, (question.names,), now)

    def supervise(self, now: float) -> str | None:
        """Restart a dead or late process; return a message if anything happened."""
        if self.absent is not None:
            return None
        trouble = self.worker.supervise(now)
        if self.worker.is_ready:
            self._failed_loads = 0
        if trouble is None:
            return None
        self._failed_loads = self._failed_loads + 1 if self.name is None else 0
        if self._failed_loads >= LOADS:
            self.worker.close()
            self.absent = f"{trouble.rsplit(';', 1)[0]}; given up, ambient_c falls to the default"
            return self.absent
        return trouble

    def close(self) -> None:
        """Stop the process."""
        self.worker.close()


def run_vlm(slot: Slot, settings: VlmSettings, control: Connection) -> None:
    """Entry point of the process; ends when the gateway is gone."""
    lower_priority(NICE)

    def load() -> tuple[Started, Serve]:
        try:
            from hapticvlm.vlm.local import load_vlm

            vlm = load_vlm(settings)
        except Exception as error:
            reason = out_of_memory(error) or error
            raise RuntimeError(f"cannot load the vlm: {reason}") from error
        return Started((vlm.name,)), lambda data, details: reply(
            vlm, Question(msgspec.msgpack.decode(data, type=Frame), *details)
        )

    serve_requests(slot, control, load)


def reply(vlm: Vlm, question: Question) -> VlmReply:
    """Ask the model; an error of any kind is a reply."""
    from hapticvlm.vision import pictures
    from hapticvlm.vision.pictures import PictureError
    from hapticvlm.vlm.contract import box, highlight

    started = time.monotonic()
    try:
        picture, region = pictures.whole(question.frame, SIDE)
        if not question.names:
            return VlmReply(reading=vlm.ambient(picture))
        top, left, bottom, right = box(picture, region)
        crop = picture[top:bottom, left:right]
        return VlmReply(evidence=vlm.material(highlight(picture, region), crop, question.names))
    except (VlmError, PictureError) as error:
        return VlmReply(error=str(error))
    except Exception as error:  # noqa: BLE001 - a model's exception must not end the process
        seconds = time.monotonic() - started
        return VlmReply(error=f"{type(error).__name__} after {seconds:.1f} s: {error}")
