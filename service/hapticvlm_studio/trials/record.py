"""What a participant did so far, kept on the disk: their file of events, only added to.

An event is on the disk (fsync) before anybody acts on it, so a crash loses at most the event that
was being written; its incomplete line is cut off when the file is opened again.
"""

from __future__ import annotations

import json
import logging
import os
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import asdict, dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from hapticvlm import documents
from hapticvlm_studio.design.design import Design
from hapticvlm_studio.design.stimuli import StudyError
from hapticvlm_studio.trials.progress import Event, ParticipantProgress

View = dict[str, Any]
TORN = b'{"event"'  # how every line begins, also one that a crash or a full disk cut short
ROOM = "nothing before it is lost; free some room on the disk, then continue"

logger = logging.getLogger(__name__)


def events(folder: Path, participant: str) -> list[Event]:
    """Read a participant's events; the cut line of a crash is left out. Raises StudyError."""
    path = _path(folder, participant)
    if not path.exists():
        return []
    found = []
    for number, line in enumerate(_lines(path), 1):
        try:
            event = documents.parse_json(line)
        except ValueError:
            if line.startswith(TORN):
                logger.warning("%s:%d: left out, it was never written whole", path, number)
                continue
            raise StudyError(f"{path}:{number}: not an event; the file was changed") from None
        if not isinstance(event, dict) or "event" not in event:
            raise StudyError(f"{path}:{number}: not an event; the file was changed")
        found.append(event)
    return found


def _lines(path: Path) -> list[bytes]:
    """Return the whole lines of a file. Raises StudyError."""
    try:
        return documents.read_bytes(path).split(b"\n")[:-1]
    except (OSError, ValueError) as error:
        raise StudyError(f"{path}: {error}") from None


def _private(path: str, flags: int) -> int:
    """Open a file that only this user may read: it holds what a participant told."""
    return os.open(path, flags, 0o600)


class Log:
    """One participant's file, open for adding."""

    def __init__(self, folder: Path, participant: str) -> None:
        self._path = _path(folder, participant)
        self._file = open(self._path, "a+b", buffering=0, opener=_private)  # noqa: SIM115
        self._file.seek(0)
        content = self._file.read()
        self._file.truncate(content.rfind(b"\n") + 1)
        os.fsync(self._file.fileno())

    def add(self, event: Event) -> None:
        """Write one event; it is on the disk when this returns.

        A full disk takes part of a line, says nothing, and reports an error only at the next one.
        So what was taken is counted, and cut off again: the file ends with a whole event whatever
        happens. Raises StudyError, and the event then counts for nothing.
        """
        data = json.dumps(event, ensure_ascii=False, allow_nan=False).encode() + b"\n"
        before = self._file.seek(0, os.SEEK_END)
        try:
            written = self._file.write(data)
            if written == len(data):
                os.fsync(self._file.fileno())
                return
            reason = f"only {written} of {len(data)} bytes fitted"
        except OSError as error:
            reason = error.strerror or str(error)
        with suppress(OSError):
            self._file.truncate(before)
        raise StudyError(f"{self._path.name} could not be written ({reason}): {ROOM}")

    def close(self) -> None:
        """Close the file."""
        self._file.close()


@contextmanager
def locked(folder: Path) -> Iterator[None]:
    """Lock the study, so that no second program adds to it. Raises StudyError."""
    with (folder / ".lock").open("w") as file:
        try:
            import fcntl

            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except ImportError:  # Windows: an open file cannot be replaced there, which must do
            pass
        except OSError:
            raise StudyError(f"{folder}: another `study run` is using it") from None
        yield


@dataclass(frozen=True, slots=True)
class Pace:
    """Rest between patterns and the longest wait for the plate, s; `hear`: pages play sound."""

    rest_s: float = 3.0
    settle_s: float = 60.0
    masking_noise: bool = False
    hear: bool = False

    def noted(self) -> Event:
        """Return it as an event records it."""
        return asdict(self)


class Record:
    """The open file of one participant and how far they came; nobody's at first."""

    def __init__(self, design: Design, folder: Path) -> None:
        self.design = design
        self.progress: ParticipantProgress | None = None
        self._folder = folder
        self._log: Log | None = None
        self._answered: dict[str, int] = {}  # trials of those whose file is not open

    def open(self, code: str) -> None:
        """Open or resume this participant of the design. Raises StudyError."""
        self.close()
        self._log = Log(self._folder, code)
        self.progress = self._recall(code)

    def close(self) -> None:
        """Close the file; it can be opened again at any time."""
        if self._log is not None:
            self._log.close()
        if self.progress is not None:
            self._answered[self.progress.participant] = self.progress.answered
        self._log = self.progress = None

    def note(self, event: Event) -> None:
        """Write an event to the disk, then count it. Raises StudyError when no file is open."""
        if self._log is None or self.progress is None:
            raise StudyError("choose a participant first")
        at = datetime.now(UTC).isoformat(timespec="milliseconds")
        stamped = {**event, "at": at, "t_s": round(time.monotonic(), 4)}
        self._log.add(stamped)
        self.progress.apply(stamped)

    def participants(self) -> list[View]:
        """Return how far each participant came."""
        return [self._progress(code) for code in self.design.participants]

    def view(self) -> View:
        """Describe the open progress to a page; nothing when there is none."""
        progress = self.progress
        if progress is None:
            return {}
        return {
            "participant": progress.participant,
            "answered": progress.answered,
            "trials": len(progress.trials),
            "renderings": dict(progress.renderings),
            "next_to_feel": progress.next_to_feel,
            "is_trained": progress.is_trained,
            "language": progress.language,
            "questions": progress.questions,
            "to_rate": progress.to_rate,
        }

    def overview(self) -> View:
        """Return what only the experimenter may see; nothing when no file is open."""
        progress = self.progress
        if progress is None:
            return {}
        shown = ("trial", "pattern", "answered", "reaction_s")
        return {
            "correct": progress.correct,
            "attempt": progress.attempts,
            "next_trial": progress.next_trial,
            "recent": [{name: event[name] for name in shown} for event in progress.recent],
        }

    def _progress(self, code: str) -> View:
        progress = self.progress
        if progress is not None and progress.participant == code:
            answered = progress.answered
        else:
            if code not in self._answered:
                self._answered[code] = self._recall(code).answered
            answered = self._answered[code]
        return {"code": code, "answered": answered, "trials": len(self.design.trials[code])}

    def _recall(self, code: str) -> ParticipantProgress:
        progress = ParticipantProgress(self.design, code)
        for event in events(self._folder, code):
            progress.apply(event)
        return progress


def _path(folder: Path, participant: str) -> Path:
    return folder / f"{participant}.jsonl"
