"""The recogniser: a process of its own that decodes pictures, embeds them and matches the gallery.

The gateway hands it one frame at a time and gets evidence back. Knows no sockets and no sessions.
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

from hapticvlm.evidence.ladder import Evidence
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
from hapticvlm.vision.encoders.encoder import EncoderError
from hapticvlm.vision.encoders.loading import load_encoder
from hapticvlm.vision.frame_recogniser import FrameRecogniser, Recognition, SceneContext
from hapticvlm.vision.galleries.storage import load_gallery
from hapticvlm.vision.galleries.user_materials import UserMaterial, table_with
from hapticvlm.vision.pictures import Thumbnail
from hapticvlm.vision.remote.settings import RemoteSettings, RemoteState

if TYPE_CHECKING:
    from hapticvlm.vision.remote.client import RemoteRecogniser

NICE = 5
# ours takes 25 ms, and a second on a busy machine; others more
LIMIT_S = 5.0
NAMED_LIMIT_S = 20.0
SHOWN_PX = 640  # longest side of a picture shown to observers
DOWNLOAD_S = 600.0  # a named network may first have to come over the network

logger = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True)
class RecogniserSettings:
    """What to load (None = what ships with the package), what to run it on, whom else to ask.

    `own` are the materials of the gallery folder that the rest of the service knows.
    """

    encoder: str | None = None
    gallery: Path | None = None
    own: tuple[UserMaterial, ...] = ()
    device: str = "cpu"
    threads: int = 1
    remote: RemoteSettings | None = None

    @property
    def start_s(self) -> float:
        """How long loading may take, s."""
        return START_S if self.encoder is None else DOWNLOAD_S

    @property
    def limit_s(self) -> float:
        """How long one recognition may take before the process counts as hung, s."""
        return LIMIT_S if self.encoder is None else NAMED_LIMIT_S


@dataclass(frozen=True, slots=True)
class Loaded:
    """What the recogniser runs."""

    encoder: str = "none"
    gallery: str = "none"


@dataclass(frozen=True, slots=True)
class RecogniserResult:
    """What came of one frame, the small picture of it if that was asked for.

    `remote`: how the shared recogniser stands, if one is named.
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
        """What it runs."""
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

        `subject` names what it shows, to notice an unchanged picture; `force` = even if unchanged;
        `shrink` = return a small picture of it too; `shown` = which object of which scene.
        """
        # The frame goes into the shared memory of the worker as bytes, whole and once: megabytes
        # through a pipe would hold up the event loop while the other side reads. Nothing here may
        # touch that memory until the answer is there or the worker was given up, which `is_busy`
        # says.
        data = msgspec.msgpack.encode(frame)
        self.worker.request(data, (subject, now, force, shrink, shown), now)

    def note(self, remote: RemoteState | None) -> None:
        """Note the state of the shared recogniser; log a change of it."""
        before = self.remote
        self.remote = remote
        if remote is None or _standing(remote) == _standing(before):
            return
        if remote.is_used:
            logger.info("objects are recognised by %s", remote.identity)
        else:
            logger.warning("objects are recognised on this machine: %s", remote.reason)

    def close(self) -> None:
        """Stop the process."""
        self.worker.close()


def _standing(remote: RemoteState | None) -> tuple[bool, str, bool]:
    """Pick what is worth a line when it changes; a reason is, but not each wording of it."""
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
            raise RuntimeError(f"cannot load the models: {error}") from error
        gallery = settings.gallery.resolve().name if settings.gallery else "shipped"

        def serve(data: bytes, details: tuple[Any, ...]) -> RecogniserResult:
            found = _recognise(recogniser, data, *details)
            return found if remote is None else replace(found, remote=remote.state)

        return Started((encoder, gallery)), serve

    serve_requests(slot, control, load)


class NullRecogniser:
    """Stands in where the shipped encoder's network is not installed: it finds nothing.

    What the scene states, names and shaders still decide.
    """

    def recognise(
        self,
        _data: bytes,
        _subject: str,
        waited_ms: float,
        *,
        force: bool,
        shown: SceneContext | None,
    ) -> Recognition:
        """Return evidence of nothing, whatever is shown."""
        del force, shown
        return Recognition(Evidence("encoder", ()), {"queue": waited_ms})


def _load(
    settings: RecogniserSettings,
) -> tuple[FrameRecogniser | NullRecogniser, str, RemoteRecogniser | None]:
    try:
        # The packaged network comes from another package, which a user may have removed or
        # replaced. Then objects are still known by what the scene states, by names and shaders, so
        # the service runs on and says so. Who names a network wants that one, and gets an error
        # instead.
        encoder = load_encoder(settings.encoder, device=settings.device, threads=settings.threads)
    except EncoderError as error:
        if settings.encoder is not None:  # who names one wants that one
            raise
        logger.warning("pictures are not recognised: %s", error)
        return NullRecogniser(), Loaded().encoder, None
    remote = None
    if settings.remote is not None:
        from hapticvlm.vision.remote.client import RemoteRecogniser

        remote = RemoteRecogniser(settings.remote, table_with(settings.own))
    gallery = load_gallery(settings.gallery, encoder=encoder, own=settings.own)
    recogniser = FrameRecogniser(encoder, gallery, remote)
    # The first inference allocates all that later ones use again and takes much longer. It happens
    # here, while the service still says that it is starting, and it shows a network that loads and
    # cannot run before a scene has to find out.
    recogniser.warm_up()
    return recogniser, encoder.name, remote


def _recognise(
    recogniser: FrameRecogniser | NullRecogniser, data: bytes, *details: Any
) -> RecogniserResult:
    subject, requested_at, force, shrink, shown_object = details
    waited_ms = (time.monotonic() - requested_at) * 1000.0
    try:
        recognition = recogniser.recognise(
            data, subject, waited_ms, force=force, shown=shown_object
        )
        shown = _thumbnail(data) if shrink and recognition.error is None else None
        return RecogniserResult(recognition, shown)
    except Exception:  # a picture that trips a bug of ours must not take the others down
        logger.exception("a recognition failed")
        text = "recognising this picture failed"
        return RecogniserResult(Recognition(None, {}, error=text, is_our_fault=True))


def _thumbnail(data: bytes) -> Thumbnail:
    return pictures.thumbnail(msgspec.msgpack.decode(data, type=Frame), SHOWN_PX)
