"""What waits to be recognised, whose turn it is, and who gets the answers. One frame at a time.

The connection that owns the outputs comes first, the others take turns. Of each the newest frame
waits; what waits to be enrolled is bounded for all of them together.
"""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Callable, Iterable
from dataclasses import dataclass

from hapticvlm.messages import Error, ErrorCode, Frame, ServiceMessage, Skipped, View
from hapticvlm.processes.model_worker import Answered
from hapticvlm.server.budgets import ENROL_BYTES, LOOKS, TokenBucket
from hapticvlm.server.connection import Connection, Event
from hapticvlm.server.mailbox import Mailbox, QueueFull
from hapticvlm.server.turns import put_off
from hapticvlm.session.actions import Action, Reply
from hapticvlm.session.targets import (
    HandRegion,
    ObjectTarget,
    RecognitionRequest,
    Surroundings,
    name_of,
)
from hapticvlm.vision.frame_recogniser import Shown
from hapticvlm.vision.pictures import Shrunk
from hapticvlm.vision.worker import SHOWN_PX, Recognised, RecogniserWorker

SCENE_SLOT = "scene"  # beside those of the hands: the newest view of the surroundings waits there
VIEW_S = 0.5
MOST_VIEWED = 256
SHOWN_BYTES = 256 * 1024  # text observers get a third more, and all of it in one go

Deliver = Callable[[Connection, list[Action]], None]


@dataclass(frozen=True, slots=True)
class _UnderWay:
    """What the recogniser works on, for whom, and whether observers see it."""

    connection: Connection
    request: RecognitionRequest
    is_shown: bool


class RecognitionQueue:
    """Feeds the recogniser from a mailbox for each connection that has joined.

    All of it runs on the event loop, so no two methods run at once and nothing is locked. The
    recogniser works on one picture at a time: after `put` and `accept` a turn of the loop feeds it
    the next one if it is idle. An answer belongs to the request under way or to none: one that was
    given up (a restart, a connection that left) is dropped by its number. Whoever waits for an
    answer gets exactly one: a decision, `skipped` with its reason, or an error.
    """

    def __init__(
        self, recogniser: RecogniserWorker, counts: Counter[str], deliver: Deliver
    ) -> None:
        self._recogniser = recogniser
        self._counts = counts
        self._deliver = deliver
        self._mailboxes: dict[
            Connection, Mailbox[RecognitionRequest]
        ] = {}  # in order of their turns
        self._under_way: _UnderWay | None = None
        self._shown_at: dict[tuple[Connection, str | None], float] = {}  # by object
        self._looks: dict[Connection, TokenBucket] = {}
        self._is_feed_due = False

    def join(self, connection: Connection) -> None:
        """Give a connection its place, behind all others."""
        self._mailboxes[connection] = Mailbox()
        self._looks[connection] = TokenBucket(LOOKS, time.monotonic())

    def leave(self, connection: Connection) -> None:
        """Drop what a connection has waiting; an answer under way goes to nobody."""
        self._mailboxes.pop(connection, None)
        self._looks.pop(connection, None)
        for shown in [shown for shown in self._shown_at if shown[0] is connection]:
            del self._shown_at[shown]

    def put(self, connection: Connection, request: RecognitionRequest) -> list[ServiceMessage]:
        """Queue what a session wants recognised; return what to answer at once."""
        try:
            superseded = self._queue(self._mailboxes[connection], request)
        except QueueFull:
            self._counts["refused: overload"] += 1
            if request.waits is None:  # it would only have taught; another picture will
                return []
            text = "too many enrol frames wait: send more when some of these are decided"
            return [Error(id=request.waits.value, code="overload", text=text, path="$.purpose")]
        answers: list[ServiceMessage] = []
        if superseded is not None:
            self._counts["frames superseded"] += 1
            if superseded.waits is not None:
                answers.append(Skipped(id=superseded.waits.value, reason="superseded"))
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
        for connection in self._turns():
            request = self._next_of(connection, now)
            if request is None:
                continue
            # A dict keeps the order in which its keys were put in. Taking a connection out and
            # putting it back makes it the last, so three scenes get a third of the recogniser each,
            # whatever they send. The owner is looked at first in any case: what its hand touches is
            # felt now.
            self._mailboxes[connection] = self._mailboxes.pop(connection)  # behind all others
            self._begin(connection, request, now)
            return

    def accept(self, answered: Answered[Recognised]) -> None:
        """Deliver the recogniser's answer; one to a request that was given up is dropped."""
        now = time.monotonic()
        # Answers come from a thread that reads the worker's pipe, through the event loop. Between
        # the answer and this call the worker may have been given up and started again; then the
        # number does not fit, and the frame of its successor must not get the answer of this one.
        if not self._recogniser.worker.accept(answered, now):
            self._counts["late answers dropped"] += 1
            return
        self._recogniser.note(answered.value.remote)
        under_way = self._under_way
        self._under_way = None
        # To take the answer, to decide, and to copy the next frame over would together hold the
        # loop for half a millisecond. Each has a turn of its own: a touch that came meanwhile goes
        # between.
        put_off(self._answer, under_way, answered.value)

    def fail(self, text: str) -> None:
        """Answer the waiting client that the recogniser was restarted, and go on."""
        under_way = self._under_way
        self._under_way = None
        if under_way is not None and under_way.connection in self._mailboxes:
            waits = under_way.request.waits
            if waits is not None:
                under_way.connection.post(Error(id=waits.value, code="model", text=text))
        self.feed()

    def _feed_soon(self) -> None:
        """Give the recogniser the next frame in a turn of its own."""
        if not (self._is_feed_due or self._recogniser.worker.is_busy):
            self._is_feed_due = True
            put_off(self._feed_now)

    def _feed_now(self) -> None:
        self._is_feed_due = False
        self.feed()

    def _answer(self, under_way: _UnderWay | None, answer: Recognised) -> None:
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
            case HandRegion(hand):
                return mailbox.put_touch(request, hand)
            case Surroundings():
                return mailbox.put_touch(request, SCENE_SLOT)
            case _ if request.picture.purpose == "enrol" or request.teaches is not None:
                self._put_enrol(mailbox, request)
                return None
            case _:
                return mailbox.put_live(request)

    def _put_enrol(self, mailbox: Mailbox[RecognitionRequest], request: RecognitionRequest) -> None:
        """Queue a view of an object. Raises QueueFull."""
        picture = request.picture
        size = len(picture.image) + len(picture.mask or b"")
        # Live frames need no bound: each kind has one place, and a newer one takes it. Views to be
        # enrolled all count, so they queue up, and a client could fill the memory with them at the
        # speed of its line. The bound is over all connections, since opening another is free.
        waiting = sum(other.enrol_bytes for other in self._mailboxes.values())
        if waiting + size > ENROL_BYTES:
            raise QueueFull
        mailbox.put_enrol(request, picture.object_id, size)

    def _turns(self) -> list[Connection]:
        """All connections, the owner of the outputs first."""
        return sorted(self._mailboxes, key=lambda connection: not connection.session.owner)

    def _begin(self, connection: Connection, request: RecognitionRequest, now: float) -> None:
        picture = request.picture
        shown_at = self._shown_at.get((connection, picture.object_id), -VIEW_S)
        is_shown = now - shown_at >= VIEW_S and any(True for _ in self._observers())
        self._under_way = _UnderWay(connection, request, is_shown)
        self._recogniser.recognise(
            picture,
            f"{connection.name}/{name_of(request.target)}",
            now,
            anew=request.teaches is not None or connection.session.wants_anew(request),
            shrink=is_shown and not _is_small(picture),
            shown=_shown(connection, request),
        )

    def _next_of(self, connection: Connection, now: float) -> RecognitionRequest | None:
        session, looks = connection.session, self._looks[connection]

        # A live frame that comes before its time waits in its slot, where a newer one may take its
        # place. No message need come for it to be looked at then: the supervision's tick feeds too.
        def is_due(request: RecognitionRequest) -> bool:
            return session.wants_anew(request) or looks.spend(1.0, now)

        while (request := self._mailboxes[connection].take(is_due)) is not None:
            if not connection.session.is_stale(request.picture, now):
                return request
            self._counts["frames stale"] += 1
            if request.waits is not None:
                connection.post(Skipped(id=request.waits.value, reason="stale"))
        return None

    def _actions(self, under_way: _UnderWay, answer: Recognised, now: float) -> list[Action]:
        request = under_way.request
        session = under_way.connection.session
        found = answer.recognition
        if found.error is None:
            self._counts["recognitions"] += 1
            if isinstance(request.target, Surroundings):
                return session.scene_view_received(request, found.scene_view, now)
            return session.recognised(request, found.evidence, found.stages_ms, now)
        code: ErrorCode = "model" if found.is_our_fault else "message"
        self._counts[f"refused: {code}"] += 1
        if request.waits is None:
            return []
        path = found.error_path or "$.image"
        return [Reply(Error(id=request.waits.value, code=code, text=found.error, path=path))]

    def _observers(self) -> Iterable[Connection]:
        return (other for other in self._mailboxes if "frames" in other.watches)

    def _show(self, under_way: _UnderWay, shrunk: Shrunk | None) -> None:
        """Show the frame to the observers that watch frames, encoded once for all of them."""
        frame = under_way.request.picture
        if shrunk is None and not _is_small(frame):
            return
        # Object ids come from clients. When there are too many all are forgotten: at worst each
        # object is shown once more than it need be.
        if len(self._shown_at) >= MOST_VIEWED:
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


def _shown(connection: Connection, request: RecognitionRequest) -> Shown | None:
    """Name the object and its scene; None for the surroundings, which are no object."""
    scene = f"{connection.name}/{request.scene}"
    match request.target:
        case Surroundings():
            return None
        case ObjectTarget(object_id):
            return Shown(scene, object_id, request.teaches)
        case _:
            return Shown(scene, None, request.teaches)
