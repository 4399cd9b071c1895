"""Queues questions to a VLM and delivers the replies. One question at a time, bounded.

Of each connection the newest frame of its surroundings waits, and one frame of each of the few
objects that are unknown. A question that is dropped is answered at once, without a reply.
"""

from __future__ import annotations

import time
from collections import Counter, OrderedDict
from collections.abc import Callable

from hapticvlm.processes.model_worker import WorkerReply
from hapticvlm.server.connection import Connection
from hapticvlm.server.counters import Count
from hapticvlm.server.news import HelperNews
from hapticvlm.session.actions import Action, Ask, AskAmbient, AskMaterial
from hapticvlm.session.targets import ObjectTarget
from hapticvlm.vlm.worker import Question, VlmReply, VlmWorker

MAX_OBJECTS = 8
MAX_AGE_S = 30.0  # a frame that waited longer shows a scene of long ago

Deliver = Callable[[Connection, list[Action]], None]


class VlmQueue:
    """Feeds the VLM worker, in turns, ambient before material."""

    def __init__(self, worker: VlmWorker, counts: Counter[Count], deliver: Deliver) -> None:
        self.worker = worker
        self._counts = counts
        self._deliver = deliver
        self._ambient: OrderedDict[Connection, tuple[AskAmbient, float]] = OrderedDict()
        self._material: OrderedDict[tuple[Connection, ObjectTarget], tuple[AskMaterial, float]] = (
            OrderedDict()
        )
        self._under_way: tuple[Connection, Ask] | None = None
        self.answered = 0
        self.failed = 0
        self.dropped = 0
        self.last_error: str | None = None
        self.news = HelperNews()

    def put(self, connection: Connection, ask: Ask, now: float) -> None:
        """Queue a question; a newer one about the same thing takes its place."""
        if self.worker.absent is not None:
            self._answer(connection, ask, None)
            return
        superseded = (
            self._put_ambient(connection, ask, now)
            if isinstance(ask, AskAmbient)
            else self._put_material(connection, ask, now)
        )
        if superseded is not None:
            self._drop(*superseded)
        self.feed(now)

    def feed(self, now: float) -> None:
        """Ask the next question if the worker is idle."""
        while not self.worker.is_busy:
            following = self._next()
            if following is None:
                return
            connection, ask, since = following
            # A question takes a second on a GPU and a minute without one. A question that waited
            # longer than a scene keeps its weather is dropped, and its session gets an empty
            # answer: it would wait for one and ask nothing else.
            if now - since > MAX_AGE_S:
                self._drop(connection, ask)
                continue
            self._under_way = (connection, ask)
            names = () if isinstance(ask, AskAmbient) else connection.session.materials
            self.worker.ask(Question(ask.picture, names), now)

    def accept(self, reply: WorkerReply[VlmReply], now: float) -> None:
        """Deliver a reply; one to a question that was given up is dropped."""
        if not self.worker.worker.accept(reply, now):
            self._counts[Count.LATE_VLM_ANSWERS] += 1
            return
        under_way = self._under_way
        self._under_way = None
        answer = reply.value
        if answer.error is not None:
            self.failed += 1
            self.last_error = answer.error
        else:
            self.answered += 1
        self.news.note(f"the vision-language model {self.worker.name}", answer.error, now)
        if under_way is not None:
            self._answer(*under_way, answer)
        self.feed(now)

    def supervise(self, now: float) -> str | None:
        """Watch the worker and go on asking; return what happened to it, if anything."""
        # A worker loads for minutes and may die at any moment, so it is checked in every tick.
        # Questions are fed here, too: a worker that has just become ready has answered nobody, and
        # without this no one would ever hand it its first question.
        trouble = self.worker.supervise(now)
        if trouble is not None:
            self._fail(trouble)
        self.feed(now)
        return trouble

    def leave(self, connection: Connection) -> None:
        """Drop the questions of a connection that left."""
        self._ambient.pop(connection, None)
        for key in [key for key in self._material if key[0] is connection]:
            del self._material[key]
        if self._under_way is not None and self._under_way[0] is connection:
            self._under_way = None

    def _put_ambient(
        self, connection: Connection, ask: AskAmbient, now: float
    ) -> tuple[Connection, Ask] | None:
        before = self._ambient.pop(connection, None)
        self._ambient[connection] = (ask, now)
        return None if before is None else (connection, before[0])

    def _put_material(
        self, connection: Connection, ask: AskMaterial, now: float
    ) -> tuple[Connection, Ask] | None:
        before = self._material.pop((connection, ask.target), None)
        self._material[connection, ask.target] = (ask, now)
        if before is not None:
            return connection, before[0]
        if len(self._material) <= MAX_OBJECTS:
            return None
        # Of many unknown objects the newest matter most: they are in view. The oldest question
        # makes room and gets an empty answer; its object may ask again when it is seen again.
        (oldest, _), (given_up, _) = self._material.popitem(last=False)
        return oldest, given_up

    def _next(self) -> tuple[Connection, Ask, float] | None:
        if self._ambient:
            connection, (ambient, since) = self._ambient.popitem(last=False)
            return connection, ambient, since
        if self._material:
            (connection, _), (material, since) = self._material.popitem(last=False)
            return connection, material, since
        return None

    def _fail(self, text: str) -> None:
        """Answer the waiting session without a reply: the worker was restarted."""
        under_way = self._under_way
        self._under_way = None
        self.last_error = text
        if under_way is not None:
            self.failed += 1
            self._answer(*under_way, None)
        if self.worker.absent is not None:
            while (waiting := self._next()) is not None:
                self._drop(*waiting[:2])

    def _drop(self, connection: Connection, ask: Ask) -> None:
        self.dropped += 1
        self._answer(connection, ask, None)

    def _answer(self, connection: Connection, ask: Ask, reply: VlmReply | None) -> None:
        value = None if reply is None else reply.value
        self._deliver(connection, connection.session.answered(ask, value, time.monotonic()))
