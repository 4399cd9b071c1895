"""What a demo leaves behind: a plot of the plate, a filmstrip of the touches, a summary.

Reads decisions and telemetry as they were received; decides nothing itself. Truth comes from the
capture and is used for the comparison only.
"""

from __future__ import annotations

import json
from collections import Counter
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from hapticvlm.captures import Capture, Line
from hapticvlm.client.connection import Message
from hapticvlm.client.sending import Outcome
from hapticvlm.palette import BAD, GOOD, GROUND, INK, SETPOINT, SOFT, UNSURE, WARM

THUMB_PX = 224
CAPTION_PX = 76
COLUMNS = 4

Timed = list[tuple[float, Message]]


@dataclass(frozen=True, slots=True)
class Contact:
    """One touch of the capture, from contact to release, and what was decided of it."""

    object_id: str
    name: str
    truth: str | None
    started_s: float
    ended_s: float
    decision: Message | None
    frame: Line | None

    @property
    def outcome(self) -> str:
        """right, unknown (decided so) or wrong; against the capture's truth."""
        material = self.decision["material"] if self.decision else "unknown"
        if material == self.truth:
            return "right"
        return "unknown" if material == "unknown" else "wrong"


def write(
    capture: Capture, outcome: Outcome, decisions: Timed, telemetry: Timed, out: Path
) -> list[Path]:
    """Write the report's files into `out`; return the files a person may open."""
    touches = contacts(capture, decisions)
    plot, strip = out / "plate.png", out / "touches.png"
    draw_plate(telemetry, touches, plot)
    draw_touches(touches, strip)
    result = summary(capture, outcome, touches, decisions, telemetry)
    (out / "summary.json").write_text(json.dumps(result, indent=1) + "\n", encoding="utf-8")
    (out / "summary.txt").write_text(as_text(result), encoding="utf-8")
    kept = ("vibration.wav", "decisions.jsonl", "summary.json")
    return [strip, plot, *(out / name for name in kept)]


def contacts(capture: Capture, decisions: Timed) -> list[Contact]:
    """Return the capture's touches in order, each with its last decision before its release."""
    known = names(capture)
    frames: list[Line] = []
    open_: dict[str, tuple[Line, Line | None]] = {}
    found: list[Contact] = []
    for line in capture.lines():
        if line.type == "frame":
            frames.append(line)
        elif line.type == "touch":
            hand, phase = line.fields["hand"], line.fields["phase"]
            if phase == "contact" and hand not in open_:
                object_id = line.fields.get("object_id")
                open_[hand] = (line, _shows(frames, object_id))
            elif phase == "release" and hand in open_:
                first, frame = open_.pop(hand)
                found.append(_contact(first, line.t_s, frame, known, decisions))
    return found


def names(capture: Capture) -> dict[str, str]:
    """Return the names the capture's scenes state, by object id."""
    stated = [line.fields["objects"] for line in capture.lines() if line.type == "scene"]
    return {o["object_id"]: o.get("name", o["object_id"]) for scene in stated for o in scene}


def draw_plate(telemetry: Timed, touches: list[Contact], path: Path) -> None:
    """Plot plate, setpoint and speaker level over time with the touches marked."""
    import matplotlib as mpl

    mpl.use("Agg")
    from matplotlib import pyplot as plt

    at = [t for t, _ in telemetry]
    figure, (heat, sound) = plt.subplots(
        2, 1, figsize=(11, 5.5), sharex=True, height_ratios=(3, 1), layout="constrained"
    )
    setpoints = [event["setpoint_c"] for _, event in telemetry]
    plates = [event["plate_c"] for _, event in telemetry]
    heat.axhline(32.0, color=SOFT, linewidth=0.8, linestyle=":", label="neutral")
    heat.plot(at, setpoints, color=SETPOINT, label="setpoint")
    heat.plot(at, plates, color=WARM, label="plate (simulated)")
    low, high = heat.get_ylim()
    heat.set_ylim(low, high + 0.25 * (high - low))
    for number, touch in enumerate(touches):
        for axis in (heat, sound):
            axis.axvspan(touch.started_s, touch.ended_s, color=SETPOINT, alpha=0.10)
        material = touch.decision["material"] if touch.decision else "unknown"
        heat.text(
            touch.started_s,
            high + (0.13 if number % 2 else 0.02) * (high - low),
            f"{touch.name}\n{material}",
            fontsize=6.5,
            color=_colour(touch),
            va="bottom",
        )
    heat.set_ylabel("degC")
    heat.legend(loc="lower left", ncols=3, fontsize=8)
    heat.set_title("Plate temperature while the hand touches (shaded)", fontsize=10)
    sound.plot(at, [event["speaker_level"] for _, event in telemetry], color=INK)
    sound.set_ylabel("vibration rms")
    sound.set_xlabel("s")
    figure.savefig(path, dpi=130)
    plt.close(figure)


def draw_touches(touches: list[Contact], path: Path) -> None:
    """Draw the frame of each touch, its region, and the decision beside the truth."""
    rows = max(1, -(-len(touches) // COLUMNS))
    columns = min(COLUMNS, max(1, len(touches)))
    cell = THUMB_PX + 12
    height = THUMB_PX + CAPTION_PX
    sheet = Image.new("RGB", (columns * cell + 12, rows * height + 12), GROUND)
    for number, touch in enumerate(touches):
        x, y = 12 + number % columns * cell, 12 + number // columns * height
        sheet.paste(_thumbnail(touch), (x, y))
        _caption(ImageDraw.Draw(sheet), touch, x, y + THUMB_PX + 4)
    sheet.save(path)


def summary(
    capture: Capture, outcome: Outcome, touches: list[Contact], decisions: Timed, telemetry: Timed
) -> dict[str, Any]:
    """Return the run in figures."""
    newest = telemetry[-1][1] if telemetry else {}
    stages = [d["stages_ms"] for _, d in decisions if d.get("stages_ms")]
    return {
        "capture": capture.path.name,
        "seconds": round(outcome.seconds, 2),
        "sent": dict(outcome.sent),
        "answers": dict(outcome.answers),
        "unanswered": outcome.unanswered,
        "touches": len(touches),
        "touch_outcomes": dict(Counter(touch.outcome for touch in touches)),
        "touch_sources": dict(
            Counter(touch.decision["source"] for touch in touches if touch.decision)
        ),
        "look_ms_median": _median([sum(stage.values()) for stage in stages]),
        "frame_age_ms_median": _median(
            [d["frame_age_ms"] for _, d in decisions if d.get("frame_age_ms") is not None]
        ),
        "underruns": newest.get("underruns"),
        "dropped_frames": newest.get("dropped_frames"),
        "faults": newest.get("faults"),
        "devices": "plate simulated; see vibration.wav for what the speaker played",
    }


def as_text(result: dict[str, Any]) -> str:
    """Write the figures for a person."""
    outcomes, total = result["touch_outcomes"], result["touches"]
    answers = ", ".join(f"{count} {name}" for name, count in sorted(result["answers"].items()))
    sources = ", ".join(f"{count} {name}" for name, count in result["touch_sources"].items())
    return (
        f"{total} touches: {outcomes.get('right', 0)} as in the capture's truth, "
        f"{outcomes.get('unknown', 0)} honestly unknown, {outcomes.get('wrong', 0)} wrong\n"
        f"decided by: {sources}\n"
        f"{result['sent'].get('frame', 0)} frames in {result['seconds']} s; answers: {answers}; "
        f"unanswered: {result['unanswered']}\n"
        f"a look took {result['look_ms_median']} ms in the median, its frame was "
        f"{result['frame_age_ms_median']} ms old\n"
        f"underruns: {result['underruns']}, "
        f"dropped frames: {result['dropped_frames']}\n"
    )


def _contact(
    first: Line, ended_s: float, frame: Line | None, names: dict[str, str], decisions: Timed
) -> Contact:
    object_id = first.fields.get("object_id", "")
    made = [d for at, d in decisions if d.get("object_id") == object_id and at <= ended_s]
    return Contact(
        object_id=object_id,
        name=names.get(object_id, object_id),
        truth=first.truth,
        started_s=first.t_s,
        ended_s=ended_s,
        decision=made[-1] if made else None,
        frame=frame,
    )


def _shows(frames: list[Line], object_id: str | None) -> Line | None:
    """Return the newest frame that shows the object, else the newest."""
    newest = frames[-1] if frames else None
    recent = (line for line in reversed(frames[-10:]) if line.fields.get("object_id") == object_id)
    return next(recent, newest)


def _thumbnail(touch: Contact) -> Image.Image:
    if touch.frame is None:
        return Image.new("RGB", (THUMB_PX, THUMB_PX), SOFT)
    data = touch.frame.message(with_mask=False)["image"]
    picture = Image.open(BytesIO(data)).convert("RGB").resize((THUMB_PX, THUMB_PX))
    region = touch.frame.fields.get("region")
    if region:
        left, top = region["x"] * THUMB_PX, region["y"] * THUMB_PX
        right, bottom = left + region["w"] * THUMB_PX - 1, top + region["h"] * THUMB_PX - 1
        ImageDraw.Draw(picture).rectangle((left, top, right, bottom), outline=GROUND, width=2)
    return picture


def _caption(draw: ImageDraw.ImageDraw, touch: Contact, x: int, y: int) -> None:
    draw.text((x, y), touch.name, INK, ImageFont.load_default(14))
    small = ImageFont.load_default(13)
    draw.text((x, y + 19), _decision_text(touch.decision), _colour(touch), small)
    draw.text((x, y + 36), f"truth: {touch.truth}", SOFT, small)


def _decision_text(decision: Message | None) -> str:
    if decision is None:
        return "decided: nothing"
    if decision["material"] == "unknown":
        guess = decision.get("runner_up")
        return f"decided: unknown ({guess}?)" if guess else "decided: unknown"
    return f"decided: {decision['material']} {decision['confidence']:.0%} by {decision['source']}"


def _colour(touch: Contact) -> str:
    return {"right": GOOD, "wrong": BAD, "unknown": UNSURE}[touch.outcome]


def _median(values: list[float]) -> float | None:
    return round(float(np.median(values)), 1) if values else None
