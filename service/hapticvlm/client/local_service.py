"""Runs `hapticvlm serve` in a process of its own: for programs, demonstrations and tests."""

from __future__ import annotations

import contextlib
import os
import re
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import NoReturn, Self

from hapticvlm.errors import HapticVLMError
from hapticvlm.standard_streams import ENDS_WITH_INPUT

READY_S = 120.0  # loading a transformers network on a busy machine takes most of a minute
_alive: list[Service] = []  # a service that nobody refers to any more lives until it is stopped


class ServiceError(HapticVLMError):
    """Raised when the service did not start; the text is its own output."""


@dataclass(slots=True, eq=False)
class Service:
    """A running service; in a `with` statement it is stopped at the end of the block."""

    process: subprocess.Popen[str]
    url: str
    seconds_to_ready: float
    printed: list[str] = field(default_factory=list)
    _reader: threading.Thread = field(default_factory=threading.Thread, repr=False)

    @property
    def page(self) -> str:
        """The address of the dashboard."""
        return self.url.replace("ws", "http", 1)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.stop()

    def __reduce__(self) -> NoReturn:
        """Refuse to go to another process, which could not stop the service."""
        raise TypeError("a Service stays in its process: pass its `url` on, and connect to that")

    def stop(self, seconds: float = 10.0) -> int:
        """Ask the service to stop, kill it after `seconds`, and return its exit code."""
        if self.process.poll() is None:
            self.process.send_signal(signal.SIGTERM)
        try:
            code = self.process.wait(seconds)
        except subprocess.TimeoutExpired:
            self.process.kill()
            code = self.process.wait()
        if self in _alive:
            _alive.remove(self)
            self._reader.join(5.0)
            assert self.process.stdin is not None
            self.process.stdin.close()
        return code


def running(arguments: Sequence[str] = (), *, log: int = subprocess.STDOUT) -> Service:
    """Start a service on a free port and wait until it is ready. Raises ServiceError.

    It ends when it is stopped, at the end of its `with` statement, and when this process ends,
    however that happens. Its log goes to the descriptor `log`; by default it is kept in `printed`.
    """
    command = [sys.executable, "-m", "hapticvlm", "serve", "--port", "0", *arguments]
    started = time.monotonic()
    # A notebook's "Interrupt" and a terminal's Ctrl-C signal the whole group of processes, and the
    # service is not what they mean: it gets a session of its own. The end of its owner it learns
    # from the pipe that is its input: the system closes this end of it, whatever ended the owner.
    process = subprocess.Popen(
        command,
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=log,
        text=True,
        bufsize=1,
        env={**os.environ, ENDS_WITH_INPUT: "1"},
        start_new_session=True,
        creationflags=getattr(subprocess, "CREATE_NEW_PROCESS_GROUP", 0),
    )
    service = Service(process, "", 0.0)
    ready = threading.Event()
    service._reader = threading.Thread(target=_read, args=(service, ready), daemon=True)
    service._reader.start()
    _alive.append(service)
    try:
        if not ready.wait(READY_S) or not service.url:
            raise ServiceError("".join(service.printed) or "the service printed nothing")
    except BaseException:
        service.stop()
        raise
    service.seconds_to_ready = time.monotonic() - started
    return service


def serve(**options: str | float | Path | None) -> Service:
    """Run a service in a process of its own until it is stopped or this process ends.

    - `options`: those of `hapticvlm serve`, with _ for -, such as `speaker="default"` or
      `record="folder"`; True gives an option that has no value, None and False leave one out. The
      port is a free one, unless `port` is one of them. Without a device the outputs are simulated.

    The `Service` has the address for `hapticvlm.connect` (`url`) and the dashboard's (`page`). It
    serves beyond the cell, the thread or the Ctrl-C in which it was begun; `stop` ends it, and so
    does the end of a `with` statement.

    Raises `ServiceError`, a `HapticVLMError` with the service's own words, if it does not start.

        with hapticvlm.serve() as service, hapticvlm.connect_blocking(service.url) as client:
            print(client.welcome["devices"])
    """
    words: list[str] = []
    for name, value in options.items():
        if value is not None and value is not False:
            flag = "--" + name.replace("_", "-")
            words.append(flag if value is True else f"{flag}={value}")
    return running(words)


@contextmanager
def ending_on_sigterm() -> Iterator[None]:
    """Unwind this process on SIGTERM, as on Ctrl-C, so that its service is stopped too."""

    def leave(*_: object) -> None:
        raise SystemExit(143)

    before = signal.signal(signal.SIGTERM, leave)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, before)


def _read(service: Service, ready: threading.Event) -> None:
    """Collect what the service prints, until it ends."""
    assert service.process.stdout is not None
    with contextlib.suppress(ValueError):
        for line in service.process.stdout:
            service.printed.append(line)
            match = re.search(r"ready on (wss?://\S+)", line)
            if match:
                service.url = match.group(1)
                ready.set()
    ready.set()
    service.process.stdout.close()
