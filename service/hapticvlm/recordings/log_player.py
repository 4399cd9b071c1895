"""Feeds a recorded session to a new one, line by line, and compares the outputs.

Recognitions are taken from the session log, so the outputs must be the same bit for bit. With a
recogniser the kept frames are recognised again instead, and the differences are counted.
"""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

import msgspec
import numpy as np

from hapticvlm import messages
from hapticvlm.evidence.ambient import SceneView
from hapticvlm.evidence.ladder import Evidence
from hapticvlm.evidence.reading import Reading
from hapticvlm.materials import Material
from hapticvlm.messages import ClientMessage, Frame, HandName, LeftOut, MessageError
from hapticvlm.recordings.lines import Input, Key, Line
from hapticvlm.recordings.recorded_session import RecordedSession, settings_of
from hapticvlm.recordings.session_log import blank_picture, read_picture
from hapticvlm.rendering.heat.limits import PlateReading
from hapticvlm.rendering.vibration.voices import Command
from hapticvlm.session.actions import (
    Action,
    AskAmbient,
    AskMaterial,
    PlayVibration,
    ReleaseHand,
    SetGain,
)
from hapticvlm.session.hands import Hold, Output
from hapticvlm.session.scene_model import SceneModel
from hapticvlm.session.targets import RecognitionRequest, name_of

HoldState = list[tuple[Output, HandName, bool]]
# Recognises a picture again, under a name for its subject. Raises SessionLogError.
Recognise = Callable[[Frame, str], Evidence]


@dataclass(slots=True)
class Replayed:
    """The result of a replay; times of sounds are in s of the log's clock.

    `model` is the scene as the session left it.
    """

    model: SceneModel
    lines: int = 0
    counts: Counter[str] = field(default_factory=Counter)
    outputs: int = 0
    differing: int = 0
    first_difference: str | None = None
    missing: int = 0
    sounds: list[tuple[float, Command | ReleaseHand | SetGain]] = field(default_factory=list)

    @property
    def is_same(self) -> bool:
        """Whether every output is as recorded and no line of the log was lost."""
        return not self.differing and not self.missing


class LogPlayer:
    """The session that a log is played to; `outcome` is the result so far."""

    def __init__(
        self,
        folder: Path,
        head: Line,
        table: Mapping[str, Material],
        recognise: Recognise | None,
    ) -> None:
        self._folder = folder
        self._recognise = recognise
        self._hold = Hold()
        self._hold.restore(msgspec.convert(head.get(Key.HOLD, []), HoldState))
        self._written: list[Line] = []
        self._session = RecordedSession(
            settings_of(head, table),
            self._hold,
            write_line=lambda line, _: self._written.append(line),
        )
        self._recognitions: dict[int, RecognitionRequest] = {}
        self._blanks: set[bytes] = set()  # in place of pictures that were not kept
        self._asks: dict[int, AskAmbient | AskMaterial] = {}
        self._outputs: list[Line] = []
        self._now = 0.0
        self._next_line = 1
        self.outcome = Replayed(self._session.model)

    def play(self, line: Line) -> None:
        """Feed one line, or compare one line of outputs with those of the line before."""
        self.outcome.missing += line[Key.LINE] - self._next_line
        self._next_line = line[Key.LINE] + 1
        self.outcome.lines += 1
        if Key.OUT in line:
            self._compare(line)
            return
        self._finish(line)
        self._now = line.get(Key.NOW, self._now)
        self.outcome.counts[line[Key.IN]] += 1
        self._apply(self._play(msgspec.convert(line[Key.IN], Input), line))

    def _apply(self, actions: list[Action]) -> None:
        outputs = [line[Key.OUT] for line in self._written if Key.OUT in line]
        self._written.clear()
        self._outputs = outputs[0] if outputs else []
        for action in actions:
            match action:
                case RecognitionRequest():
                    self._recognitions[action.number] = action
                case AskAmbient() | AskMaterial():
                    self._asks[action.number] = action
                case PlayVibration():
                    self.outcome.sounds.append((self._now, action.command))
                case ReleaseHand() | SetGain():
                    self.outcome.sounds.append((self._now, action))

    def _compare(self, line: Line) -> None:
        recorded, self._outputs, outputs = line[Key.OUT], [], self._outputs
        self.outcome.outputs += len(recorded)
        if recorded != msgspec.json.decode(msgspec.json.encode(outputs)):
            self._differ(line, f"recorded {_short(recorded)}, now {_short(outputs)}")

    def _finish(self, line: Line) -> None:
        """Count outputs of the replay that are not in the log."""
        if self._outputs:
            self._differ(line, f"not recorded, now {_short(self._outputs)}")
            self._outputs = []

    def _differ(self, line: Line, difference: str) -> None:
        self.outcome.differing += 1
        if self.outcome.first_difference is None:
            self.outcome.first_difference = f"line {line[Key.LINE]}: {difference}"

    def _play(self, kind: Input, line: Line) -> list[Action]:
        match kind:
            case Input.MESSAGE:
                return self._play_message(line)
            case Input.RECOGNITION:
                return self._play_recognition(line)
            case Input.SCENE_VIEW:
                return self._play_scene_view(line)
            case Input.ANSWER:
                return self._play_answer(line)
            case Input.TICK:
                reading = msgspec.convert(line[Key.READING], PlateReading)
                return self._session.tick(line[Key.NOW], reading)
            case _:
                self._play_order(kind, line)
                return []

    def _play_order(self, kind: Input, line: Line) -> None:
        """Give the session an order from outside, which it answers with no action."""
        match kind:
            case Input.REST:
                self._session.rest()
            case Input.OWNER:
                gain = line.get(Key.THERMAL_GAIN)
                self._session.set_owner(owner=line[Key.OWNER], thermal_gain=gain)
            case Input.STOP:
                self._hold.stop(line[Key.SCOPE])
            case Input.HOLD:
                self._hold.restore(msgspec.convert(line[Key.HOLD], HoldState))

    def _play_message(self, line: Line) -> list[Action]:
        message = self._message(line)
        try:
            left_out = msgspec.convert(line.get(Key.LEFT_OUT, []), list[LeftOut])
            return self._session.receive(message, line[Key.NOW], left_out)
        except MessageError:
            return []

    def _play_recognition(self, line: Line) -> list[Action]:
        request = self._recognitions.pop(line[Key.NUMBER])
        evidence = None
        if line[Key.EVIDENCE] is not None:
            evidence = msgspec.convert(line[Key.EVIDENCE], Evidence)
        if self._recognise is not None and evidence is not None:
            evidence = self._recognise_again(request, evidence)
        stages_ms = line[Key.STAGES_MS]
        return self._session.recognised(request, evidence, stages_ms, line[Key.NOW])

    def _play_scene_view(self, line: Line) -> list[Action]:
        request = self._recognitions.pop(line[Key.NUMBER])
        fields = line[Key.SCENE_VIEW]
        view = None
        if fields is not None:
            embedding = np.array(fields[Key.EMBEDDING], np.float32)
            view = SceneView(embedding, fields[Key.BRIGHTNESS])
        return self._session.scene_view_received(request, view, line[Key.NOW])

    def _play_answer(self, line: Line) -> list[Action]:
        ask = self._asks.pop(line[Key.NUMBER])
        kinds = {"reading": Reading, "evidence": Evidence}
        kind = line[Key.KIND]
        answer = None if kind is None else msgspec.convert(line[Key.ANSWER], kinds[kind])
        return self._session.answered(ask, answer, line[Key.NOW])

    def _message(self, line: Line) -> ClientMessage:
        fields = dict(line[Key.MESSAGE])
        if fields["type"] == "frame":
            has_mask = fields.pop("mask")
            size = fields["width"], fields["height"]
            fields["image"] = self._kept(line.get(Key.FILE), fields["format"], *size)
            if has_mask:
                fields["mask"] = self._kept(line.get(Key.MASK_FILE), "png", *size)
        return messages.decode(msgspec.msgpack.encode(fields))

    def _kept(self, name: str | None, kind: str, width: int, height: int) -> bytes:
        """Read a picture of the record, or return a blank of its size where none was kept."""
        if name is not None:
            return read_picture(self._folder, name)
        blank = blank_picture(kind, width, height)
        self._blanks.add(blank)
        return blank

    def _recognise_again(self, request: RecognitionRequest, before: Evidence) -> Evidence:
        assert self._recognise is not None
        if request.picture.image in self._blanks:
            self.outcome.counts["picture not kept"] += 1
            return before
        evidence = self._recognise(request.picture, name_of(request.target))
        self.outcome.counts["recognised again"] += 1
        self.outcome.counts["recognised differently"] += evidence.material != before.material
        return evidence


def _short(outputs: list[Line]) -> str:
    line = json.dumps(outputs, default=str)
    return line if len(line) < 300 else line[:300] + "..."
