"""Keeps what each participant did on the disk: one file of events, to which lines are only added.

Who writes when: `Record.note` is the only writer. It is called by the conductor and by the trials,
both on the event loop, so events are written one at a time and in the order in which they happened.
It first writes the event (fsync) and then applies it to the progress in memory; a page hears of it
after that. So nothing is ever shown, counted or acted upon that a crash could take back.

A crash, a full disk or a power cut can leave one incomplete line at the end of the file. It is cut
off when the file is opened again, and the event counts as not having happened: a trial whose answer
was in it is presented again. `locked` keeps a second program from writing to the same study.
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
LINE_START = b'{"event"'  # of every line, including one that a crash or a full disk cut short
REMEDY = "nothing before it is lost; free some space on the disk, then continue"
RESTORE = "put it back as it was, then choose the participant again"

logger = logging.getLogger(__name__)


def events(folder: Path, participant: str) -> list[Event]:
    """Return a participant's events, in order; empty where there is no file.

    A line that was cut short is skipped with a warning. Any other line that is not an event means
    that somebody edited the file. Raises StudyError, which names the line.
    """
    path = _path(folder, participant)
    if not path.exists():
        return []
    result = []
    for number, line in enumerate(_lines(path), 1):
        try:
            event = documents.parse_json(line)
        except ValueError:
            if line.startswith(LINE_START):
                logger.warning("%s:%d: skipped an incomplete line", path, number)
                continue
            raise StudyError(f"{path}:{number}: not an event; the file was changed") from None
        if not isinstance(event, dict) or "event" not in event:
            raise StudyError(f"{path}:{number}: not an event; the file was changed")
        result.append(event)
    return result


def _lines(path: Path) -> list[bytes]:
    """Return the lines of a file that end with a line break. Raises StudyError."""
    try:
        # What follows the last line break is an unfinished line, or nothing.
        return documents.read_bytes(path).split(b"\n")[:-1]
    except (OSError, ValueError) as error:
        raise StudyError(f"{path}: {documents.reason(error)}") from None


def _private(path: str, flags: int) -> int:
    """Open a file that only this user may read: it holds a participant's answers."""
    return os.open(path, flags, 0o600)


class Log:
    """One participant's file, open for appending."""

    def __init__(self, folder: Path, participant: str) -> None:
        self._path = _path(folder, participant)
        self._file = open(self._path, "a+b", buffering=0, opener=_private)  # noqa: SIM115
        # The incomplete line of a crash has to go before anything is appended: the next event would
        # continue it, and both would be lost.
        self._file.seek(0)
        content = self._file.read()
        self._file.truncate(content.rfind(b"\n") + 1)
        os.fsync(self._file.fileno())
        self._size = self._file.seek(0, os.SEEK_END)
        documents.sync_folder(folder)
        documents.sync_folder(folder.parent)  # a study's folder may be new

    def add(self, event: Event) -> None:
        """Append one event; it is on the disk when this returns.

        Raises StudyError, and the event has then not happened: the file ends where it did before.
        """
        data = json.dumps(event, ensure_ascii=False, allow_nan=False).encode() + b"\n"
        before = self._file.seek(0, os.SEEK_END)
        if before != self._size or not self._is_at_its_place():
            raise StudyError(f"{self._path} was moved or changed by another program: {RESTORE}")
        # A disk that fills up accepts part of a line without an error, and fails only at the next
        # write. So the bytes written are counted, and a partial line is cut off again.
        try:
            written = self._file.write(data)
            if written == len(data):
                os.fsync(self._file.fileno())
                self._size += written
                return
            reason = f"only {written} of {len(data)} bytes fitted"
        except OSError as error:
            reason = error.strerror or str(error)
        with suppress(OSError):
            self._file.truncate(before)
        raise StudyError(f"{self._path.name} could not be written ({reason}): {REMEDY}")

    def close(self) -> None:
        """Close the file."""
        self._file.close()

    def _is_at_its_place(self) -> bool:
        """Whether the open file is still the one of its name, which a report will read."""
        try:
            return os.path.samestat(self._path.stat(), os.fstat(self._file.fileno()))
        except OSError:
            return False


@contextmanager
def locked(folder: Path) -> Iterator[None]:
    """Lock the study against a second program. Raises StudyError when it is locked already."""
    with (folder / ".lock").open("w") as file:
        if not documents.locks(file):
            raise StudyError(f"{folder}: another `study run` is using it")
        yield


@dataclass(frozen=True, slots=True)
class Pace:
    """Rest between patterns and the longest wait for the plate, s; `hear`: the page plays sound."""

    rest_s: float = 3.0
    settle_s: float = 60.0
    masking_noise: bool = False
    hear: bool = False

    def noted(self) -> Event:
        """Return its values for an event."""
        return asdict(self)


class Record:
    """The open file and progress of one participant; of none at first."""

    def __init__(self, design: Design, folder: Path) -> None:
        self.design = design
        self.progress: ParticipantProgress | None = None
        self._folder = folder
        self._log: Log | None = None
        self._answered: dict[str, int] = {}  # trials answered by those whose file is not open

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
        """Write an event to the disk, then apply it to the progress.

        Raises StudyError when it cannot be written or no file is open; nothing has changed then.
        """
        if self._log is None or self.progress is None:
            raise StudyError("choose a participant first")
        # Two clocks: `at` says when it happened, `t_s` measures durations and never jumps. The
        # latter starts again with each start of the machine, so it is compared within a session.
        at = datetime.now(UTC).isoformat(timespec="milliseconds")
        stamped = {**event, "at": at, "t_s": round(time.monotonic(), 4)}
        self._log.add(stamped)
        self.progress.apply(stamped)

    def participants(self) -> list[View]:
        """Return the number of trials that each participant has answered."""
        return [self._progress(code) for code in self.design.participants]

    def view(self) -> View:
        """Return what a page shows of the open progress; empty when there is none."""
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
        """Return what only the experimenter may see; empty when no file is open."""
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
