"""Records sessions on disk, a folder each, in one thread that the service never waits for.

`session.jsonl` has every input of the session, for `replay`; `capture.jsonl` has its messages, for
`stream`; `decisions.jsonl` has its decisions. Pictures are kept only when asked for. When the disk
is too slow or the record too long, lines are dropped and counted, and the service's log reports it.
A scene that only says hello and leaves gets no folder: its first lines are held in memory until it
stays.
"""

from __future__ import annotations

import errno
import itertools
import json
import logging
import os
import queue
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any

from hapticvlm import documents
from hapticvlm.errors import one_line
from hapticvlm.messages import Frame
from hapticvlm.recordings.lines import Input, Key, Line, Output
from hapticvlm.recordings.metadata import without_metadata

SESSION_LOG = "session.jsonl"
CAPTURE = "capture.jsonl"  # as hapticvlm.captures reads it
DECISIONS = "decisions.jsonl"
FRAMES = "frames"  # the folder of the pictures, where they are kept
MAX_WAITING = 2000
MAX_WAITING_BYTES = 64 * 1024**2
COMPLAIN_S = 10.0
MAX_BYTES = 4 * 1024**3
SUFFIX = {"jpeg": "jpg", "png": "png", "rgb8": "rgb", "rgba8": "rgba", "bgra8": "bgra"}
logger = logging.getLogger(__name__)
MAX_HELD = 500  # lines: after ten seconds of ticks a scene counts as one that stays
WriteLine = Callable[[Line, Frame | None], None]


class Recorder:
    """Takes lines from sessions at once and writes them down in its own time.

    The queue is bounded in lines and bytes. Each figure is written by one thread only.
    """

    def __init__(self, folder: Path, *, frames: bool, max_bytes: int = MAX_BYTES) -> None:
        self.folder = folder
        self.keeps_frames = frames
        self.written_bytes = 0
        self._max_bytes = max_bytes
        self._sessions = 0
        self._refused = self._failed = 0
        self._queued_bytes = self._done_bytes = 0
        self._complained_at = float("-inf")
        self._queue: queue.Queue[tuple[Callable[[], int], int] | None] = queue.Queue(MAX_WAITING)
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        self._thread = threading.Thread(target=self._write, name="recorder", daemon=True)
        self._thread.start()

    @property
    def lost(self) -> int:
        """Number of lines dropped: the disk was too slow or full, or the record too long."""
        return self._refused + self._failed

    @property
    def waiting_bytes(self) -> int:
        """The size of the pictures that wait to be written."""
        return self._queued_bytes - self._done_bytes

    def begin(self, head: Line) -> Callable[[Line, Frame | None], None]:
        """Open the record of one session; return the function that records its lines."""
        self._sessions += 1
        stamp = time.strftime("%Y%m%d-%H%M%S")
        record = _Record(self.folder / f"{stamp}-{self._sessions:02}")
        self._enqueue(lambda: record.open(head), 0)
        numbers = itertools.count(1)  # of what was recorded, so that a lost line leaves a gap

        def record_line(line: Line, frame: Frame | None) -> None:
            number = next(numbers)
            kept = frame if self.keeps_frames else None
            size = 0 if kept is None else len(kept.image) + len(kept.mask or b"")
            self._enqueue(lambda: record.write_line(number, line, kept), size)

        return record_line

    def close(self) -> None:
        """Write what waits, then stop."""
        if self._thread.is_alive():
            with suppress(queue.Full):
                self._queue.put(None, timeout=5.0)
            self._thread.join(10.0)

    def _enqueue(self, job: Callable[[], int], size: int) -> None:
        is_too_much = self.waiting_bytes + size > MAX_WAITING_BYTES
        if is_too_much or self.written_bytes > self._max_bytes:
            self._refused += 1
            return
        try:
            self._queue.put_nowait((job, size))
            self._queued_bytes += size
        except queue.Full:
            self._refused += 1

    def _write(self) -> None:
        while (waiting := self._queue.get()) is not None:
            job, size = waiting
            try:
                if self.written_bytes > self._max_bytes:
                    raise OSError(
                        f"the record is full: the limit is {self._max_bytes} bytes; start another"
                    )
                self.written_bytes += job()
            except (OSError, TypeError, ValueError) as error:
                self._failed += 1
                self._complain(error)
            self._done_bytes += size
            self._queue.task_done()

    def _complain(self, error: Exception) -> None:
        """Log that lines are missing, rate-limited: a full disk fails a hundred times a second."""
        now = time.monotonic()
        if now - self._complained_at >= COMPLAIN_S:
            self._complained_at = now
            logger.error("the record misses lines, %d by now: %s", self.lost, one_line(error))


class _Record:
    """The files of one session."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._is_open = False
        self._frames = 0
        self._started: float | None = None
        self._at_s = 0.0

    def open(self, head: Line) -> int:
        """Create the folder and write the first line."""
        self._folder = _new_folder(self._folder)
        size = self._append(SESSION_LOG, {Key.LINE: 0, Key.HEAD: head})
        self._is_open = True
        return size

    def write_line(self, number: int, line: Line, frame: Frame | None) -> int:
        """Write one line of the log; a message or a decision goes to its own file too."""
        if not self._is_open:
            raise OSError(f"{self._folder} could not be created")
        self._follow(line)
        size = 0
        extras: dict[str, Any] = {}
        if frame is not None:
            size, extras = self._keep(frame)
        size += self._append(SESSION_LOG, {Key.LINE: number, **line, **extras})
        if line.get(Key.IN) == Input.MESSAGE:
            size += self._append_message(line[Key.MESSAGE], extras)
        for output in line.get(Key.OUT, ()):
            if output[Key.DO] == Output.DECISION:
                size += self._append(DECISIONS, {"t_s": self._at_s, **output})
        return size

    def _follow(self, line: Line) -> None:
        now = line.get(Key.NOW)
        if now is not None:
            self._started = now if self._started is None else self._started
            self._at_s = round(now - self._started, 6)

    def _append_message(self, message: dict[str, Any], extras: dict[str, Any]) -> int:
        fields = {name: value for name, value in message.items() if name not in ("id", "image")}
        fields.pop("mask", None)
        if message["type"] == "frame" and not extras:
            return 0
        return self._append(CAPTURE, {"t_s": self._at_s, **fields, **extras})

    def _keep(self, frame: Frame) -> tuple[int, dict[str, Any]]:
        self._frames += 1
        (self._folder / FRAMES).mkdir(mode=0o700, exist_ok=True)
        name = f"{FRAMES}/{self._frames:06}.{SUFFIX[frame.format]}"
        image = without_metadata(frame.format, frame.image)
        self._write(name, image)
        extras: dict[str, Any] = {Key.FILE: name}
        if frame.mask is not None:
            extras[Key.MASK_FILE] = f"{FRAMES}/{self._frames:06}-mask.png"
            self._write(extras[Key.MASK_FILE], frame.mask)
        return len(image) + len(frame.mask or b""), extras

    def _write(self, name: str, data: bytes) -> None:
        path = self._folder / name
        try:
            with documents.naming(path), open(path, "wb", opener=_private) as file:
                file.write(data)
        except OSError:
            path.unlink(missing_ok=True)  # a part of a picture cannot be read
            raise

    def _append(self, name: str, line: dict[str, Any]) -> int:
        """Write one line, whole or not at all: part of a line would make the log unreadable."""
        data = (json.dumps(line, allow_nan=False) + "\n").encode()
        path = self._folder / name
        with documents.naming(path), open(path, "ab", buffering=0, opener=_private) as file:
            before = file.tell()
            written = file.write(data)
            if written != len(data):
                file.truncate(before)
                raise OSError(errno.ENOSPC, f"only {written} of {len(data)} bytes fitted")
        return len(data)


def _private(path: str, flags: int) -> int:
    """Open a file that only this user may read: it holds a person's actions, perhaps pictures."""
    # A pipe in its place is an error, and not waited for.
    return os.open(path, flags | getattr(os, "O_NONBLOCK", 0), 0o600)


def _new_folder(wanted: Path) -> Path:
    """Create this folder, or one beside it if another service has just created it."""
    for number in itertools.count(2):
        try:
            wanted.mkdir(mode=0o700, parents=True)
            return wanted
        except FileExistsError:
            wanted = wanted.with_name(f"{wanted.name.partition('_')[0]}_{number}")
    raise AssertionError("count() never ends")


class LateRecord:
    """Holds a session's lines until its first message, then writes all of them in order."""

    def __init__(self, begin: Callable[[], WriteLine]) -> None:
        self._begin = begin
        self._write_line: WriteLine | None = None
        self._held: list[tuple[Line, Frame | None]] = []

    def __call__(self, line: Line, frame: Frame | None) -> None:
        """Take one line, and the frame if it has one."""
        if self._write_line is None:
            self._held.append((line, frame))
            is_message = line.get(Key.IN) == Input.MESSAGE
            if not is_message and len(self._held) < MAX_HELD:
                return
            self._write_line = self._begin()
            held, self._held = self._held, []
            for held_line, held_frame in held:
                self._write_line(held_line, held_frame)
        else:
            self._write_line(line, frame)
