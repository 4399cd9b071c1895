"""A session that writes a log of its inputs, so that it can be replayed bit for bit.

Everything that changes a SceneSession comes in through a few calls, each with the time. A recorded
session writes down each call, in order, before it carries it out: given the same calls, a new
session asks for the same outputs. The log does not contain pictures; the recorder may keep them
beside it. Knows no file.
"""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import msgspec

from hapticvlm import __version__, messages
from hapticvlm.evidence.ambient import SceneView
from hapticvlm.evidence.ladder import Evidence
from hapticvlm.evidence.reading import Reading
from hapticvlm.materials import Material
from hapticvlm.messages import ClientMessage, Frame, Hello, LeftOut, SceneObject, Scope
from hapticvlm.recordings.lines import VERSION, Input, Key, Line, Output
from hapticvlm.rendering.heat.limits import PlateReading
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

_KINDS: dict[type, Output] = {
    ReleaseHand: Output.RELEASE,
    SetGain: Output.GAIN,
    DrivePlate: Output.SETPOINT,
    RestPlate: Output.REST_PLATE,
    HoldOutputs: Output.HOLD,
}
WriteLine = Callable[[Line, Frame | None], None]


class RecordedSession(SceneSession):
    """A SceneSession that writes its inputs and outputs as lines.

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

    def receive(
        self, message: ClientMessage, now: float, left_out: Sequence[LeftOut] = ()
    ) -> list[Action]:
        """Receive one message; a refused one is written too, as it may be refused again.

        A message taken in part is written as it was used, beside the parts that were left out.
        """
        frame = message if isinstance(message, Frame) else None
        line: Line = {Key.NOW: now, Key.IN: Input.MESSAGE, Key.MESSAGE: _bare(message)}
        if left_out:
            line[Key.LEFT_OUT] = _plain(left_out)
        self._write_line(line, frame)
        return self._logged(super().receive(message, now, left_out))

    def recognised(
        self,
        request: RecognitionRequest,
        evidence: Evidence | None,
        stages_ms: dict[str, float],
        now: float,
    ) -> list[Action]:
        """Receive a recognition; one that only stored a reference view is not an input."""
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
        fields = None
        if scene_view is not None:
            embedding = scene_view.embedding.tolist()
            fields = {Key.EMBEDDING: embedding, Key.BRIGHTNESS: scene_view.brightness}
        line: Line = {Key.NOW: now, Key.IN: Input.SCENE_VIEW, Key.NUMBER: request.number}
        self._write_line({**line, Key.SCENE_VIEW: fields}, None)
        return self._logged(super().scene_view_received(request, scene_view, now))

    def answered(self, ask: Ask, answer: Reading | Evidence | None, now: float) -> list[Action]:
        """Receive a VLM's answer."""
        line: Line = {Key.NOW: now, Key.IN: Input.ANSWER, Key.NUMBER: ask.number}
        kind = None if answer is None else type(answer).__name__.lower()
        self._write_line({**line, Key.KIND: kind, Key.ANSWER: _plain(answer)}, None)
        return self._logged(super().answered(ask, answer, now))

    def tick(self, now: float, reading: PlateReading) -> list[Action]:
        """Advance the time."""
        self._write_line({Key.NOW: now, Key.IN: Input.TICK, Key.READING: _plain(reading)}, None)
        return self._logged(super().tick(now, reading))

    def set_owner(self, *, owner: bool, thermal_gain: float | None = None) -> None:
        """Set whether this scene may drive the outputs from now on, and the gain now in force."""
        line: Line = {Key.IN: Input.OWNER, Key.OWNER: owner, Key.THERMAL_GAIN: thermal_gain}
        self._write_line(line, None)
        super().set_owner(owner=owner, thermal_gain=thermal_gain)

    def rest(self) -> None:
        """Drop every lease."""
        self._write_line({Key.IN: Input.REST}, None)
        super().rest()

    def write_stop(self, scope: Scope) -> None:
        """Write that outputs were stopped; the shared hold already has the stop.

        Another session may have lifted part of the hold since this one's last line. So the whole
        hold is written first, as after any change that did not come through this session.
        """
        self._write_line({Key.IN: Input.STOP, Key.SCOPE: scope}, None)

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
        """Write the outputs among these actions; recognitions and questions get numbers."""
        self._known_hold = self._hold.state
        numbered = [self._numbered(action) for action in actions]
        if output_lines := outputs(numbered):
            self._write_line({Key.OUT: output_lines}, None)
        return numbered

    def _numbered(self, action: Action) -> Action:
        if isinstance(action, RecognitionRequest) and action.reference_material is not None:
            return action
        if isinstance(action, RecognitionRequest | AskAmbient | AskMaterial):
            return dataclasses.replace(action, number=next(self._numbers))
        return action


def head(settings: SessionSettings, hold: Hold) -> Line:
    """Return the head of a log: the settings a session begins with, and the hold of a stop."""
    return {
        Key.VERSION: VERSION,
        Key.RELEASE: __version__,
        Key.OWNER: settings.owner,
        Key.CAN_ASK: settings.can_ask,
        Key.CONTACT_RESISTANCE: settings.contact_resistance,
        Key.PLATE_RESISTANCE: settings.plate_resistance,
        Key.THERMAL_GAIN: settings.thermal_gain,
        Key.FEEL: settings.feel,
        Key.READING: _plain(settings.reading),
        Key.MATERIALS: list(settings.table),
        Key.SAVED_MATERIALS: {
            object_id: override.material if override.surfaces is None else _plain(override)
            for object_id, override in settings.saved_materials.items()
        },
        Key.HOLD: _plain(hold.state),
    }


def settings_of(head: Line, table: Mapping[str, Material]) -> SessionSettings:
    """Read the settings of a session from the head of its log."""
    return SessionSettings(
        owner=head[Key.OWNER],
        reading=msgspec.convert(head[Key.READING], PlateReading),
        table=table,
        saved_materials={
            object_id: SceneObject(object_id=object_id, material=override)
            if isinstance(override, str)
            else msgspec.convert(override, SceneObject)
            for object_id, override in head[Key.SAVED_MATERIALS].items()
        },
        can_ask=head[Key.CAN_ASK],
        contact_resistance=head[Key.CONTACT_RESISTANCE],
        plate_resistance=head[Key.PLATE_RESISTANCE],
        thermal_gain=head[Key.THERMAL_GAIN],
        feel=head.get(Key.FEEL, "graded"),  # the only one when logs did not have it
    )


def outputs(actions: list[Action]) -> list[Line]:
    """Return a line for each action on an output and each decision, to compare bit for bit."""
    lines: list[Line] = []
    for action in actions:
        if isinstance(action, Reply):
            if isinstance(action.message, messages.Decision):
                lines.append({Key.DO: Output.DECISION, **_decision(action.message)})
        elif isinstance(action, PlayVibration):
            lines.append({Key.DO: Output.VIBRATION, Key.COMMAND: _plain(action.command)})
        elif (kind := _KINDS.get(type(action))) is not None:
            lines.append({Key.DO: kind, **_plain(action)})
    return lines


def _decision(decision: messages.Decision) -> Line:
    """Return a decision's fields; basis and what is felt only where the material is not named.

    Early logs lack them elsewhere, and the reason why nothing is felt, and the words of what is.
    With the same rule in all of them one comparison serves all.
    """
    fields: Line = _plain(decision)
    if decision.basis in ("material", "neutral", None):
        fields.pop("basis", None)
        fields.pop("felt", None)
    fields.pop("neutral_because", None)
    fields.pop("feels", None)
    return fields


def _bare(message: ClientMessage) -> Line:
    """Return a message as JSON can hold it: a frame without its pictures."""
    if isinstance(message, Hello):
        message = msgspec.structs.replace(message, token=None)  # never on disk
    if not isinstance(message, Frame):
        return dict(_plain(message))
    bare = msgspec.structs.replace(message, image=b"", mask=None)
    return {**msgspec.to_builtins(bare), "image": None, "mask": message.mask is not None}


def _plain(value: object) -> Any:  # noqa: ANN401 - whatever JSON can hold
    return msgspec.to_builtins(value)
