"""Runs `hapticvlm serve` in a process of its own: for programs, demonstrations and tests."""

from __future__ import annotations

import contextlib
import ctypes
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

from hapticvlm.errors import HapticVLMError

READY_S = 120.0  # loading a transformers network on a busy machine takes most of a minute
_PR_SET_PDEATHSIG = 1  # prctl(2)


class ServiceError(HapticVLMError):
    """Raised when the service did not start; the text is its own output."""


@dataclass(slots=True)
class Service:
    """A running service."""

    process: subprocess.Popen[str]
    url: str
    seconds_to_ready: float
    printed: list[str] = field(default_factory=list)

    @property
    def page(self) -> str:
        """The address of the dashboard."""
        return self.url.replace("ws", "http", 1)

    def stop(self, seconds: float = 10.0) -> int:
        """Ask the service to stop, kill it after `seconds`, and return its exit code."""
        if self.process.poll() is None:
            self.process.send_signal(signal.SIGTERM)
        try:
            return self.process.wait(seconds)
        except subprocess.TimeoutExpired:
            self.process.kill()
            return self.process.wait()


@contextmanager
def running(
    arguments: Sequence[str] = (),
    *,
    ends_with_us: bool = False,
    log: int = subprocess.STDOUT,
) -> Iterator[Service]:
    """Start a service on a free port, and stop it when the context ends. Raises ServiceError.

    With `ends_with_us` it also stops, on Linux, when this thread is killed. Its log goes to the
    descriptor `log`; by default it is kept in `printed`.
    """
    command = [sys.executable, "-m", "hapticvlm", "serve", "--port", "0", *arguments]
    started = time.monotonic()
    process = subprocess.Popen(
        command,
        stdout=subprocess.PIPE,
        stderr=log,
        text=True,
        bufsize=1,
        preexec_fn=_stop_when_parent_ends if ends_with_us and sys.platform == "linux" else None,
    )
    service = Service(process, "", 0.0)
    ready = threading.Event()
    reader = threading.Thread(target=_read, args=(service, ready), daemon=True)
    reader.start()
    try:
        if not ready.wait(READY_S) or not service.url:
            raise ServiceError("".join(service.printed) or "the service printed nothing")
        service.seconds_to_ready = time.monotonic() - started
        yield service
    finally:
        service.stop()
        reader.join(5.0)


@contextmanager
def serve(**options: str | float | Path | None) -> Iterator[Service]:
    """Run a service in a process of its own, and stop it when the context ends.

    - `options`: those of `hapticvlm serve`, with _ for -, such as `speaker="default"` or
      `record="folder"`; True gives an option that has no value, None and False leave one out. The
      port is a free one, unless `port` is one of them. Without a device the outputs are simulated.

    The `Service` has the address for `hapticvlm.connect` (`url`) and the dashboard's (`page`). On
    Linux the service also stops when this process is killed.

    Raises `ServiceError`, a `HapticVLMError` with the service's own words, if it does not start.

        with hapticvlm.serve() as service, hapticvlm.connect_blocking(service.url) as client:
            print(client.welcome["devices"])
    """
    words: list[str] = []
    for name, value in options.items():
        if value is not None and value is not False:
            flag = "--" + name.replace("_", "-")
            words.append(flag if value is True else f"{flag}={value}")
    with running(words, ends_with_us=True) as service:
        yield service


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


def _stop_when_parent_ends() -> None:
    """Ask Linux to send SIGTERM when the thread that started this process ends."""
    ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGTERM)


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
