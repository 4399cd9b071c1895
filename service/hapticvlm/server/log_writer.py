"""Writes the log to stderr in a thread, so that a pipe that nobody reads blocks nothing.

The queue of lines is bounded; lines beyond it are dropped and counted. A line that repeats is
folded: a client that provokes it must not fill a disk. Observers are shown lines on the event loop.
"""

from __future__ import annotations

import asyncio
import logging
import os
import queue
import threading
import time
from collections import Counter
from collections.abc import Callable
from contextlib import suppress
from typing import Any

from hapticvlm.errors import printable
from hapticvlm.server.edge.limits import LOG_LINES, LOG_REPEATS, TokenBucket

STDERR = 2
CLOSE_S = 0.5
FORMAT = "%(asctime)s %(levelname)s %(name)s: %(message)s"
LOST = "log lines lost"


class Folding:
    """Admits a few lines of each kind; the next one admitted counts those left out."""

    def __init__(self) -> None:
        self._buckets: dict[tuple[str, str], TokenBucket] = {}
        self._left_out: Counter[tuple[str, str]] = Counter()

    def count(self, record: logging.LogRecord) -> str | None:
        """Return what to add to this line, or None if it is left out."""
        kind = (record.name, str(record.msg))
        now = time.monotonic()
        bucket = self._buckets.setdefault(kind, TokenBucket(LOG_REPEATS, now))
        if not bucket.spend(1, now):
            self._left_out[kind] += 1
            return None
        before = self._left_out.pop(kind, 0)
        return f" (and {before} more like it)" if before else ""


class PrintableFormatter(logging.Formatter):
    """Makes every line printable, whoever chose its words; a traceback keeps its own lines.

    Object ids, names of clients and answers of other machines reach the log. This is the one place
    through which all of it goes, to the terminal and to observers alike.
    """

    def formatMessage(self, record: logging.LogRecord) -> str:
        """Format the message on one line."""
        record.message = printable(record.message)
        return super().formatMessage(record)

    def formatException(self, ei: Any) -> str:  # noqa: ANN401 - logging's own
        """Format a traceback, each of its lines printable."""
        lines = super().formatException(ei).splitlines()
        return "\n".join("".join(c if c.isprintable() else " " for c in text) for text in lines)


class LogWriter(logging.Handler):
    """Hands lines to a thread that writes them to stderr; never blocks the caller."""

    def __init__(self) -> None:
        super().__init__()
        self.lost = 0
        self._folding = Folding()
        self._waiting: queue.Queue[bytes | None] = queue.Queue(LOG_LINES)
        self.setFormatter(PrintableFormatter(FORMAT))
        self._thread = threading.Thread(target=self._run, name="log writer", daemon=True)
        self._thread.start()

    def emit(self, record: logging.LogRecord) -> None:
        """Queue one line, or count it as lost."""
        folded = self._folding.count(record)
        if folded is None:
            return
        line = f"{self.format(record)}{folded}\n".encode("utf-8", "replace")
        try:
            # A write to stderr blocks when it is a pipe that nobody reads, and a terminal that is
            # paused with Ctrl-S. On the event loop that would hold up every touch. So a thread
            # writes, and what it cannot write in time waits here, up to LOG_LINES; then lines are
            # lost and counted.
            self._waiting.put_nowait(line)
        except queue.Full:
            self.lost += 1

    def close(self) -> None:
        """Write the lines that wait, as far as stderr takes them within CLOSE_S."""
        with suppress(queue.Full):
            self._waiting.put_nowait(None)
        # The thread is a daemon: one that hangs in its write ends with the process. Waiting for it
        # is bounded, since the service is being ended.
        if self._thread.is_alive():
            self._thread.join(CLOSE_S)
        super().close()

    def _run(self) -> None:
        while (line := self._waiting.get()) is not None:
            try:
                while line:
                    line = line[os.write(STDERR, line) :]
            except OSError:  # the reader is gone, or the disk is full
                self.lost += 1


class ObserverLog(logging.Handler):
    """Passes log lines on, always on the event loop: other threads log too.

    Make it where the event loop runs; `show` is called there with one line.
    """

    def __init__(self, show: Callable[[str], None]) -> None:
        super().__init__()
        self.setFormatter(PrintableFormatter())
        self._show = show
        self._folding = Folding()
        self._loop = asyncio.get_running_loop()

    def emit(self, record: logging.LogRecord) -> None:
        """Show one line, soon."""
        folded = self._folding.count(record)
        if folded is None:
            return
        line = self.format(record) + folded
        text = line.encode("utf-8", "replace").decode()  # a path may not be text
        with suppress(RuntimeError):  # the loop has closed
            # Logging is called from any thread, sockets belong to the event loop. The line is
            # handed over and shown at the loop's next turn. It is formatted here, in the thread
            # that logs: a record may hold objects that change later.
            self._loop.call_soon_threadsafe(self._show, text)


def take_over() -> LogWriter:
    """Route all logging of this process through a LogWriter, at the level it has."""
    root = logging.getLogger()
    writer = LogWriter()
    for handler in root.handlers[:]:
        root.removeHandler(handler)
    root.addHandler(writer)
    return writer
