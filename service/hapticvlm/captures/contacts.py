"""Lists the touches of a capture, from contact to release, each with its decision.

The truth comes from the capture and is used only to compare.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from hapticvlm.captures.capture import Capture
from hapticvlm.captures.lines import Line

Message = dict[str, Any]
Timed = list[tuple[float, Message]]


@dataclass(frozen=True, slots=True)
class Contact:
    """One touch of the capture, from contact to release, and the decision on its object."""

    object_id: str
    name: str
    truth: str | None
    started_s: float
    ended_s: float
    decision: Message | None
    frame: Line | None

    @property
    def outcome(self) -> str:
        """`right`, `unknown` or `wrong`: the decision compared with the capture's truth."""
        material = self.decision["material"] if self.decision else "unknown"
        if material == self.truth:
            return "right"
        return "unknown" if material == "unknown" else "wrong"


def contacts(capture: Capture, decisions: Timed) -> list[Contact]:
    """Return the capture's touches in order, each with its last decision before its release."""
    known = names(capture)
    frames: list[Line] = []
    open_: dict[str, tuple[Line, Line | None]] = {}
    touches: list[Contact] = []
    for line in capture.lines():
        if line.type == "frame":
            frames.append(line)
        elif line.type == "touch":
            hand = line.fields["hand"]
            phase = line.fields["phase"]
            if phase == "contact" and hand not in open_:
                object_id = line.fields.get("object_id")
                open_[hand] = (line, _shows(frames, object_id))
            elif phase == "release" and hand in open_:
                first, frame = open_.pop(hand)
                touches.append(_contact(first, line.t_s, frame, known, decisions))
    return touches


def names(capture: Capture) -> dict[str, str]:
    """Return the names the capture's scenes state, by object id."""
    scenes = [line.fields["objects"] for line in capture.lines() if line.type == "scene"]
    return {o["object_id"]: o.get("name", o["object_id"]) for scene in scenes for o in scene}


def _contact(
    first: Line, ended_s: float, frame: Line | None, names: dict[str, str], decisions: Timed
) -> Contact:
    object_id = first.fields.get("object_id", "")
    by_then = [d for at, d in decisions if d.get("object_id") == object_id and at <= ended_s]
    return Contact(
        object_id=object_id,
        name=names.get(object_id, object_id),
        truth=first.truth,
        started_s=first.t_s,
        ended_s=ended_s,
        decision=by_then[-1] if by_then else None,
        frame=frame,
    )


def _shows(frames: list[Line], object_id: str | None) -> Line | None:
    """Return the newest frame that shows the object, else the newest."""
    newest = frames[-1] if frames else None
    recent = (line for line in reversed(frames[-10:]) if line.fields.get("object_id") == object_id)
    return next(recent, newest)
