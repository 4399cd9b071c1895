"""Keeps sessions on disk: a folder each, written by one thread that nobody waits for.

`tape.jsonl` is everything that went into the session, for `replay`; `capture.jsonl` its messages,
for `stream`; `decisions.jsonl` what was decided. Pictures are kept only when asked for. When the
disk is too slow or the record too long, lines are lost, counted, and the tape says it is torn.
"""

from __future__ import annotations

import json
import logging
import queue
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any

from hapticvlm.captures import LINES
from hapticvlm.messages import Frame
from hapticvlm.session.tape import Line

TAPE, DECISIONS = "tape.jsonl", "decisions.jsonl"
MAX_WAITING = 2000
MAX_BYTES = 4 * 1024**3
SUFFIX = {"jpeg": "jpg", "png": "png", "rgb8": "rgb", "rgba8": "rgba"}

logger = logging.getLogger(__name__)


class Recorder:
    """Takes lines from sessions at once and writes them down in its own time."""

    def __init__(self, folder: Path, *, frames: bool, max_bytes: int = MAX_BYTES) -> None:
        self.keeps_frames = frames
        self.lost = 0
        self.written_bytes = 0
        self._folder = folder
        self._max_bytes = max_bytes
        self._sessions = 0
        self._queue: queue.Queue[Callable[[], None] | None] = queue.Queue(MAX_WAITING)
        folder.mkdir(parents=True, exist_ok=True)
        self._thread = threading.Thread(target=self._write, name="recorder", daemon=True)
        self._thread.start()

    def begin(self, head: Line) -> Callable[[Line, Frame | None], None]:
        """Open the record of one session; return what to tell its lines to."""
        self._sessions += 1
        stamp = time.strftime("%Y%m%d-%H%M%S")
        record = _Record(self._folder / f"{stamp}-{self._sessions:02}", self.keeps_frames)
        self._put(lambda: self._count(record.open(head)))

        def tell(line: Line, frame: Frame | None) -> None:
            self._put(lambda: self._count(record.take(line, frame)))

        return tell

    def close(self) -> None:
        """Write what waits, then stop."""
        if self._thread.is_alive():
            with suppress(queue.Full):
                self._queue.put(None, timeout=5.0)
            self._thread.join(10.0)

    def _put(self, job: Callable[[], None]) -> None:
        if self.written_bytes > self._max_bytes:
            self.lost += 1
            return
        try:
            self._queue.put_nowait(job)
        except queue.Full:
            self.lost += 1

    def _count(self, size: int) -> None:
        self.written_bytes += size

    def _write(self) -> None:
        while (job := self._queue.get()) is not None:
            try:
                job()
            except (OSError, TypeError, ValueError) as error:
                self.lost += 1
                logger.error("the record misses a line: %s", error)


class _Record:
    """The files of one session."""

    def __init__(self, folder: Path, keeps_frames: bool) -> None:
        self._folder = folder
        self._keeps_frames = keeps_frames
        self._lines = 0
        self._frames = 0
        self._started: float | None = None
        self._at_s = 0.0

    def open(self, head: Line) -> int:
        """Make the folder and write the first line."""
        self._folder.mkdir(parents=True)
        return self._append(TAPE, {"line": 0, "head": head})

    def take(self, line: Line, frame: Frame | None) -> int:
        """Write one line of the tape, and what of it is of interest by itself."""
        self._follow(line)
        self._lines += 1
        size = 0
        extras: dict[str, Any] = {}
        if frame is not None and self._keeps_frames:
            size, extras = self._keep(frame)
        size += self._append(TAPE, {"line": self._lines, **line, **extras})
        if line.get("in") == "message":
            size += self._append_message(line["message"], extras)
        for done in line.get("out", ()):
            if done["do"] == "say":
                size += self._append(DECISIONS, {"t_s": self._at_s, **done})
        return size

    def _follow(self, line: Line) -> None:
        now = line.get("now")
        if now is not None:
            self._started = now if self._started is None else self._started
            self._at_s = round(now - self._started, 6)

    def _append_message(self, message: dict[str, Any], extras: dict[str, Any]) -> int:
        fields = {name: value for name, value in message.items() if name not in ("id", "image")}
        fields.pop("mask", None)
        if message["type"] == "frame" and not extras:
            return 0
        return self._append(LINES, {"t_s": self._at_s, **fields, **extras})

    def _keep(self, frame: Frame) -> tuple[int, dict[str, Any]]:
        self._frames += 1
        (self._folder / "frames").mkdir(exist_ok=True)
        name = f"frames/{self._frames:06}.{SUFFIX[frame.format]}"
        (self._folder / name).write_bytes(frame.image)
        extras = {"file": name}
        if frame.mask is not None:
            extras["mask_file"] = f"frames/{self._frames:06}-mask.png"
            (self._folder / extras["mask_file"]).write_bytes(frame.mask)
        return len(frame.image) + len(frame.mask or b""), extras

    def _append(self, name: str, line: dict[str, Any]) -> int:
        text = json.dumps(line, allow_nan=False) + "\n"
        with (self._folder / name).open("a", encoding="utf-8") as file:
            file.write(text)
        return len(text)
