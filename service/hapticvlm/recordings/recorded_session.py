"""A session that writes a log of its inputs, so that it can be run again bit for bit.

Everything that changes a SceneSession comes in through a few calls, each with the time. A recorded
session writes each call down, in order, before it is carried out: with the same calls a new session
asks for the same outputs. Pictures are no part of that; the shell may keep them beside the log.
The names in the lines are a file format and stay when code is renamed. Knows no file.
"""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Callable, Mapping
from typing import Any

import msgspec

from hapticvlm import __version__, messages
from hapticvlm.evidence.ambient import SceneView
from hapticvlm.evidence.ladder import Evidence
from hapticvlm.evidence.reading import Reading
from hapticvlm.materials import Material
from hapticvlm.messages import ClientMessage, Frame, Hello, Scope
from hapticvlm.recordings.lines import Input, Key, Line, Output
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
    ReleaseHand,
    Reply,
    RestPlate,
    SetGain,
)
from hapticvlm.session.hands import Hold
from hapticvlm.session.session import SceneSession
from hapticvlm.session.settings import SessionSettings
from hapticvlm.session.targets import RecognitionRequest

_NAMES: dict[type, Output] = {
    ReleaseHand: Output.RELEASE,
    SetGain: Output.GAIN,
    DrivePlate: Output.SETPOINT,
    RestPlate: Output.REST_PLATE,
    HoldOutputs: Output.HOLD,
}
WriteLine = Callable[[Line, Frame | None], None]


class RecordedSession(SceneSession):
    """A SceneSession whose inputs, and what it has the outputs do, are written as lines.

    `write_line` is called for every input with a line that JSON can hold, and the frame if any.
    """

    def __init__(
        self, settings: SessionSettings, hold: Hold | None, *, write_line: WriteLine
    ) -> None:
        hold = Hold() if hold is None else hold
        super().__init__(settings, hold)
        self._write = write_line
        self._numbers = itertools.count(1)
        self._hold = hold
        self._known_hold = hold.state

    def receive(self, message: ClientMessage, now: float) -> list[Action]:
        """Receive one message; a refused one is written too, as it may be refused again."""
        frame = message if isinstance(message, Frame) else None
        self._write_line({Key.NOW: now, Key.IN: Input.MESSAGE, Key.MESSAGE: _bare(message)}, frame)
        return self._logged(super().receive(message, now))

    def recognised(
        self,
        request: RecognitionRequest,
        evidence: Evidence | None,
        stages_ms: dict[str, float],
        now: float,
    ) -> list[Action]:
        """Receive what a recognition gave; what only taught the recogniser is no input."""
        if request.reference_material is not None:
            return super().recognised(request, evidence, stages_ms, now)
        line: Line = {Key.NOW: now, Key.IN: Input.RECOGNITION, Key.NUMBER: request.number}
        line |= {Key.STAGES_MS: stages_ms, Key.EVIDENCE: _plain(evidence)}
        self._write_line(line, None)
        return self._logged(super().recognised(request, evidence, stages_ms, now))

    def scene_view_received(
        self, request: RecognitionRequest, scene_view: SceneView | None, now: float
    ) -> list[Action]:
        """Receive the scene view."""
        seen = None
        if scene_view is not None:
            embedding = scene_view.embedding.tolist()
            seen = {Key.EMBEDDING: embedding, Key.BRIGHTNESS: scene_view.brightness}
        line: Line = {Key.NOW: now, Key.IN: Input.SCENE_VIEW, Key.NUMBER: request.number}
        self._write_line({**line, Key.SIGHT: seen}, None)
        return self._logged(super().scene_view_received(request, scene_view, now))

    def answered(self, ask: Ask, answer: Reading | Evidence | None, now: float) -> list[Action]:
        """Receive what a VLM answered."""
        line: Line = {Key.NOW: now, Key.IN: Input.ANSWER, Key.NUMBER: ask.number}
        kind = None if answer is None else type(answer).__name__.lower()
        self._write_line({**line, Key.KIND: kind, Key.ANSWER: _plain(answer)}, None)
        return self._logged(super().answered(ask, answer, now))

    def tick(self, now: float, reading: PlateReading) -> list[Action]:
        """Advance the time."""
        self._write_line({Key.NOW: now, Key.IN: Input.TICK, Key.READING: _plain(reading)}, None)
        return self._logged(super().tick(now, reading))

    def set_owner(self, *, owner: bool, thermal_gain: float | None = None) -> None:
        """Set whether this scene may drive the outputs from now on, and the gain it finds set."""
        line: Line = {Key.IN: Input.OWNER, Key.OWNER: owner, Key.THERMAL_GAIN: thermal_gain}
        self._write_line(line, None)
        super().set_owner(owner=owner, thermal_gain=thermal_gain)

    def rest(self) -> None:
        """Drop every lease."""
        self._write_line({Key.IN: Input.REST}, None)
        super().rest()

    def on_stop(self, scope: Scope) -> None:
        """Note that outputs were stopped."""
        self._known_hold = self._hold.state
        self._write_line({Key.IN: Input.HELD, Key.SCOPE: scope}, None)
        super().on_stop(scope)

    def _write_line(self, line: Line, frame: Frame | None) -> None:
        """Write a line, and before it how the hold stands if another session has changed it.

        A stop holds the outputs for every session, and the release of one lifts the hold for all.
        Without these lines a session beside another one would not replay the same.
        """
        if self._hold.state != self._known_hold:
            self._known_hold = self._hold.state
            self._write({Key.IN: Input.HOLD, Key.HOLD: _plain(self._known_hold)}, None)
        self._write(line, frame)

    def _logged(self, actions: list[Action]) -> list[Action]:
        """Write what the outputs are to do; recognitions and questions get numbers."""
        self._known_hold = self._hold.state
        numbered = [self._numbered(action) for action in actions]
        if done := outputs(numbered):
            self._write_line({Key.OUT: done}, None)
        return numbered

    def _numbered(self, action: Action) -> Action:
        if isinstance(action, RecognitionRequest) and action.reference_material is not None:
            return action
        if isinstance(action, RecognitionRequest | AskAmbient | AskMaterial):
            return dataclasses.replace(action, number=next(self._numbers))
        return action


def head(settings: SessionSettings, hold: Hold) -> Line:
    """Write what a session begins with, the hold of an earlier stop among it."""
    return {
        Key.VERSION: __version__,
        Key.OWNER: settings.owner,
        Key.CAN_ASK: settings.can_ask,
        Key.CONTACT_RESISTANCE: settings.contact_resistance,
        Key.PLATE_RESISTANCE: settings.plate_resistance,
        Key.THERMAL_GAIN: settings.thermal_gain,
        Key.READING: _plain(settings.reading),
        Key.MATERIALS: list(settings.table),
        Key.SAVED: dict(settings.saved_materials),
        Key.HOLD: _plain(hold.state),
    }


def settings_of(head: Line, table: Mapping[str, Material]) -> SessionSettings:
    """Read what a session began with; older logs lack some of it."""
    return SessionSettings(
        owner=head[Key.OWNER],
        reading=msgspec.convert(head[Key.READING], PlateReading),
        table=table,
        saved_materials=head.get(Key.SAVED, {}),
        can_ask=head[Key.CAN_ASK],
        contact_resistance=head[Key.CONTACT_RESISTANCE],
        plate_resistance=head.get(Key.PLATE_RESISTANCE, 0.0),  # older logs took skin for plate
        thermal_gain=head.get(Key.THERMAL_GAIN, 1.0),
    )


def outputs(actions: list[Action]) -> list[Line]:
    """Write what actions do to the outputs and announce, to compare bit for bit."""
    lines: list[Line] = []
    for action in actions:
        if isinstance(action, Reply):
            if isinstance(action.message, messages.Decision):
                lines.append({Key.DO: Output.DECISION, **_decision(action.message)})
        elif isinstance(action, PlayVibration):
            lines.append({Key.DO: Output.VIBRATION, Key.COMMAND: _command(action.command)})
        elif (name := _NAMES.get(type(action))) is not None:
            lines.append({Key.DO: name, **_plain(action)})
    return lines


def _decision(decision: messages.Decision) -> Line:
    """Write a decision; only one not rendered as its material marks it, as in earlier logs."""
    fields: Line = _plain(decision)
    return fields if decision.basis == "expectation" else _without(fields, "basis")


def _command(command: Command) -> Line:
    fields: Line = _plain(command)
    for name, usual in (("gain", 1.0), ("thickness_m", None), ("hum", None)):  # not in earlier logs
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
