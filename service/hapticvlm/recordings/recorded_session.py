"""A session that writes a log of its inputs, so that it can be run again bit for bit.

Everything that changes a SceneSession comes in through a few calls, each with the time. A recorded
session writes each call down, in order, before it is carried out: with the same calls a new session
asks for the same outputs. Pictures are no part of that; the shell may keep them beside the log.
The names in the lines are a file format and stay when code is renamed. Knows no file.
"""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Callable
from typing import Any

import msgspec

from hapticvlm import __version__, messages
from hapticvlm.evidence.ambient import SceneView
from hapticvlm.evidence.ladder import Evidence
from hapticvlm.evidence.reading import Reading
from hapticvlm.messages import ClientMessage, Frame, Hello, Scope
from hapticvlm.rendering.heat.contact import PLATE_RESISTANCE
from hapticvlm.rendering.heat.limits import PlateReading
from hapticvlm.rendering.vibration.voices import Command
from hapticvlm.session.actions import (
    Action,
    Ask,
    AskAmbient,
    AskMaterial,
    DrivePlate,
    HoldOutputs,
    PlayVibration,
    RecogniseFrame,
    ReleaseHand,
    Reply,
    RestPlate,
    SetGain,
)
from hapticvlm.session.session import SceneSession

Line = dict[str, Any]
_NAMES: dict[type, str] = {
    ReleaseHand: "LetGo",
    SetGain: "SetGain",
    DrivePlate: "Heat",
    RestPlate: "RestPlate",
    HoldOutputs: "HoldAtRest",
}
WriteLine = Callable[[Line, Frame | None], None]


class RecordedSession(SceneSession):
    """A SceneSession whose inputs, and what it has the outputs do, are written as lines.

    `write_line` is called for every input with a line that JSON can hold, and the frame if any.
    """

    def __init__(self, *, write_line: WriteLine, **given: Any) -> None:
        super().__init__(**given)
        self._write_line = write_line
        self._numbers = itertools.count(1)

    def receive(self, message: ClientMessage, now: float) -> list[Action]:
        """Receive one message; a refused one is written too, as it may be refused again."""
        frame = message if isinstance(message, Frame) else None
        self._write_line({"now": now, "in": "message", "message": _bare(message)}, frame)
        return self._logged(super().receive(message, now))

    def recognised(
        self,
        action: RecogniseFrame,
        evidence: Evidence | None,
        stages_ms: dict[str, float],
        now: float,
    ) -> list[Action]:
        """Receive what a recognition gave; what only taught the recogniser is no input."""
        if action.teaches is not None:
            return super().recognised(action, evidence, stages_ms, now)
        line = {"now": now, "in": "look", "number": action.number, "stages_ms": stages_ms}
        self._write_line({**line, "evidence": _plain(evidence)}, None)
        return self._logged(super().recognised(action, evidence, stages_ms, now))

    def scene_view_received(
        self, action: RecogniseFrame, scene_view: SceneView | None, now: float
    ) -> list[Action]:
        """Receive the scene view."""
        seen = None
        if scene_view is not None:
            embedding = scene_view.embedding.tolist()
            seen = {"embedding": embedding, "brightness": scene_view.brightness}
        self._write_line({"now": now, "in": "sight", "number": action.number, "sight": seen}, None)
        return self._logged(super().scene_view_received(action, scene_view, now))

    def answered(self, ask: Ask, answer: Reading | Evidence | None, now: float) -> list[Action]:
        """Receive what a VLM answered."""
        line = {"now": now, "in": "answer", "number": ask.number}
        kind = None if answer is None else type(answer).__name__.lower()
        self._write_line({**line, "kind": kind, "answer": _plain(answer)}, None)
        return self._logged(super().answered(ask, answer, now))

    def tick(self, now: float, reading: PlateReading) -> list[Action]:
        """Advance the time."""
        self._write_line({"now": now, "in": "tick", "reading": _plain(reading)}, None)
        return self._logged(super().tick(now, reading))

    def set_owner(self, *, owner: bool, thermal_gain: float | None = None) -> None:
        """Set whether this scene may drive the outputs from now on, and the gain it finds set."""
        self._write_line({"in": "owner", "owner": owner, "thermal_gain": thermal_gain}, None)
        super().set_owner(owner=owner, thermal_gain=thermal_gain)

    def rest(self) -> None:
        """Drop every lease."""
        self._write_line({"in": "rest"}, None)
        super().rest()

    def held(self, scope: Scope) -> None:
        """Note that outputs were stopped."""
        self._write_line({"in": "held", "scope": scope}, None)
        super().held(scope)

    def _logged(self, actions: list[Action]) -> list[Action]:
        """Write what the outputs are to do; recognitions and questions get numbers."""
        numbered = [self._numbered(action) for action in actions]
        if done := outputs(numbered):
            self._write_line({"out": done}, None)
        return numbered

    def _numbered(self, action: Action) -> Action:
        if isinstance(action, RecogniseFrame) and action.teaches is not None:
            return action
        if isinstance(action, RecogniseFrame | AskAmbient | AskMaterial):
            return dataclasses.replace(action, number=next(self._numbers))
        return action


def head(given: dict[str, Any]) -> Line:
    """Write what a session begins with, from the arguments it was made with."""
    return {
        "hapticvlm": __version__,
        "owner": given["owner"],
        "can_ask": given["can_ask"],
        "contact_resistance": given["contact_resistance"],
        "plate_resistance": given.get("plate_resistance", PLATE_RESISTANCE),
        "thermal_gain": given.get("thermal_gain", 1.0),
        "reading": _plain(given["reading"]),
        "materials": list(given["table"]),
        "saved": dict(given.get("saved", {})),
    }


def outputs(actions: list[Action]) -> list[Line]:
    """Write what actions do to the outputs and announce, to compare bit for bit."""
    lines: list[Line] = []
    for action in actions:
        if isinstance(action, Reply):
            if isinstance(action.message, messages.Decision):
                lines.append({"do": "say", **_decision(action.message)})
        elif isinstance(action, PlayVibration):
            lines.append({"do": "Feel", "command": _command(action.command)})
        elif (name := _NAMES.get(type(action))) is not None:
            lines.append({"do": name, **_plain(action)})
    return lines


def _decision(decision: messages.Decision) -> Line:
    """Write a decision; only one not rendered as its material marks it, as in earlier logs."""
    fields: Line = _plain(decision)
    return fields if decision.basis == "expectation" else _without(fields, "basis")


def _command(command: Command) -> Line:
    fields: Line = _plain(command)
    for name, usual in (("gain", 1.0), ("thickness_m", None)):  # earlier logs have neither
        fields = _without(fields, name) if fields[name] == usual else fields
    return {"stroke" if name == "motion" else name: value for name, value in fields.items()}


def _without(fields: Line, name: str) -> Line:
    return {key: value for key, value in fields.items() if key != name}


def _bare(message: ClientMessage) -> Line:
    """Write a message as JSON can hold it: a frame without its pictures."""
    if isinstance(message, Hello):
        message = msgspec.structs.replace(message, token=None)  # never on disk
    if not isinstance(message, Frame):
        return dict(_plain(message))
    bare = msgspec.structs.replace(message, image=b"", mask=None)
    return {**msgspec.to_builtins(bare), "image": None, "mask": message.mask is not None}


def _plain(value: object) -> Any:  # noqa: ANN401 - whatever JSON can hold
    return msgspec.to_builtins(value)
