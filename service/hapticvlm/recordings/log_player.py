"""Feeds a recorded session to a fresh one, line by line, and compares what comes out.

What was recognised is taken from the session log, so that the outputs must come out bit for bit
the same; with a recogniser the kept frames are recognised anew and the differences are counted.
"""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

import msgspec
import numpy as np

from hapticvlm import messages
from hapticvlm.evidence.ambient import SceneView
from hapticvlm.evidence.ladder import Evidence
from hapticvlm.evidence.reading import Reading
from hapticvlm.materials import Material
from hapticvlm.messages import ClientMessage, Frame, MessageError
from hapticvlm.recordings.recorded_session import RecordedSession
from hapticvlm.recordings.session_log import Line, SessionLogError, blank_picture
from hapticvlm.rendering.heat.limits import PlateReading
from hapticvlm.rendering.vibration.voices import Command
from hapticvlm.session.actions import (
    Action,
    AskAmbient,
    AskMaterial,
    PlayVibration,
    RecogniseFrame,
    ReleaseHand,
    SetGain,
)
from hapticvlm.session.hands import Hold
from hapticvlm.vision.frame_recogniser import FrameRecogniser


@dataclass(slots=True)
class Replayed:
    """What a replay came to; times of sounds are in s of the log's clock."""

    lines: int = 0
    counts: Counter[str] = field(default_factory=Counter)
    outputs: int = 0
    differing: int = 0
    first_difference: str | None = None
    missing: int = 0
    sounds: list[tuple[float, Command | ReleaseHand | SetGain]] = field(default_factory=list)

    @property
    def is_same(self) -> bool:
        """Whether every output came out as recorded and no line of the log was lost."""
        return not self.differing and not self.missing


class LogPlayer:
    """The session that a record is played to, and what it came to so far: `outcome`."""

    def __init__(
        self,
        folder: Path,
        head: Line,
        table: Mapping[str, Material],
        recogniser: FrameRecogniser | None,
    ) -> None:
        self._folder = folder
        self._recogniser = recogniser
        self._hold = Hold()
        self._written: list[Line] = []
        self._session = RecordedSession(
            write_line=lambda line, _: self._written.append(line),
            owner=head["owner"],
            hold=self._hold,
            reading=msgspec.convert(head["reading"], PlateReading),
            table=table,
            saved=head.get("saved", {}),
            can_ask=head["can_ask"],
            contact_resistance=head["contact_resistance"],
            plate_resistance=head.get("plate_resistance", 0.0),  # older logs took skin for plate
            thermal_gain=head.get("thermal_gain", 1.0),
        )
        self._recognitions: dict[int, RecogniseFrame] = {}
        self._blanks: set[bytes] = set()  # that stand for pictures which were not kept
        self._asks: dict[int, AskAmbient | AskMaterial] = {}
        self._outputs: list[Line] = []
        self._now = 0.0
        self._next_line = 1
        self.outcome = Replayed()

    def play(self, line: Line) -> None:
        """Feed one line, or compare one line of outputs with what just came out."""
        self.outcome.missing += line["line"] - self._next_line
        self._next_line = line["line"] + 1
        self.outcome.lines += 1
        if "out" in line:
            self._compare(line)
            return
        self._finish(line)
        self._now = line.get("now", self._now)
        self.outcome.counts[line["in"]] += 1
        play = getattr(self, f"_play_{line['in']}")
        self._apply(play(line))

    def _apply(self, actions: list[Action]) -> None:
        outs = [line["out"] for line in self._written if "out" in line]
        self._written.clear()
        self._outputs = outs[0] if outs else []
        for action in actions:
            match action:
                case RecogniseFrame():
                    self._recognitions[action.number] = action
                case AskAmbient() | AskMaterial():
                    self._asks[action.number] = action
                case PlayVibration():
                    self.outcome.sounds.append((self._now, action.command))
                case ReleaseHand() | SetGain():
                    self.outcome.sounds.append((self._now, action))

    def _compare(self, line: Line) -> None:
        recorded, self._outputs, outputs = line["out"], [], self._outputs
        self.outcome.outputs += len(recorded)
        if recorded != msgspec.json.decode(msgspec.json.encode(outputs)):
            self._differ(line, f"recorded {_short(recorded)}, now {_short(outputs)}")

    def _finish(self, line: Line) -> None:
        """Notice outputs that came out now and are not in the log."""
        if self._outputs:
            self._differ(line, f"not recorded, now {_short(self._outputs)}")
            self._outputs = []

    def _differ(self, line: Line, difference: str) -> None:
        self.outcome.differing += 1
        if self.outcome.first_difference is None:
            self.outcome.first_difference = f"line {line['line']}: {difference}"

    def _play_message(self, line: Line) -> list[Action]:
        message = self._message(line)
        try:
            return self._session.receive(message, line["now"])
        except MessageError:
            return []

    def _play_look(self, line: Line) -> list[Action]:
        request = self._recognitions.pop(line["number"])
        evidence = None
        if line["evidence"] is not None:
            evidence = msgspec.convert(line["evidence"], Evidence)
        if self._recogniser is not None and evidence is not None:
            evidence = self._recognise_anew(request, evidence)
        return self._session.recognised(request, evidence, line["stages_ms"], line["now"])

    def _play_sight(self, line: Line) -> list[Action]:
        request, seen = self._recognitions.pop(line["number"]), line["sight"]
        view = None
        if seen is not None:
            view = SceneView(np.array(seen["embedding"], np.float32), seen["brightness"])
        return self._session.scene_view_received(request, view, line["now"])

    def _play_answer(self, line: Line) -> list[Action]:
        ask, kinds = self._asks.pop(line["number"]), {"reading": Reading, "evidence": Evidence}
        kind = line["kind"]
        answer = None if kind is None else msgspec.convert(line["answer"], kinds[kind])
        return self._session.answered(ask, answer, line["now"])

    def _play_tick(self, line: Line) -> list[Action]:
        reading = msgspec.convert(line["reading"], PlateReading)
        return self._session.tick(line["now"], reading)

    def _play_rest(self, _: Line) -> list[Action]:
        self._session.rest()
        return []

    def _play_owner(self, line: Line) -> list[Action]:
        self._session.set_owner(owner=line["owner"], thermal_gain=line.get("thermal_gain"))
        return []

    def _play_held(self, line: Line) -> list[Action]:
        self._hold.stop(line["scope"])
        return []

    def _message(self, line: Line) -> ClientMessage:
        fields = dict(line["message"])
        if fields["type"] == "frame":
            has_mask = fields.pop("mask")
            size = fields["width"], fields["height"]
            fields["image"] = self._kept(line.get("file"), fields["format"], *size)
            if has_mask:
                fields["mask"] = self._kept(line.get("mask_file"), "png", *size)
        return messages.decode(msgspec.msgpack.encode(fields))

    def _kept(self, name: str | None, kind: str, width: int, height: int) -> bytes:
        """Read a picture of the record; a blank of the same size where none was kept."""
        if name is not None:
            return (self._folder / name).read_bytes()
        blank = blank_picture(kind, width, height)
        self._blanks.add(blank)
        return blank

    def _recognise_anew(self, request: RecogniseFrame, before: Evidence) -> Evidence:
        assert self._recogniser is not None
        if request.frame.image in self._blanks:
            self.outcome.counts["picture not kept"] += 1
            return before
        frame: Frame = msgspec.structs.replace(request.frame, id=1)
        seen = self._recogniser.recognise(
            msgspec.msgpack.encode(frame), str(request.key), 0.0, anew=True
        )
        if seen.evidence is None:
            raise SessionLogError(
                f"{self._folder}: {seen.error}; --recognise needs the frames kept"
            )
        self.outcome.counts["recognised anew"] += 1
        self.outcome.counts["recognised differently"] += seen.evidence.material != before.material
        return seen.evidence


def _short(outputs: list[Line]) -> str:
    text = json.dumps(outputs, default=str)
    return text if len(text) < 300 else text[:300] + "..."
