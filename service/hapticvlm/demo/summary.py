"""Writes the summary of a demo: how its touches were decided, answered and timed.

It counts decisions and telemetry as they were received and makes no decision itself.
"""

from __future__ import annotations

import json
from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np

from hapticvlm import documents
from hapticvlm.captures import Capture
from hapticvlm.captures.contacts import Contact, Timed, contacts
from hapticvlm.client.sending import Outcome


def write(
    capture: Capture, outcome: Outcome, decisions: Timed, telemetry: Timed, out: Path
) -> Path:
    """Write the summary into `out` as text and as JSON; return the JSON file."""
    result = summary(capture, outcome, contacts(capture, decisions), decisions, telemetry)
    file = out / "summary.json"
    documents.replace_file(file, json.dumps(result, indent=1) + "\n")
    documents.replace_file(out / "summary.txt", as_text(result))
    return file


def summary(
    capture: Capture, outcome: Outcome, touches: list[Contact], decisions: Timed, telemetry: Timed
) -> dict[str, Any]:
    """Return the figures of the run."""
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
        "devices": "plate simulated; see session.html for what the speaker played",
    }


def as_text(result: dict[str, Any]) -> str:
    """Return the summary as text for a person."""
    outcomes = result["touch_outcomes"]
    total = result["touches"]
    answers = ", ".join(f"{count} {name}" for name, count in sorted(result["answers"].items()))
    sources = ", ".join(f"{count} {name}" for name, count in result["touch_sources"].items())
    return (
        f"{total} touches: {outcomes.get('right', 0)} correct, "
        f"{outcomes.get('unknown', 0)} unknown, {outcomes.get('wrong', 0)} wrong\n"
        f"evidence: {sources}\n"
        f"{result['sent'].get('frame', 0)} frames in {result['seconds']} s; "
        f"unanswered: {result['unanswered']}\n"
        f"answers: {answers}\n"
        f"median recognition {result['look_ms_median']} ms, median age of its frame "
        f"{result['frame_age_ms_median']} ms\n"
        f"underruns: {result['underruns']}, "
        f"dropped frames: {result['dropped_frames']}\n"
    )


def _median(values: list[float]) -> float | None:
    return round(float(np.median(values)), 1) if values else None
