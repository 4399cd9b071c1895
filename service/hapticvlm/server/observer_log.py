"""The log as observers see it."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Callable
from contextlib import suppress


class ObserverLog(logging.Handler):
    """Passes log lines on, always on the event loop: other threads log too.

    Make it where the event loop runs; `show` is called there with one line.
    """

    def __init__(self, show: Callable[[str], None]) -> None:
        super().__init__()
        self._show = show
        self._loop = asyncio.get_running_loop()

    def emit(self, record: logging.LogRecord) -> None:
        """Show one line, soon."""
        text = self.format(record).encode("utf-8", "replace").decode()  # a path may be no text
        with suppress(RuntimeError):  # the loop has closed
            self._loop.call_soon_threadsafe(self._show, text)
