"""A child process that is started, watched and restarted, the same for engine, recogniser and VLM.

The child's first message on its pipe is a `Started`. A child that dies or hangs is restarted at
once, one that keeps failing after growing pauses; one that the system has no room for counts as
failed. Processes are started in a thread: what a child is given may be more than its pipe holds,
and whoever supervises must not wait until the child has read it. Knows nothing of what it does.
"""

from __future__ import annotations

import multiprocessing
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess
from typing import Any

import msgspec

from hapticvlm import backoff
from hapticvlm.errors import HapticVLMError

START_S = 60.0  # a child that fails reports it at once; only a busy machine takes this long
STEADY_S = 10.0
DYING_S = 1.0
SPAWNING_S = 10.0  # to wait at the end for a start under way
FIRST_PAUSE_S = 1.0
LONGEST_PAUSE_S = 30.0
MAX_STARTED_BYTES = 64 * 1024


class ChildError(HapticVLMError):
    """The child did not start; the text says why."""


class Started(msgspec.Struct, frozen=True):
    """A child's first message: the names of what it runs, or why it cannot."""

    names: tuple[str, ...] = ()
    error: str | None = None

    def send(self, control: Connection) -> None:
        """Send it to the parent; one that has gone meanwhile is noticed by the next read."""
        with suppress(OSError):
            control.send_bytes(msgspec.msgpack.encode(self))


class Child:
    """One process and its pipe; `on_ready` is given the names of what the child runs."""

    def __init__(
        self,
        name: str,
        target: Callable[..., None],
        arguments: Callable[[], tuple[Any, ...]],
        on_ready: Callable[[tuple[str, ...]], None],
        start_s: float = START_S,
    ) -> None:
        self._name = name
        self._target = target
        self._arguments = arguments
        self._on_ready = on_ready
        self._start_s = start_s
        # A child is in one of three states. Spawning: a thread starts it, `_spawning` is set and
        # there is no process yet. Running: `_process` and our end of its pipe, `_control`, are set,
        # and `_ready_at` once its first message came. Waiting: neither, until `_retry_at`. The
        # process before may still be dying then; two of them never hold the same device, since the
        # next one is not started before it is reaped, or DYING_S have passed.
        self._spawning: _Spawning | None = None
        self._process: BaseProcess | None = None
        self._dying: BaseProcess | None = None
        self._control: Connection | None = None
        self._spawned_at = 0.0
        self._ready_at: float | None = None
        self._retry_at = 0.0
        self._failures = 0
        self.restarts = 0

    @property
    def pid(self) -> int | None:
        """Process id, None while there is no process."""
        return self._process.pid if self._process else None

    @property
    def ready_at(self) -> float | None:
        """When the child was ready, on the monotonic clock; None until then."""
        return self._ready_at

    @property
    def control(self) -> Connection:
        """Our end of the pipe; only while the child is ready."""
        if self._control is None:
            raise ChildError(f"the {self._name} is not running")
        return self._control

    def start(self) -> None:
        """Start, if it has not begun, and wait until the child is ready. Raises ChildError."""
        if self._spawning is None:
            self.begin()
        assert self._spawning is not None
        self._spawning.thread.join()
        failure = self._adopt()
        if failure is None and not self.control.poll(self._start_s):
            failure = f"the {self._name} did not start within {self._start_s:.0f} s"
        if failure is None:
            failure = self._receive_started()
        if failure is not None:
            self.close(0.0)
            raise ChildError(failure)

    def begin(self) -> None:
        """Start and do not wait: `supervise` finds the child ready, or returns why it is not."""
        self._spawning = _Spawning(self._spawn)

    def supervise(self, now: float, *, is_well: bool) -> str | None:
        """Restart a child that died, or hung (`is_well` false); return what happened, if anything.

        Never blocks; call it often.
        """
        if self._spawning is not None:
            if self._spawning.thread.is_alive():
                return None
            failure = self._adopt()
        elif self._process is None:
            if self._retry_at and now >= self._retry_at and self._is_reaped(now):
                self.begin()
            return None
        else:
            failure = self._failure(now, is_well)
        return None if failure is None else self._retry(failure, now)

    def close(self, patience_s: float) -> None:
        """Close the pipe, wait for the child to end by itself, then kill it."""
        self._retry_at = 0.0
        if self._spawning is not None:
            self._spawning.thread.join(SPAWNING_S)
            self._adopt()
        if self._control is not None:
            self._control.close()
        if self._process is not None:
            self._process.join(patience_s)
        self._kill()
        if self._dying is not None:
            self._dying.join(DYING_S)

    def _retry(self, failure: str, now: float) -> str:
        """End what is left of the child and plan the next try."""
        if self._ready_at is not None and now - self._ready_at > STEADY_S:
            self._failures = 0
        pause_s = backoff.pause_s(self._failures, FIRST_PAUSE_S, LONGEST_PAUSE_S)
        self._failures += 1
        self._kill()
        self.restarts += 1
        self._retry_at = now + pause_s
        return f"{failure}; restarted {f'in {pause_s:.0f} s' if pause_s else 'at once'}"

    def _failure(self, now: float, is_well: bool) -> str | None:
        assert self._process is not None
        if self._ready_at is None and self._has_sent():
            return self._receive_started()
        if not self._process.is_alive():
            return f"the {self._name} died (exit code {self._process.exitcode})"
        if self._ready_at is None:
            late = now - self._spawned_at > self._start_s
            return f"the {self._name} did not start within {self._start_s:.0f} s" if late else None
        return None if is_well else f"the {self._name} hung"

    def _has_sent(self) -> bool:
        """Whether there is something to read, if only that there never will be."""
        try:
            return self.control.poll()
        except OSError:  # Windows says so of a broken pipe
            return True

    def _receive_started(self) -> str | None:
        """Receive the child's first message; return why it failed, or None."""
        try:
            data = self.control.recv_bytes(MAX_STARTED_BYTES)
            started = msgspec.msgpack.decode(data, type=Started)
        except (EOFError, OSError, msgspec.MsgspecError):
            return f"the {self._name} died while it started"
        if started.error is not None:
            return started.error
        self._ready_at = time.monotonic()
        self._on_ready(started.names)
        return None

    def _adopt(self) -> str | None:
        """Take over the process that a thread has started; return why there is none, or None."""
        spawning = self._spawning
        self._spawning = None
        assert spawning is not None
        if spawning.found is None:
            error = spawning.error or OSError("not done in time")
            return f"the {self._name} could not be started: {error.strerror or error}"
        self._process, self._control = spawning.found
        self._spawned_at = time.monotonic()
        self._ready_at = None
        return None

    def _spawn(self) -> tuple[BaseProcess, Connection]:
        """Start the process. Raises OSError: no descriptors or no memory left."""
        context = multiprocessing.get_context("spawn")
        ours, theirs = context.Pipe()
        with theirs:
            process = context.Process(
                target=self._target,
                args=(*self._arguments(), theirs),
                name=f"hapticvlm {self._name}",
                daemon=True,
            )
            try:
                process.start()
            except OSError:
                ours.close()
                raise
        return process, ours

    def _kill(self) -> None:
        """End the process without waiting: one of many gigabytes takes its time to die."""
        # SIGKILL and not a request: what hangs hears no request, and a child owns nothing that it
        # would have to put in order. The audio engine's output is closed by the system with it.
        if self._process is not None:
            self._process.kill()
            self._dying = self._process
        self._process = None
        self._control = None
        self._ready_at = None

    def _is_reaped(self, now: float) -> bool:
        """Whether the process that was killed is gone, or not worth waiting for any longer."""
        if self._dying is not None and self._dying.is_alive():
            return now - self._retry_at > DYING_S
        self._dying = None
        return True


class _Spawning:
    """A start under way in a thread of its own: `found` or `error` when the thread has ended."""

    def __init__(self, spawn: Callable[[], tuple[BaseProcess, Connection]]) -> None:
        self.found: tuple[BaseProcess, Connection] | None = None
        self.error: OSError | None = None
        self._spawn = spawn
        self.thread = threading.Thread(target=self._run, name="start a child", daemon=True)
        self.thread.start()

    def _run(self) -> None:
        try:
            self.found = self._spawn()
        except OSError as error:
            self.error = error
