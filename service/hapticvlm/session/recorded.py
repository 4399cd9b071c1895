"""A session that keeps on tape what went into it, so that it can be run again bit for bit.

Everything that changes a SceneSession comes in through a few calls, each with the time. A taped
session writes each call down, in order, before it is carried out: with the same calls a new session
asks for the same outputs. Pictures are no part of that; the shell may keep them beside the tape.
Knows no file: lines go to whoever is told.
"""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Callable
from typing import Any

import msgspec

from hapticvlm import __version__, messages
from hapticvlm.messages import ClientMessage, Frame, Scope
from hapticvlm.recognition.ambient import SceneView
from hapticvlm.recognition.ladder import Evidence
from hapticvlm.recognition.vlm.answers import Reading
from hapticvlm.rendering.plate_limits import PlateReading
from hapticvlm.session.actions import (
    Action,
    Ask,
    AskAmbient,
    AskMaterial,
    LookAt,
    Reply,
    Watch,
)
from hapticvlm.session.session import SceneSession

Line = dict[str, Any]
Told = Callable[[Line, Frame | None], None]


class TapedSession(SceneSession):
    """A SceneSession whose inputs, and what it has the outputs do, are told as lines.

    `tell` is called for every input with a line that JSON can hold, and the frame if it is one.
    """

    def __init__(self, *, tell: Told, **given: Any) -> None:
        super().__init__(**given)
        self._tell = tell
        self._numbers = itertools.count(1)

    def receive(self, message: ClientMessage, now: float) -> list[Action]:
        """Take in one message; one that is refused is on the tape too, as it may be again."""
        frame = message if isinstance(message, Frame) else None
        self._tell({"now": now, "in": "message", "message": _bare(message)}, frame)
        return self._told(super().receive(message, now))

    def recognised(
        self, look: LookAt, evidence: Evidence | None, stages_ms: dict[str, float], now: float
    ) -> list[Action]:
        """Take in what a look gave."""
        line = {"now": now, "in": "look", "number": look.number, "stages_ms": stages_ms}
        self._tell({**line, "evidence": _plain(evidence)}, None)
        return self._told(super().recognised(look, evidence, stages_ms, now))

    def sighted(self, look: LookAt, sight: SceneView | None, now: float) -> list[Action]:
        """Take in what the scene as a whole looks like."""
        seen = None
        if sight is not None:
            seen = {"embedding": sight.embedding.tolist(), "brightness": sight.brightness}
        self._tell({"now": now, "in": "sight", "number": look.number, "sight": seen}, None)
        return self._told(super().sighted(look, sight, now))

    def answered(self, ask: Ask, answer: Reading | Evidence | None, now: float) -> list[Action]:
        """Take in what a VLM answered."""
        line = {"now": now, "in": "answer", "number": ask.number}
        kind = None if answer is None else type(answer).__name__.lower()
        self._tell({**line, "kind": kind, "answer": _plain(answer)}, None)
        return self._told(super().answered(ask, answer, now))

    def tick(self, now: float, reading: PlateReading) -> list[Action]:
        """Let time pass."""
        self._tell({"now": now, "in": "tick", "reading": _plain(reading)}, None)
        return self._told(super().tick(now, reading))

    def rest(self) -> None:
        """Drop every lease."""
        self._tell({"in": "rest"}, None)
        super().rest()

    def held(self, scope: Scope) -> None:
        """Note that outputs were stopped."""
        self._tell({"in": "held", "scope": scope}, None)
        super().held(scope)

    def _told(self, actions: list[Action]) -> list[Action]:
        """Give looks and questions numbers, and tell what the outputs are to do."""
        numbered = [self._numbered(action) for action in actions]
        if done := outputs(numbered):
            self._tell({"out": done}, None)
        return numbered

    def _numbered(self, action: Action) -> Action:
        if isinstance(action, LookAt | AskAmbient | AskMaterial):
            return dataclasses.replace(action, number=next(self._numbers))
        return action


def head(given: dict[str, Any]) -> Line:
    """Write what a session begins with, from the arguments it was made with."""
    return {
        "hapticvlm": __version__,
        "owner": given["owner"],
        "can_ask": given["can_ask"],
        "contact_resistance": given["contact_resistance"],
        "reading": _plain(given["reading"]),
        "materials": list(given["table"]),
    }


def outputs(actions: list[Action]) -> list[Line]:
    """Write what actions do to the outputs and say of materials, to compare bit for bit."""
    told: list[Line] = []
    for action in actions:
        if isinstance(action, Reply):
            if isinstance(action.message, messages.Decision):
                told.append({"do": "say", **_plain(action.message)})
        elif not isinstance(action, LookAt | AskAmbient | AskMaterial | Watch):
            told.append({"do": type(action).__name__, **_plain(action)})
    return told


def _bare(message: ClientMessage) -> Line:
    """Write a message as JSON can hold it: a frame without its pictures."""
    if not isinstance(message, Frame):
        return dict(_plain(message))
    bare = msgspec.structs.replace(message, image=b"", mask=None)
    return {**msgspec.to_builtins(bare), "image": None, "mask": message.mask is not None}


def _plain(value: object) -> Any:  # noqa: ANN401 - whatever JSON can hold
    return msgspec.to_builtins(value)
