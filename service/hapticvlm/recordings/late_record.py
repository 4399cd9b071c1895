"""Begins a record late: a scene that only says hello and leaves again leaves no folder behind."""

from __future__ import annotations

from collections.abc import Callable

from hapticvlm.messages import Frame
from hapticvlm.recordings.lines import Input, Key, Line

MOST_HELD = 500  # lines: ten seconds of ticks, then a scene has come to stay

WriteLine = Callable[[Line, Frame | None], None]


class LateRecord:
    """Keeps a session's lines until its first message, then has all of them written in order."""

    def __init__(self, begin: Callable[[], WriteLine]) -> None:
        self._begin = begin
        self._write_line: WriteLine | None = None
        self._held: list[tuple[Line, Frame | None]] = []

    def __call__(self, line: Line, frame: Frame | None) -> None:
        """Take one line, and the frame if it has one."""
        if self._write_line is None:
            self._held.append((line, frame))
            is_message = line.get(Key.IN) == Input.MESSAGE
            if not is_message and len(self._held) < MOST_HELD:
                return
            self._write_line = self._begin()
            held, self._held = self._held, []
            for each in held:
                self._write_line(*each)
        else:
            self._write_line(line, frame)
