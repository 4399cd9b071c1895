"""Runs the recogniser in its own process: decodes pictures, embeds them and matches the gallery.

The gateway hands over one frame at a time and gets evidence back. A frame travels as one message of
MessagePack in shared memory and is decoded once, in the child. Knows no sockets and no sessions.
"""

from __future__ import annotations

import logging
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from multiprocessing.connection import Connection
from pathlib import Path
from typing import TYPE_CHECKING, Any

import msgspec

from hapticvlm.errors import out_of_memory
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
from hapticvlm.processes.supervised import START_S, Started
from hapticvlm.vision import pictures
from hapticvlm.vision.pictures import Thumbnail
from hapticvlm.vision.recognition import Recognition, SceneContext
from hapticvlm.vision.remote.settings import RemoteSettings, RemoteState

if TYPE_CHECKING:
    from hapticvlm.vision.frame_recogniser import FrameRecogniser
    from hapticvlm.vision.galleries.user_materials import UserMaterial
    from hapticvlm.vision.remote.client import RemoteRecogniser

NICE = 5
# The shipped encoder takes 25 ms at most, a second on a busy machine; other networks take longer.
LIMIT_S = 5.0
NAMED_LIMIT_S = 20.0
SHOWN_PX = 640  # longest side of a picture shown to observers
DOWNLOAD_S = 600.0  # a named network may have to be downloaded first

logger = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True)
class RecogniserSettings:
    """The encoder and gallery to load (None: the shipped ones), the device, a shared recogniser.

    `user_materials` are those of the gallery folder, as the rest of the service knows them.
    """

    encoder: str | None = None
    gallery: Path | None = None
    user_materials: tuple[UserMaterial, ...] = ()
    device: str = "cpu"
    threads: int = 1
    remote: RemoteSettings | None = None

    @property
    def start_s(self) -> float:
        """Longest time that loading may take, s."""
        return START_S if self.encoder is None else DOWNLOAD_S

    @property
    def limit_s(self) -> float:
        """Longest time of one recognition, s; then the process counts as hung."""
        is_loaded = self.encoder is None and self.remote is None  # else a first look may load it
        return LIMIT_S if is_loaded else NAMED_LIMIT_S


@dataclass(frozen=True, slots=True)
class Loaded:
    """The names of the encoder and the gallery that the recogniser runs."""

    encoder: str = "none"
    gallery: str = "none"


@dataclass(frozen=True, slots=True)
class RecogniserResult:
    """The recognition of one frame, and a thumbnail of it if one was asked for.

    `remote` is the state of the shared recogniser; None: none is named.
    """

    recognition: Recognition
    shown: Thumbnail | None = None
    remote: RemoteState | None = None


class RecogniserWorker:
    """The gateway's end: one recognition at a time, answers through a callback from a thread."""

    def __init__(self, settings: RecogniserSettings) -> None:
        limit_s = settings.limit_s
        start_s = settings.start_s
        self.worker: ModelWorker[RecogniserResult] = ModelWorker(
            WorkerPlan("recogniser", run_recogniser, settings, RecogniserResult, limit_s, start_s)
        )
        self.remote: RemoteState | None = None

    @property
    def loaded(self) -> Loaded:
        """The names of the loaded encoder and gallery."""
        return Loaded(*self.worker.names)

    def start(self, deliver: Callable[[WorkerReply[RecogniserResult]], None]) -> None:
        """Start the process and wait until its models are loaded. Raises ChildError."""
        self.worker.start(deliver)

    def recognise(
        self,
        frame: Frame,
        subject: str,
        now: float,
        *,
        force: bool,
        shrink: bool = False,
        shown: SceneContext | None = None,
    ) -> None:
        """Hand over one frame; only while not busy.

        `subject` names what the frame shows, so that an unchanged picture is noticed. `force`:
        recognise it even if unchanged. `shrink`: return a thumbnail too. `shown`: the object and
        its scene.
        """
        # The frame is written to the worker's shared memory, because megabytes through a pipe would
        # block the event loop while the child reads. Nothing here may write to that memory again
        # until the reply has arrived or the request was given up; `is_busy` tells.
        data = msgspec.msgpack.encode(frame)
        self.worker.request(data, (subject, now, force, shrink, shown), now)

    def note(self, remote: RemoteState | None) -> None:
        """Keep the state of the shared recogniser; log a change of it."""
        before = self.remote
        self.remote = remote
        if remote is None or _logged_state(remote) == _logged_state(before):
            return
        if remote.is_used:
            logger.info("objects are recognised by %s", remote.identity)
        else:
            logger.warning("objects are recognised on this machine: %s", remote.reason)

    def close(self) -> None:
        """Stop the process."""
        self.worker.close()


def _logged_state(remote: RemoteState | None) -> tuple[bool, str, bool]:
    """Return the part of a state whose change is logged; a reason's wording is not."""
    if remote is None:
        return False, "", False
    return remote.is_used, remote.identity, bool(remote.reason)


def run_recogniser(slot: Slot, settings: RecogniserSettings, control: Connection) -> None:
    """Entry point of the recogniser process; ends when the gateway is gone."""
    lower_priority(NICE)

    def load() -> tuple[Started, Serve]:
        try:
            recogniser, encoder, remote = _load(settings)
        except Exception as error:
            reason = out_of_memory(error) or error
            raise RuntimeError(f"cannot load the models: {reason}") from error
        gallery = settings.gallery.resolve().name if settings.gallery else "shipped"

        def serve(data: bytes, details: tuple[Any, ...]) -> RecogniserResult:
            result = _recognise(recogniser, data, *details)
            return result if remote is None else replace(result, remote=remote.state)

        return Started((encoder, gallery)), serve

    serve_requests(slot, control, load)


def _load(
    settings: RecogniserSettings,
) -> tuple[FrameRecogniser, str, RemoteRecogniser | None]:
    # In this process alone: the gateway, which imports this file to start it, loads no model.
    from hapticvlm.cache_folder import cache_folder
    from hapticvlm.vision.frame_recogniser import FrameRecogniser
    from hapticvlm.vision.galleries.storage import load_gallery
    from hapticvlm.vision.galleries.user_materials import table_with
    from hapticvlm.vision.loading import load_encoder
    from hapticvlm.vision.texture_verdicts import TextureVerdicts, file_name

    remote = None
    is_spare = False  # a shared recogniser answers, so the own one may never be needed
    if settings.remote is not None:
        from hapticvlm.vision.remote.client import RemoteRecogniser

        remote = RemoteRecogniser(settings.remote, table_with(settings.user_materials))
        is_spare = remote.find()
    encoder = load_encoder(
        settings.encoder, device=settings.device, threads=settings.threads, on_use=is_spare
    )
    gallery = load_gallery(
        settings.gallery, encoder=encoder, user_materials=settings.user_materials
    )
    name = file_name(encoder, gallery)
    verdicts = TextureVerdicts(None if name is None else cache_folder() / name)
    recogniser = FrameRecogniser(encoder, gallery, remote, verdicts)
    # The first inference allocates buffers that later ones reuse, and takes much longer. It runs
    # here, while the service still reports that it is starting. It also fails here for a network
    # that loads but cannot run, before a scene depends on it.
    if not is_spare:
        recogniser.warm_up()
    return recogniser, encoder.name, remote


def _recognise(recogniser: FrameRecogniser, data: bytes, *details: Any) -> RecogniserResult:
    subject, requested_at, force, shrink, shown_object = details
    waited_ms = (time.monotonic() - requested_at) * 1000.0
    try:
        frame = msgspec.msgpack.decode(data, type=Frame)
        recognition = recogniser.recognise(
            frame, subject, waited_ms, force=force, shown=shown_object
        )
        thumbnail = None
        if shrink and recognition.error is None:
            thumbnail = pictures.thumbnail(frame, SHOWN_PX)
        return RecogniserResult(recognition, thumbnail)
    except Exception:  # one picture that triggers a bug of ours must not stop all others
        logger.exception("recognising a picture failed")
        reason = "recognising this picture failed"
        return RecogniserResult(Recognition(None, {}, error=reason, is_our_fault=True))
