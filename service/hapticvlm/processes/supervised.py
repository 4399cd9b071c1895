"""A child process that is started, watched and restarted: one way for engine and recogniser.

The child's first message on its pipe is ("ready", what it runs) or ("failed", why). A child that
dies or hangs is restarted at once, one that keeps failing after growing pauses. Knows nothing of
what the child does.
"""

from __future__ import annotations

import multiprocessing
import time
from collections.abc import Callable
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess
from typing import Any

START_S = 60.0  # a child that fails says so at once; only a busy machine takes this long
STEADY_S = 10.0
DYING_S = 1.0
FIRST_PAUSE_S, LONGEST_PAUSE_S = 1.0, 30.0


class ChildError(Exception):
    """The child did not start; the text says why."""


class Child:
    """One process and its pipe; `on_ready` is told what the child says it runs."""

    def __init__(
        self,
        name: str,
        target: Callable[..., None],
        arguments: Callable[[], tuple[Any, ...]],
        on_ready: Callable[[Any], None],
        start_s: float = START_S,
    ) -> None:
        self._name = name
        self._target = target
        self._arguments = arguments
        self._on_ready = on_ready
        self._start_s = start_s
        self._process: BaseProcess | None = None
        self._dying: BaseProcess | None = None
        self._control: Connection | None = None
        self._spawned_at = 0.0
        self._ready_at: float | None = None
        self._retry_at = 0.0
        self._pause_s = 0.0
        self.restarts = 0

    @property
    def pid(self) -> int | None:
        """Process id, None while there is no process."""
        return self._process.pid if self._process else None

    @property
    def ready_at(self) -> float | None:
        """When the child said it was ready, on the monotonic clock; None until then."""
        return self._ready_at

    @property
    def control(self) -> Connection:
        """Our end of the pipe; only while the child is ready."""
        if self._control is None:
            raise ChildError(f"the {self._name} is not running")
        return self._control

    def start(self) -> None:
        """Start and wait until the child is ready. Raises ChildError."""
        self._spawn()
        if not self.control.poll(self._start_s):
            self.close(0.0)
            raise ChildError(f"the {self._name} did not start within {self._start_s:.0f} s")
        failure = self._greet()
        if failure is not None:
            self.close(0.0)
            raise ChildError(failure)

    def begin(self) -> None:
        """Start and do not wait: `supervise` greets the child, or says why it did not start."""
        self._spawn()

    def supervise(self, now: float, *, is_well: bool) -> str | None:
        """Restart a child that died, or hung (`is_well` false); return what happened, if anything.

        Never blocks; call it often.
        """
        if self._process is None:
            if self._retry_at and now >= self._retry_at and self._is_buried(now):
                self._spawn()
            return None
        failure = self._failure(now, is_well)
        if failure is None:
            return None
        if self._ready_at is not None and now - self._ready_at > STEADY_S:
            self._pause_s = 0.0
        pause_s = self._pause_s
        self._pause_s = min(LONGEST_PAUSE_S, max(FIRST_PAUSE_S, 2.0 * pause_s))
        self._kill()
        self.restarts += 1
        self._retry_at = now + pause_s
        return f"{failure}; restarted {f'in {pause_s:.0f} s' if pause_s else 'at once'}"

    def close(self, patience_s: float) -> None:
        """Close the pipe, wait for the child to end by itself, then kill it."""
        self._retry_at = 0.0
        if self._control is not None:
            self._control.close()
        if self._process is not None:
            self._process.join(patience_s)
        self._kill()
        if self._dying is not None:
            self._dying.join(DYING_S)

    def _failure(self, now: float, is_well: bool) -> str | None:
        assert self._process is not None
        if self._ready_at is None and self._has_spoken():
            return self._greet()
        if not self._process.is_alive():
            return f"the {self._name} died (exit code {self._process.exitcode})"
        if self._ready_at is None:
            late = now - self._spawned_at > self._start_s
            return f"the {self._name} did not start within {self._start_s:.0f} s" if late else None
        return None if is_well else f"the {self._name} hung"

    def _has_spoken(self) -> bool:
        """Whether there is something to read, if only that there never will be."""
        try:
            return self.control.poll()
        except OSError:  # Windows says so of a broken pipe
            return True

    def _greet(self) -> str | None:
        """Take in the child's first message; return why it failed, or None."""
        try:
            answer, what = self.control.recv()
        except (EOFError, OSError):
            return f"the {self._name} died while it started"
        if answer != "ready":
            return str(what)
        self._ready_at = time.monotonic()
        self._on_ready(what)
        return None

    def _spawn(self) -> None:
        context = multiprocessing.get_context("spawn")
        self._control, theirs = context.Pipe()
        self._process = context.Process(
            target=self._target,
            args=(*self._arguments(), theirs),
            name=f"hapticvlm {self._name}",
            daemon=True,
        )
        self._process.start()
        theirs.close()
        self._spawned_at = time.monotonic()
        self._ready_at = None

    def _kill(self) -> None:
        """End the process without waiting: one of many gigabytes takes its time to die."""
        if self._process is not None:
            self._process.kill()
            self._dying = self._process
        self._process = self._control = self._ready_at = None

    def _is_buried(self, now: float) -> bool:
        """Whether the process that was killed is gone, or not worth waiting for any longer."""
        if self._dying is not None and self._dying.is_alive():
            return now - self._retry_at > DYING_S
        self._dying = None
        return True
