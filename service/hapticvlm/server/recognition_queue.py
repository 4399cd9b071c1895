"""What waits to be looked at, and who gets the answers. One look at a time, newest frames first."""

from __future__ import annotations

import time
from collections import Counter
from typing import Protocol

from hapticvlm.messages import Error, ErrorCode, ServiceMessage, Skipped, View
from hapticvlm.processes.recogniser import QueueFull, Recogniser
from hapticvlm.recognition.frame_recogniser import Recognition
from hapticvlm.server.connection import Connection
from hapticvlm.session.actions import Action, LookAt, Reply
from hapticvlm.session.frames import SURROUNDINGS

VIEW_S = 0.5
MOST_VIEWED = 256


class Desk(Protocol):
    """What the queue needs of the gateway: its connections, and what to do with actions."""

    connections: list[Connection]
    counts: Counter[str]

    def deliver(self, connection: Connection, actions: list[Action]) -> None:
        """Carry out actions that no message of this connection asked for just now."""


class Looks:
    """Feeds the recogniser from the connections' mailboxes, in turns."""

    def __init__(self, recogniser: Recogniser, desk: Desk) -> None:
        self._recogniser = recogniser
        self._desk = desk
        self._asked: tuple[Connection, LookAt] | None = None
        self._viewed_at: dict[str | None, float] = {}

    def queue(self, connection: Connection, look: LookAt) -> list[ServiceMessage]:
        """Take in what a session wants looked at; return what to answer at once."""
        frame, mailbox = look.frame, connection.mailbox
        superseded: LookAt | None = None
        try:
            if isinstance(look.key, tuple):
                superseded = mailbox.put_touch(look, look.key[1])
            elif frame.purpose == "enrol":
                size = len(frame.image) + len(frame.mask or b"")
                mailbox.put_enrol(look, frame.object_id, size)
            else:
                superseded = mailbox.put_live(look)
        except QueueFull:
            self._desk.counts["refused: overload"] += 1
            text = "too many enrol frames wait: send more when some of these are decided"
            return [Error(id=frame.id, code="overload", text=text, path="$.purpose")]
        answers: list[ServiceMessage] = []
        if superseded is not None:
            self._desk.counts["frames superseded"] += 1
            if superseded.frame.id:
                answers.append(Skipped(id=superseded.frame.id, reason="superseded"))
        self.feed()
        return answers

    def feed(self) -> None:
        """Give the recogniser the next look if it is idle."""
        if self._recogniser.is_busy:
            return
        now = time.monotonic()
        for connection in self._desk.connections.copy():
            look = self._next_of(connection, now)
            if look is None:
                continue
            self._asked = (connection, look)
            subject = f"{connection.name}/{look.key}"
            anew = connection.session.wants_anew(look)
            self._recogniser.look(look.frame, subject, now, anew=anew)
            self._desk.connections.remove(connection)
            self._desk.connections.append(connection)
            return

    def take(self, answer: Recognition) -> None:
        """Take in the recogniser's answer; one to a question of long ago is dropped."""
        if not self._recogniser.done(answer):
            self._desk.counts["late answers dropped"] += 1
            return
        asked, self._asked = self._asked, None
        if asked is not None and asked[0] in self._desk.connections:
            connection, look = asked
            self._show(look)
            self._desk.deliver(connection, self._learn(connection, look, answer))
        self.feed()

    def fail(self, text: str) -> None:
        """Tell who waited that the recogniser was restarted, and go on."""
        asked, self._asked = self._asked, None
        if asked is not None and asked[1].frame.id and asked[0] in self._desk.connections:
            asked[0].post(Error(id=asked[1].frame.id, code="model", text=text))
        self.feed()

    def _next_of(self, connection: Connection, now: float) -> LookAt | None:
        while (look := connection.mailbox.take()) is not None:
            if not connection.session.is_stale(look.frame, now):
                return look
            self._desk.counts["frames stale"] += 1
            if look.frame.id:
                connection.post(Skipped(id=look.frame.id, reason="stale"))
        return None

    def _learn(self, connection: Connection, look: LookAt, answer: Recognition) -> list[Action]:
        if answer.error is None:
            self._desk.counts["looks"] += 1
            session, now = connection.session, time.monotonic()
            if look.key == SURROUNDINGS:
                return session.sighted(look, answer.scene_view, now)
            return session.recognised(look, answer.evidence, answer.stages_ms, now)
        code: ErrorCode = "model" if answer.is_our_fault else "message"
        self._desk.counts[f"refused: {code}"] += 1
        if not look.frame.id:
            return []
        return [Reply(Error(id=look.frame.id, code=code, text=answer.error, path="$.image"))]

    def _show(self, look: LookAt) -> None:
        """Show observers that watch frames those of each object, twice a second at most."""
        now, frame = time.monotonic(), look.frame
        is_new = now - self._viewed_at.get(frame.object_id, -VIEW_S) >= VIEW_S
        if frame.format not in ("jpeg", "png") or not is_new:
            return
        if len(self._viewed_at) >= MOST_VIEWED:
            self._viewed_at.clear()
        for observer in self._desk.connections:
            if "frames" in observer.watches:
                self._viewed_at[frame.object_id] = now
                observer.post(
                    View(
                        id=0,
                        kind="frames",
                        object_id=frame.object_id,
                        region=frame.region,
                        format=frame.format,
                        image=frame.image,
                        mask=frame.mask,
                        origin=frame.origin,
                    )
                )
