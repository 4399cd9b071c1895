"""Whose sitting is open, and its file: every event is on the disk before it counts."""

from __future__ import annotations

import time
from dataclasses import asdict, dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from hapticvlm.study.log import Design, Event, Log, events
from hapticvlm.study.sitting import Sitting
from hapticvlm.study.stimuli import StudyError

View = dict[str, Any]


@dataclass(frozen=True, slots=True)
class Pace:
    """Rest between patterns and the longest wait for the plate, s; whether noise masks sound."""

    rest_s: float = 3.0
    settle_s: float = 60.0
    masking_noise: bool = False

    def noted(self) -> Event:
        """Return it as an event tells it."""
        return asdict(self)


class Record:
    """The open file of one participant and how far they came; nobody's at first."""

    def __init__(self, design: Design, folder: Path) -> None:
        self.design = design
        self.sitting: Sitting | None = None
        self._folder = folder
        self._log: Log | None = None

    def open(self, code: str) -> None:
        """Go on with this participant of the design. Raises StudyError."""
        self.close()
        self._log = Log(self._folder, code)
        self.sitting = self._recall(code)

    def close(self) -> None:
        """Close the file; it can be opened again at any time."""
        if self._log is not None:
            self._log.close()
        self._log = self.sitting = None

    def note(self, event: Event) -> None:
        """Put an event on the disk, then count it. Raises StudyError when nobody's file is open."""
        if self._log is None or self.sitting is None:
            raise StudyError("choose a participant first")
        at = datetime.now(UTC).isoformat(timespec="milliseconds")
        stamped = {**event, "at": at, "t_s": round(time.monotonic(), 4)}
        self._log.add(stamped)
        self.sitting.take(stamped)

    def participants(self) -> list[View]:
        """Tell how far each participant came."""
        return [self._progress(code) for code in self.design.participants]

    def view(self) -> View:
        """Tell a page of the open sitting; nothing when there is none."""
        sitting = self.sitting
        if sitting is None:
            return {}
        return {
            "participant": sitting.participant,
            "answered": sitting.answered,
            "trials": len(sitting.trials),
            "renderings": dict(sitting.renderings),
            "next_to_feel": sitting.next_to_feel,
            "is_trained": sitting.is_trained,
        }

    def _progress(self, code: str) -> View:
        sitting = self.sitting
        if sitting is None or sitting.participant != code:
            sitting = self._recall(code)
        return {"code": code, "answered": sitting.answered, "trials": len(sitting.trials)}

    def _recall(self, code: str) -> Sitting:
        sitting = Sitting(self.design, code)
        for event in events(self._folder, code):
            sitting.take(event)
        return sitting
