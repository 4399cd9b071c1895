"""What waits to be asked of a VLM, and who gets the answers. One question at a time, bounded.

Of each connection the newest frame of its surroundings waits, and one frame of each of the few
objects it does not know. What gives way is told at once that it has no answer.
"""

from __future__ import annotations

import time
from collections import Counter, OrderedDict
from typing import Protocol

from hapticvlm.processes.vlm import Answer, Onlooker, Question
from hapticvlm.session.actions import Action, Ask, AskAmbient, AskMaterial
from hapticvlm.session.scene_objects import Key
from hapticvlm.session.session import SceneSession

MAX_OBJECTS = 8
MAX_AGE_S = 30.0  # a frame that waited longer shows a scene of long ago


class Asker(Protocol):
    """Of a connection, what the questions need: its session."""

    session: SceneSession


class Desk(Protocol):
    """What the questions need of the gateway: what to do with the answers, and counts."""

    counts: Counter[str]

    def deliver_to(self, asker: Asker, actions: list[Action]) -> None:
        """Carry out actions for this asker, if it is still there."""


class Questions:
    """Feeds the onlooker, in turns, ambient before material."""

    def __init__(self, onlooker: Onlooker, desk: Desk) -> None:
        self.onlooker = onlooker
        self._desk = desk
        self._ambient: OrderedDict[int, tuple[Asker, AskAmbient, float]] = OrderedDict()
        self._material: OrderedDict[tuple[int, Key], tuple[Asker, AskMaterial, float]] = (
            OrderedDict()
        )
        self._asked: tuple[Asker, Ask] | None = None
        self.answered = 0
        self.failed = 0
        self.dropped = 0
        self.last_error: str | None = None

    def queue(self, asker: Asker, ask: Ask, now: float) -> None:
        """Take in a question; a newer one about the same thing takes its place."""
        if self.onlooker.absent is not None:
            self._tell(asker, ask, None)
            return
        superseded: tuple[Asker, Ask, float] | None
        if isinstance(ask, AskAmbient):
            superseded = self._ambient.pop(id(asker), None)
            self._ambient[id(asker)] = (asker, ask, now)
        else:
            superseded = self._material.pop((id(asker), ask.key), None)
            self._material[id(asker), ask.key] = (asker, ask, now)
            if superseded is None and len(self._material) > MAX_OBJECTS:
                _, superseded = self._material.popitem(last=False)
        if superseded is not None:
            self._drop(*superseded[:2])
        self.feed(now)

    def feed(self, now: float) -> None:
        """Ask the next question if the onlooker is idle."""
        while not self.onlooker.is_busy:
            waiting = self._ambient or self._material
            if not waiting:
                return
            _, (asker, ask, since) = waiting.popitem(last=False)
            if now - since > MAX_AGE_S:
                self._drop(asker, ask)
                continue
            self._asked = (asker, ask)
            self.onlooker.ask(self._question(asker, ask), now)

    def take(self, answer: Answer, now: float) -> None:
        """Take in an answer; one to a question given up is dropped."""
        if not self.onlooker.done(answer):
            self._desk.counts["late vlm answers dropped"] += 1
            return
        asked, self._asked = self._asked, None
        if answer.error is not None:
            self.failed, self.last_error = self.failed + 1, answer.error
        else:
            self.answered += 1
        if asked is not None:
            self._tell(*asked, answer)
        self.feed(now)

    def supervise(self, now: float) -> str | None:
        """Watch the onlooker and go on asking; return what happened to it, if anything."""
        trouble = self.onlooker.supervise(now)
        if trouble is not None:
            self._fail(trouble, now)
        self.feed(now)
        return trouble

    def forget(self, asker: Asker) -> None:
        """Drop what a connection that left has waiting."""
        self._ambient.pop(id(asker), None)
        for key in [key for key in self._material if key[0] == id(asker)]:
            del self._material[key]
        if self._asked is not None and self._asked[0] is asker:
            self._asked = None

    def _fail(self, text: str, now: float) -> None:
        """Tell who waited for an answer that there will be none: the onlooker was restarted."""
        asked, self._asked = self._asked, None
        self.last_error = text
        if asked is not None:
            self.failed += 1
            self._tell(*asked, None)
        if self.onlooker.absent is not None:
            for waiting in (self._ambient, self._material):
                while waiting:
                    _, (asker, ask, _since) = waiting.popitem()
                    self._drop(asker, ask)
        self.feed(now)

    def _question(self, asker: Asker, ask: Ask) -> Question:
        if isinstance(ask, AskAmbient):
            return Question(ask.frame)
        return Question(ask.frame, asker.session.materials)

    def _drop(self, asker: Asker, ask: Ask) -> None:
        self.dropped += 1
        self._tell(asker, ask, None)

    def _tell(self, asker: Asker, ask: Ask, answer: Answer | None) -> None:
        what = None if answer is None else answer.what
        self._desk.deliver_to(asker, asker.session.answered(ask, what, time.monotonic()))
