"""Puts a recorded session on one clock: frames, touches, decisions, plate and vibration.

The vibration is rendered again from the recorded commands, bit for bit as the speaker played it, so
that it has the right time beside the pictures. Times are seconds since the first message.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
from numpy.typing import NDArray

from hapticvlm.materials import Material
from hapticvlm.messages import SceneObject
from hapticvlm.recordings.lines import Input, Key, Output
from hapticvlm.recordings.log_player import Replayed
from hapticvlm.recordings.recorder import SESSION_LOG
from hapticvlm.recordings.replay import replay, waveform
from hapticvlm.recordings.session_log import (
    DAMAGED,
    SessionLogError,
    kept_picture,
    not_a_line,
    read_session_log,
)
from hapticvlm.rendering.vibration.vibration import RATE_HZ
from hapticvlm.rendering.vibration.voices import Voices
from hapticvlm.session.scene_objects import MAX_KNOWN, title_of
from hapticvlm.session.targets import ObjectTarget, ThingTarget, of_object, whole

PLATE_STEP_S = 0.04  # fine enough: a visible change of the plate takes a second

_JOINT = re.compile(r"_+|(?<=[a-z\d])(?=[A-Z])|(?<=[A-Z])(?=[A-Z][a-z])")
_CODE = re.compile(r"\b[A-Z]_(?=[^\W\d_])")
_COPY = re.compile(r"(?<=[^\W\d])([_.-]*\d+| ?\(\d+\))(?=[,/]|$)")


@dataclass(frozen=True, slots=True)
class Picture:
    """One frame that was kept: its time, its files, and the object or region it was sent for."""

    t_s: float
    file: Path
    mask: Path | None
    object_id: str | None
    region: Mapping[str, float] | None


@dataclass(frozen=True, slots=True)
class Decided:
    """A decision, as in protocol v1, and its time."""

    t_s: float
    decision: Mapping[str, Any]

    @property
    def target(self) -> ThingTarget:
        """The surface of an object that it is about, or the view as a whole."""
        return _target_of(self.decision)


@dataclass(frozen=True, slots=True)
class TouchSpan:
    """One touch of a surface: from contact to release, or to the next surface.

    `motion` has the times (s) at which the hand began to move over it (True) or stopped (False).
    """

    hand: str
    target: ThingTarget
    from_s: float
    to_s: float
    motion: tuple[tuple[float, bool], ...]

    @property
    def object_id(self) -> str | None:
        """The object touched; None for a region of the view."""
        return self.target.object_id if isinstance(self.target, ObjectTarget) else None

    @property
    def surface(self) -> int:
        """The index of its surface; 0 is the largest, or the view."""
        return self.target.surface if isinstance(self.target, ObjectTarget) else 0


@dataclass(frozen=True, slots=True)
class PlatePoint:
    """A report of the plate; None is a missing reading."""

    t_s: float
    setpoint_c: float
    plate_c: float | None


@dataclass(frozen=True, slots=True)
class Timeline:
    """A session in order of time; `wave` is (N,) float32 at RATE_HZ from time 0."""

    names: Mapping[ThingTarget, str]
    pictures: tuple[Picture, ...]
    decisions: tuple[Decided, ...]
    touches: tuple[TouchSpan, ...]
    plate: tuple[PlatePoint, ...]
    wave: NDArray[np.float32]
    duration_s: float

    def name(self, target: ThingTarget) -> str:
        """Return the scene's name for a surface of an object, else the object's id."""
        if not isinstance(target, ObjectTarget):
            return "the view"
        return self.names.get(target, target.object_id)

    def title(self, target: ThingTarget) -> str:
        """Return the name in plain words, numbered where another one has the same words."""
        name = self.name(target)
        words = in_plain_words(name)
        others = (other for other in self.names.values() if other != name)
        has_twin = any(in_plain_words(other) == words for other in others)
        return in_plain_words(name, numbered=True) if has_twin else words

    def touch_at(self, t_s: float) -> TouchSpan | None:
        """Return the newest touch that lasts at this time."""
        at_time = (touch for touch in reversed(self.touches) if touch.from_s <= t_s <= touch.to_s)
        return next(at_time, None)

    def decision_at(self, t_s: float, target: ThingTarget) -> Mapping[str, Any] | None:
        """Return the newest decision on a surface of an object by this time."""
        decisions = (
            entry.decision
            for entry in reversed(self.decisions)
            if entry.t_s <= t_s and entry.target == target
        )
        return next(decisions, None)


@lru_cache(maxsize=2 * MAX_KNOWN)  # each title asks for the words of all names of its scene
def in_plain_words(name: str, *, numbered: bool = False) -> str:
    """Return an object's name as a reader would write it: "Tea mug" for "TeaMug_01".

    Words joined by capitals or underscores are parted. An engine's code before them ("M_") and the
    number of a copy, as Unity and Blender append it, are left out; `numbered` keeps the number.
    """
    words = _JOINT.split(_CODE.sub("", name if numbered else _COPY.sub("", name)))
    parted = " ".join(word if word.isupper() else word[:1].lower() + word[1:] for word in words)
    parted = parted.strip()
    return parted[:1].upper() + parted[1:] or name


def read(
    folder: Path, table: Mapping[str, Material], voices: Voices, longest_s: float = math.inf
) -> Timeline:
    """Read a recorded session of at most `longest_s`. Raises SessionLogError."""
    builder = _TimelineBuilder(folder)
    for number, line in enumerate(read_session_log(folder), 1):
        try:
            builder.add(line)
        except DAMAGED as error:
            raise not_a_line(f"{folder / SESSION_LOG}:{number}", error) from None
    if builder.started is None:
        raise SessionLogError(f"{folder}: nothing was sent in this session")
    if builder.now_s > longest_s:
        raise SessionLogError(
            f"{folder} lasts {builder.now_s / 60:.0f} min; the limit of a page is "
            f"{longest_s / 60:.0f} min: record shorter sessions, or use --wav"
        )
    return builder.timeline(replay(folder, table), voices)


@dataclass(slots=True)
class _OpenTouch:
    target: ThingTarget
    from_s: float
    motion: list[tuple[float, bool]] = field(default_factory=list)

    def moves(self, now_s: float, *, is_moving: bool) -> None:
        if is_moving != (self.motion[-1][1] if self.motion else False):
            self.motion.append((now_s, is_moving))

    def ended(self, hand: str, now_s: float) -> TouchSpan:
        return TouchSpan(hand, self.target, self.from_s, now_s, tuple(self.motion))


@dataclass(slots=True)
class _TimelineBuilder:
    """Collects the entries of a timeline from the lines of a session log."""

    folder: Path
    started: float | None = None
    now_s: float = 0.0
    names: dict[ThingTarget, str] = field(default_factory=dict)
    pictures: list[Picture] = field(default_factory=list)
    decisions: list[Decided] = field(default_factory=list)
    touches: list[TouchSpan] = field(default_factory=list)
    plate: list[PlatePoint] = field(default_factory=list)
    open: dict[str, _OpenTouch] = field(default_factory=dict)

    def add(self, line: Mapping[str, Any]) -> None:
        now = line.get(Key.NOW)
        if now is not None:
            if self.started is None and line[Key.IN] == Input.MESSAGE:
                self.started = now
            self.now_s = 0.0 if self.started is None else now - self.started
        if line.get(Key.IN) == Input.MESSAGE:
            self._message(line)
        elif line.get(Key.IN) == Input.TICK and self.started is not None:
            self._reading(line[Key.READING])
        for output in line.get(Key.OUT, ()):
            if output[Key.DO] == Output.DECISION:
                self.decisions.append(Decided(self.now_s, _without_do(output)))

    def timeline(self, outcome: Replayed, voices: Voices) -> Timeline:
        started = self.started or 0.0
        wave = waveform(outcome, voices, started)
        for hand, touch in self.open.items():
            self.touches.append(touch.ended(hand, self.now_s))
        return Timeline(
            names=self.names,
            pictures=tuple(self.pictures),
            decisions=tuple(self.decisions),
            touches=tuple(sorted(self.touches, key=lambda touch: touch.from_s)),
            plate=tuple(self.plate),
            wave=wave,
            duration_s=max(self.now_s, wave.size / RATE_HZ),
        )

    def _message(self, line: Mapping[str, Any]) -> None:
        message = line[Key.MESSAGE]
        match message["type"]:
            case "scene":
                for facts in msgspec.convert(message["objects"], list[SceneObject]):
                    self.names |= _names_of(facts)
            case "frame":
                self._frame(message, line)
            case "touch":
                self._touch(message)

    def _frame(self, message: Mapping[str, Any], line: Mapping[str, Any]) -> None:
        if line.get(Key.FILE) is None or message["format"] not in ("jpeg", "png"):
            return
        mask = line.get(Key.MASK_FILE)
        self.pictures.append(
            Picture(
                self.now_s,
                kept_picture(self.folder, line[Key.FILE]),
                None if mask is None else kept_picture(self.folder, mask),
                message.get("object_id"),
                message.get("region"),
            )
        )

    def _touch(self, message: Mapping[str, Any]) -> None:
        hand = message["hand"]
        target = _target_of(message)
        if target not in self.names:
            target = whole(target)  # as the session feels a surface that nothing states
        before = self.open.get(hand)
        is_held = message["phase"] in ("contact", "slide")
        if before is not None and (not is_held or before.target != target):
            self.touches.append(before.ended(hand, self.now_s))
            del self.open[hand]
        if is_held:
            touch = self.open.setdefault(hand, _OpenTouch(target, self.now_s))
            touch.moves(self.now_s, is_moving=(message.get("speed_mps") or 0.0) > 0.0)

    def _reading(self, reading: Mapping[str, Any]) -> None:
        if self.plate and self.now_s - self.plate[-1].t_s < PLATE_STEP_S:
            return
        self.plate.append(PlatePoint(self.now_s, reading["setpoint_c"], reading["plate_c"]))


def _target_of(message: Mapping[str, Any]) -> ThingTarget:
    return of_object(message.get("object_id"), message.get("surface") or 0)


def _names_of(facts: SceneObject) -> dict[ThingTarget, str]:
    """Return the names of an object's surfaces; one that is alone has the name of its object."""
    indices = range(max(1, len(facts.surfaces or ())))
    return {
        ObjectTarget(facts.object_id, index): title_of(facts, index) or facts.object_id
        for index in indices
    }


def _without_do(output: Mapping[str, Any]) -> dict[str, Any]:
    return {name: value for name, value in output.items() if name != Key.DO}
