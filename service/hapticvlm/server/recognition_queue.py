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
from hapticvlm.server.budgets import ENROL_BYTES
from hapticvlm.server.connection import Connection, Event
from hapticvlm.server.mailbox import Mailbox, QueueFull
from hapticvlm.session.actions import Action, RecogniseFrame, Reply
from hapticvlm.session.frames import SURROUNDINGS
from hapticvlm.vision.frame_recogniser import Shown
from hapticvlm.vision.pictures import Shrunk
from hapticvlm.vision.worker import SHOWN_PX, Recognised, RecogniserWorker

VIEW_S = 0.5
MOST_VIEWED = 256
SHOWN_BYTES = 256 * 1024  # text observers get a third more, and all of it in one go

Deliver = Callable[[Connection, list[Action]], None]


@dataclass(frozen=True, slots=True)
class _Request:
    """What the recogniser works on, for whom, and whether observers see it."""

    connection: Connection
    action: RecogniseFrame
    is_shown: bool


class RecognitionQueue:
    """Feeds the recogniser from a mailbox for each connection that has joined."""

    def __init__(
        self, recogniser: RecogniserWorker, counts: Counter[str], deliver: Deliver
    ) -> None:
        self._recogniser = recogniser
        self._counts = counts
        self._deliver = deliver
        self._mailboxes: dict[Connection, Mailbox[RecogniseFrame]] = {}  # in order of their turns
        self._under_way: _Request | None = None
        self._shown_at: dict[tuple[Connection, str | None], float] = {}  # by object

    def join(self, connection: Connection) -> None:
        """Give a connection its place, behind all others."""
        self._mailboxes[connection] = Mailbox()

    def leave(self, connection: Connection) -> None:
        """Drop what a connection has waiting; an answer under way goes to nobody."""
        self._mailboxes.pop(connection, None)
        for shown in [shown for shown in self._shown_at if shown[0] is connection]:
            del self._shown_at[shown]

    def put(self, connection: Connection, action: RecogniseFrame) -> list[ServiceMessage]:
        """Queue what a session wants recognised; return what to answer at once."""
        frame, mailbox = action.frame, self._mailboxes[connection]
        superseded: RecogniseFrame | None = None
        try:
            if isinstance(action.key, tuple):
                superseded = mailbox.put_touch(action, action.key[1])
            elif frame.purpose == "enrol":
                self._put_enrol(mailbox, action)
            else:
                superseded = mailbox.put_live(action)
        except QueueFull:
            self._counts["refused: overload"] += 1
            if action.teaches is not None:  # nobody waits for it; another picture will teach
                return []
            text = "too many enrol frames wait: send more when some of these are decided"
            return [Error(id=frame.id, code="overload", text=text, path="$.purpose")]
        answers: list[ServiceMessage] = []
        if superseded is not None:
            self._counts["frames superseded"] += 1
            if superseded.frame.id:
                answers.append(Skipped(id=superseded.frame.id, reason="superseded"))
        self.feed()
        return answers

    def feed(self) -> None:
        """Give the recogniser the next frame if it is idle."""
        if self._recogniser.worker.is_busy:
            return
        now = time.monotonic()
        for connection in self._turns():
            action = self._next_of(connection, now)
            if action is None:
                continue
            self._mailboxes[connection] = self._mailboxes.pop(connection)  # behind all others
            self._begin(connection, action, now)
            return

    def accept(self, answered: Answered[Recognised]) -> None:
        """Deliver the recogniser's answer; one to a request that was given up is dropped."""
        now = time.monotonic()
        if not self._recogniser.worker.accept(answered, now):
            self._counts["late answers dropped"] += 1
            return
        self._recogniser.note(answered.value.remote)
        request, self._under_way = self._under_way, None
        if request is not None and request.connection in self._mailboxes:
            if request.is_shown:
                self._show(request, answered.value.shown)
            self._deliver(request.connection, self._actions(request, answered.value, now))
        self.feed()

    def fail(self, text: str) -> None:
        """Answer the waiting client that the recogniser was restarted, and go on."""
        request, self._under_way = self._under_way, None
        if (
            request is not None
            and request.action.frame.id
            and request.connection in self._mailboxes
        ):
            request.connection.post(Error(id=request.action.frame.id, code="model", text=text))
        self.feed()

    def _put_enrol(self, mailbox: Mailbox[RecogniseFrame], action: RecogniseFrame) -> None:
        """Queue a view of an object. Raises QueueFull."""
        size = len(action.frame.image) + len(action.frame.mask or b"")
        waiting = sum(other.enrol_bytes for other in self._mailboxes.values())
        if waiting + size > ENROL_BYTES:
            raise QueueFull
        mailbox.put_enrol(action, action.frame.object_id, size)

    def _turns(self) -> list[Connection]:
        """All connections, the owner of the outputs first."""
        return sorted(self._mailboxes, key=lambda connection: not connection.session.owner)

    def _begin(self, connection: Connection, action: RecogniseFrame, now: float) -> None:
        is_due = now - self._shown_at.get((connection, action.frame.object_id), -VIEW_S) >= VIEW_S
        is_shown = is_due and any(True for _ in self._observers())
        self._under_way = _Request(connection, action, is_shown)
        self._recogniser.recognise(
            action.frame,
            f"{connection.name}/{action.key}",
            now,
            anew=action.teaches is not None or connection.session.wants_anew(action),
            shrink=is_shown and not _is_small(action.frame),
            shown=_shown(connection, action),
        )

    def _next_of(self, connection: Connection, now: float) -> RecogniseFrame | None:
        while (action := self._mailboxes[connection].take()) is not None:
            if not connection.session.is_stale(action.frame, now):
                return action
            self._counts["frames stale"] += 1
            if action.frame.id:
                connection.post(Skipped(id=action.frame.id, reason="stale"))
        return None

    def _actions(self, request: _Request, answer: Recognised, now: float) -> list[Action]:
        action, session, found = request.action, request.connection.session, answer.recognition
        if found.error is None:
            self._counts["recognitions"] += 1
            if action.key == SURROUNDINGS:
                return session.scene_view_received(action, found.scene_view, now)
            return session.recognised(action, found.evidence, found.stages_ms, now)
        code: ErrorCode = "model" if found.is_our_fault else "message"
        self._counts[f"refused: {code}"] += 1
        if not action.frame.id:
            return []
        path = found.error_path or "$.image"
        return [Reply(Error(id=action.frame.id, code=code, text=found.error, path=path))]

    def _observers(self) -> Iterable[Connection]:
        return (other for other in self._mailboxes if "frames" in other.watches)

    def _show(self, request: _Request, shrunk: Shrunk | None) -> None:
        """Show the frame to the observers that watch frames, encoded once for all of them."""
        frame = request.action.frame
        if shrunk is None and not _is_small(frame):
            return
        if len(self._shown_at) >= MOST_VIEWED:
            self._shown_at.clear()
        self._shown_at[request.connection, frame.object_id] = time.monotonic()
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


def _shown(connection: Connection, action: RecogniseFrame) -> Shown | None:
    """Name the object and its scene; None for the surroundings, which are no object."""
    if action.key == SURROUNDINGS:
        return None
    object_id = action.key if isinstance(action.key, str) else None
    return Shown(f"{connection.name}/{action.scene}", object_id, action.teaches)
