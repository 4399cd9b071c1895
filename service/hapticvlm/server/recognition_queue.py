"""Queues frames for the recogniser, chooses the next one, and delivers the results.

One frame is recognised at a time. The connection that owns the outputs comes first; the others take
turns. Of each connection and hand only the newest frame waits; frames to enrol keep their order and
are bounded for all connections together. Texture maps come last of all: one is read when no other
frame of any connection is due.
"""

from __future__ import annotations

import time
from collections import Counter, deque
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from typing import Generic, TypeVar

from hapticvlm.messages import Error, ErrorCode, Frame, ServiceMessage, Skipped, View
from hapticvlm.processes.model_worker import WorkerReply
from hapticvlm.server.connection import Connection, Event
from hapticvlm.server.counters import Count, refused
from hapticvlm.server.edge.limits import ENROL_BYTES, RECOGNITION_RATE, TokenBucket
from hapticvlm.server.edge.scheduling import call_after_io
from hapticvlm.session.actions import Action, Reply
from hapticvlm.session.targets import (
    HandRegion,
    ObjectTarget,
    RecognitionRequest,
    Surroundings,
    TextureTarget,
    name_of,
)
from hapticvlm.vision.pictures import Thumbnail
from hapticvlm.vision.recognition import SceneContext
from hapticvlm.vision.worker import SHOWN_PX, RecogniserResult, RecogniserWorker

MAX_ENROL_PER_OBJECT = 8
MAX_TEXTURES = 16  # that wait, of one connection
SCENE_SLOT = "scene"  # beside those of the hands: the newest view of the surroundings waits there
VIEW_S = 0.5
MAX_VIEWED = 256
PATIENCE_S = 5.0  # that a frame waits for a recogniser that is being started again
SHOWN_BYTES = 256 * 1024  # text observers get a third more, and all of it in one go

T = TypeVar("T")
Deliver = Callable[[Connection, list[Action]], None]


class QueueFull(Exception):
    """Too much waits to be enrolled; the client sends too fast."""


class Mailbox(Generic[T]):
    """The newest live item, the newest for each hand, and a queue of those to enrol.

    Regions under a hand come first; live frames and frames to enrol take turns after them.
    """

    def __init__(self) -> None:
        self._live: T | None = None
        self._touched: dict[str, T] = {}
        self._enrol: deque[tuple[T, str | None, int]] = deque()
        self._enrol_next = False
        self._textures: deque[tuple[T, int]] = deque()
        self.enrol_bytes = 0
        self.texture_bytes = 0

    def __bool__(self) -> bool:
        return bool(self.waiting())

    def put_live(self, item: T) -> T | None:
        """Keep the newest live frame; return the one it supersedes."""
        superseded = self._live
        self._live = item
        return superseded

    def put_touch(self, item: T, hand: str) -> T | None:
        """Keep the newest for this hand; return the one it supersedes."""
        superseded = self._touched.get(hand)
        self._touched[hand] = item
        return superseded

    def put_enrol(self, item: T, object_id: str | None, size_bytes: int) -> None:
        """Queue a view of an object. Raises QueueFull."""
        same = sum(waiting[1] == object_id for waiting in self._enrol)
        if same >= MAX_ENROL_PER_OBJECT:
            raise QueueFull
        self._enrol.append((item, object_id, size_bytes))
        self.enrol_bytes += size_bytes

    def put_texture(self, item: T, size_bytes: int) -> None:
        """Queue a texture map. Raises QueueFull."""
        if len(self._textures) >= MAX_TEXTURES:
            raise QueueFull
        self._textures.append((item, size_bytes))
        self.texture_bytes += size_bytes

    def take_texture(self) -> T | None:
        """Remove and return the texture map that waits longest."""
        if not self._textures:
            return None
        item, size_bytes = self._textures.popleft()
        self.texture_bytes -= size_bytes
        return item

    def waiting(self) -> list[T]:
        """Return everything that waits."""
        live = [] if self._live is None else [self._live]
        enrol = [item for item, _, _ in self._enrol]
        textures = [item for item, _ in self._textures]
        return [*self._touched.values(), *live, *enrol, *textures]

    def take(self, is_due: Callable[[T], bool]) -> T | None:
        """Remove and return what is to be recognised next; a live frame only where `is_due`."""
        if self._touched:
            return self._touched.pop(next(iter(self._touched)))
        # After a live frame it is the turn of one to be enrolled, and the other way round. With a
        # fixed order a scene at 60 frames a second would keep its own frames to enrol waiting for
        # ever, or eight views of each of its objects would delay the live frame.
        if self._enrol and self._enrol_next:
            return self._take_enrol()
        if self._live is not None and is_due(self._live):
            self._enrol_next = True
            newest = self._live
            self._live = None
            return newest
        return self._take_enrol() if self._enrol else None

    def _take_enrol(self) -> T:
        self._enrol_next = False
        item, _, size_bytes = self._enrol.popleft()
        self.enrol_bytes -= size_bytes
        return item


@dataclass(frozen=True, slots=True)
class _UnderWay:
    """The request that the recogniser works on, its connection, and whether observers see it."""

    connection: Connection
    request: RecognitionRequest
    is_shown: bool


class RecognitionQueue:
    """Feeds the recogniser from a mailbox for each connection that has joined.

    All of it runs on the event loop, so no two methods run at once and nothing is locked. The
    recogniser works on one picture at a time: after `put` and `accept` a turn of the loop feeds it
    the next one if it is idle. An answer belongs to the request under way or to none: one that was
    given up (a restart, a connection that left) is dropped by its number. A message that
    waits for an answer gets exactly one: a decision, `skipped` with its reason, or an error.
    """

    def __init__(
        self, recogniser: RecogniserWorker, counts: Counter[Count], deliver: Deliver
    ) -> None:
        self._recogniser = recogniser
        self._counts = counts
        self._deliver = deliver
        self._mailboxes: dict[
            Connection, Mailbox[RecognitionRequest]
        ] = {}  # in order of their turns
        self._under_way: _UnderWay | None = None
        self._shown_at: dict[tuple[Connection, str | None], float] = {}  # by object
        self._rates: dict[Connection, TokenBucket] = {}
        self._away_since: float | None = None

    def join(self, connection: Connection) -> None:
        """Give a connection its place, behind all others."""
        self._mailboxes[connection] = Mailbox()
        self._rates[connection] = TokenBucket(RECOGNITION_RATE, time.monotonic())

    def leave(self, connection: Connection) -> None:
        """Drop the requests of a connection; an answer under way goes to nobody."""
        self._mailboxes.pop(connection, None)
        self._rates.pop(connection, None)
        for shown in [shown for shown in self._shown_at if shown[0] is connection]:
            del self._shown_at[shown]

    def put(self, connection: Connection, request: RecognitionRequest) -> list[ServiceMessage]:
        """Queue a request of a session; return the answers that can be given at once."""
        try:
            superseded = self._queue(self._mailboxes[connection], request)
        except QueueFull:
            self._counts[Count.REFUSED_OVERLOAD] += 1
            if request.reply_to is None:  # it was only to be a reference; another picture will be
                return []
            kind = request.picture.purpose
            text = f"too many {kind} frames wait: send more when some of these are decided"
            return [Error(id=request.reply_to.value, code="overload", text=text, path="$.purpose")]
        answers: list[ServiceMessage] = []
        if superseded is not None:
            self._counts[Count.FRAMES_SUPERSEDED] += 1
            if superseded.reply_to is not None:
                answers.append(Skipped(id=superseded.reply_to.value, reason="superseded"))
        self._feed_soon()
        return answers

    @property
    def is_waiting(self) -> bool:
        """Whether a frame waits that the recogniser could take now."""
        return not self._recogniser.worker.is_busy and any(map(bool, self._mailboxes.values()))

    def feed(self) -> None:
        """Give the recogniser the next frame if it is idle."""
        if self._recogniser.worker.is_busy:
            return
        now = time.monotonic()
        for connection, request in self._candidates(now):
            if request is None:
                continue
            # A dict keeps the order in which its keys were put in. Taking a connection out and
            # putting it back makes it the last, so three scenes get a third of the recogniser each,
            # whatever they send. The owner comes first in any case: what its hand touches is felt
            # now.
            self._mailboxes[connection] = self._mailboxes.pop(connection)  # behind all others
            self._begin(connection, request, now)
            return

    def accept(self, reply: WorkerReply[RecogniserResult]) -> None:
        """Deliver the recogniser's answer; one to a request that was given up is dropped."""
        now = time.monotonic()
        # Answers come from a thread that reads the worker's pipe, through the event loop. Between
        # the answer and this call the worker may have been given up and started again; then the
        # number does not fit, and the frame of its successor must not get the answer of this one.
        if not self._recogniser.worker.accept(reply, now):
            self._counts[Count.LATE_ANSWERS] += 1
            return
        self._recogniser.note(reply.value.remote)
        under_way = self._under_way
        self._under_way = None
        # To take the answer, to decide, and to copy the next frame over would together hold the
        # loop for half a millisecond. Each has a turn of its own: a touch that came meanwhile goes
        # between.
        call_after_io(self._answer, under_way, reply.value)

    def fail(self, text: str) -> None:
        """Answer the waiting client that the recogniser was restarted."""
        under_way = self._under_way
        self._under_way = None
        if under_way is not None and under_way.connection in self._mailboxes:
            reply_to = under_way.request.reply_to
            if reply_to is not None:
                under_way.connection.post(Error(id=reply_to.value, code="model", text=text))

    def answer_without(self, now: float) -> None:
        """Answer all that waits by an error, once the recogniser was away for PATIENCE_S."""
        if self._recogniser.worker.is_ready:
            self._away_since = None
            return
        self._away_since = now if self._away_since is None else self._away_since
        if now - self._away_since < PATIENCE_S:
            return
        for connection, mailbox in self._mailboxes.items():
            self._mailboxes[connection] = Mailbox()
            for request in mailbox.waiting():
                if request.reply_to is not None:
                    text = "the recogniser is being started again: send this frame later"
                    connection.post(Error(id=request.reply_to.value, code="model", text=text))

    def _feed_soon(self) -> None:
        """Give the recogniser the next frame in a turn of its own."""
        if not self._recogniser.worker.is_busy:
            call_after_io(self.feed)

    def _answer(self, under_way: _UnderWay | None, answer: RecogniserResult) -> None:
        now = time.monotonic()  # later than all that the session has heard meanwhile
        if under_way is not None and under_way.connection in self._mailboxes:  # it has not left
            if under_way.is_shown:
                self._show(under_way, answer.shown)
            self._deliver(under_way.connection, self._actions(under_way, answer, now))
        self._feed_soon()

    def _queue(
        self, mailbox: Mailbox[RecognitionRequest], request: RecognitionRequest
    ) -> RecognitionRequest | None:
        """Put a request where its kind waits; return the one it supersedes. Raises QueueFull."""
        match request.target:
            case TextureTarget():
                size = self._require_room(request)
                mailbox.put_texture(request, size)
                return None
            case HandRegion(hand):
                return mailbox.put_touch(request, hand)
            case Surroundings():
                return mailbox.put_touch(request, SCENE_SLOT)
            case _ if request.picture.purpose == "enrol" or request.reference_material is not None:
                size = self._require_room(request)
                mailbox.put_enrol(request, request.picture.object_id, size)
                return None
            case _:
                return mailbox.put_live(request)

    def _require_room(self, request: RecognitionRequest) -> int:
        """Return the bytes of a picture that all connections have room for. Raises QueueFull."""
        picture = request.picture
        size = len(picture.image) + len(picture.mask or b"")
        # Live frames need no bound: each kind has one place, and a newer one takes it. Views to be
        # enrolled all count, so they queue up, and a client could fill the memory with them at the
        # speed of its line. The bound is over all connections, since opening another is free.
        waiting = sum(box.enrol_bytes + box.texture_bytes for box in self._mailboxes.values())
        if waiting + size > ENROL_BYTES:
            raise QueueFull
        return size

    def _turns(self) -> list[Connection]:
        """All connections, the owner of the outputs first."""
        return sorted(self._mailboxes, key=lambda connection: not connection.session.owner)

    def _begin(self, connection: Connection, request: RecognitionRequest, now: float) -> None:
        picture = request.picture
        shown_at = self._shown_at.get((connection, picture.object_id), -VIEW_S)
        is_due = now - shown_at >= VIEW_S and picture.purpose != "texture"
        is_shown = is_due and any(True for _ in self._observers())
        self._under_way = _UnderWay(connection, request, is_shown)
        self._recogniser.recognise(
            picture,
            f"{connection.name}/{name_of(request.target)}",
            now,
            force=request.reference_material is not None or connection.session.is_uncached(request),
            shrink=is_shown and not _is_small(picture),
            shown=_shown(connection, request),
        )

    def _candidates(self, now: float) -> Iterator[tuple[Connection, RecognitionRequest | None]]:
        """Yield what each connection has to be recognised, then their texture maps."""
        for connection in self._turns():
            yield connection, self._next_of(connection, now)
        for connection in self._turns():
            yield connection, self._mailboxes[connection].take_texture()

    def _next_of(self, connection: Connection, now: float) -> RecognitionRequest | None:
        session, rate = connection.session, self._rates[connection]

        # A live frame that comes before its time waits in its slot, where a newer one may take its
        # place. It needs no further message to be recognised then: the supervision's tick feeds
        # too.
        def is_due(request: RecognitionRequest) -> bool:
            return session.is_uncached(request) or rate.spend(1.0, now)

        while (request := self._mailboxes[connection].take(is_due)) is not None:
            if not connection.session.is_stale(request.picture, now):
                return request
            self._counts[Count.FRAMES_STALE] += 1
            if request.reply_to is not None:
                connection.post(Skipped(id=request.reply_to.value, reason="stale"))
        return None

    def _actions(self, under_way: _UnderWay, answer: RecogniserResult, now: float) -> list[Action]:
        request = under_way.request
        session = under_way.connection.session
        recognition = answer.recognition
        if recognition.error is None:
            self._counts[Count.RECOGNITIONS] += 1
            if isinstance(request.target, Surroundings):
                return session.scene_view_received(request, recognition.scene_view, now)
            return session.recognised(request, recognition.evidence, recognition.stages_ms, now)
        code: ErrorCode = "model" if recognition.is_our_fault else "message"
        self._counts[refused(code)] += 1
        if request.reply_to is None:
            return []
        path = recognition.error_path or "$.image"
        return [
            Reply(Error(id=request.reply_to.value, code=code, text=recognition.error, path=path))
        ]

    def _observers(self) -> Iterable[Connection]:
        return (other for other in self._mailboxes if "frames" in other.watches)

    def _show(self, under_way: _UnderWay, shrunk: Thumbnail | None) -> None:
        """Show the frame to the observers that watch frames, encoded once for all of them."""
        frame = under_way.request.picture
        if shrunk is None and not _is_small(frame):
            return
        # Object ids come from clients. When there are too many all are forgotten: at worst each
        # object is shown once more than it need be.
        if len(self._shown_at) >= MAX_VIEWED:
            self._shown_at.clear()
        self._shown_at[under_way.connection, frame.object_id] = time.monotonic()
        view = View(
            id=0,
            kind="frames",
            object_id=frame.object_id,
            region=frame.region,
            format=frame.format if shrunk is None else "jpeg",
            image=frame.image if shrunk is None else shrunk.jpeg,
            mask=frame.mask if shrunk is None else shrunk.mask,
            origin=frame.origin if shrunk is None else "top",
        )
        event = Event(view)
        for observer in self._observers():
            observer.post(event)


def _is_small(frame: Frame) -> bool:
    """Whether observers can be shown this frame as it came."""
    is_compressed = frame.format in ("jpeg", "png")
    size = len(frame.image) + len(frame.mask or b"")
    return is_compressed and max(frame.width, frame.height) <= SHOWN_PX and size <= SHOWN_BYTES


def _shown(connection: Connection, request: RecognitionRequest) -> SceneContext | None:
    """Name the object and its scene; None for the surroundings, which are not an object."""
    scene = f"{connection.name}/{request.scene}"
    match request.target:
        case Surroundings() | TextureTarget():
            return None
        case ObjectTarget(object_id, surface):
            if surface:
                object_id = name_of(request.target)
            return SceneContext(scene, object_id, request.reference_material)
        case _:
            return SceneContext(scene, None, request.reference_material)
