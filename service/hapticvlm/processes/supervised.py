"""Starts, watches and restarts a child process: the audio engine, the recogniser and the VLM.

The child's first message on its pipe is a `Started`. A child that dies or hangs is restarted at
once; one that keeps failing is restarted after growing pauses (`backoff.py`). A child that
cannot be started, because no memory or descriptors are left, counts as failed, and so does one that
an update of the program has given another version.

Processes are started in a thread. The arguments of a child may be larger than a pipe holds, so
starting it blocks until the child has read them, and the supervisor must not block. Everything else
runs in the caller's thread. This module does not know what the child does.
"""

from __future__ import annotations

import multiprocessing
import pickle
import signal
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from multiprocessing import resource_tracker
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess
from multiprocessing.reduction import ForkingPickler
from typing import Any

import msgspec

from hapticvlm import __version__, backoff
from hapticvlm.errors import MORE_MEMORY, HapticVLMError, one_line, out_of_memory

START_S = 60.0  # a child that fails reports it at once; only a busy machine takes this long
STEADY_S = 10.0  # a child that ran for so long has recovered: its next failure counts as the first
DYING_S = 1.0  # to wait for a killed process before the next one is started
SPAWNING_S = 10.0  # to wait on close for a start in progress
FIRST_PAUSE_S = 1.0
LONGEST_PAUSE_S = 30.0
MAX_STARTED_BYTES = 64 * 1024


class ChildError(HapticVLMError):
    """The child did not start; the message says why."""


class Started(msgspec.Struct, frozen=True):
    """A child's first message: the names of what it runs, or the error that stopped it."""

    names: tuple[str, ...] = ()
    error: str | None = None

    def send(self, control: Connection) -> None:
        """Send it to the parent; if the parent is gone, the child's next read notices it."""
        with suppress(OSError):
            control.send_bytes(msgspec.msgpack.encode(self))


class _Entry:
    """A child's main function with its arguments, which only the same version unpickles.

    A child is a new Python, which imports this program from the disk. After an update that is
    another version than the one of the service that starts it, and the two may disagree about the
    arguments, the shared memory and the pipe. So the version comes first, and the rest is unpickled
    only if it matches.
    """

    def __init__(self, name: str, target: Callable[..., None], arguments: tuple[Any, ...]) -> None:
        self._state = name, target, arguments

    def __getstate__(self) -> tuple[str, str, bytes]:
        name, *work = self._state
        return name, __version__, bytes(ForkingPickler.dumps(work))

    def __setstate__(self, state: tuple[str, str, bytes]) -> None:
        self._name, self._version, self._work = state

    def __call__(self, control: Connection) -> None:
        """Run the main function, in the child."""
        if self._version != __version__:
            found = f"the {self._name} on the disk is of hapticvlm {__version__}"
            error = f"{found}, this service of {self._version}: restart the service"
            Started(error=error).send(control)
            return
        try:
            target, arguments = pickle.loads(self._work)
        except (ImportError, MemoryError, OSError) as error:
            reason = out_of_memory(error) or one_line(error)
            Started(error=f"the {self._name} cannot be loaded: {reason}").send(control)
            return
        try:
            target(*arguments, control)
        except (MemoryError, RuntimeError, ImportError) as error:
            scarcity = out_of_memory(error)
            if scarcity is None:
                raise
            sys.exit(f"the {self._name} ended: {scarcity}")


class Child:
    """One supervised process and its pipe. Call it from one thread.

    `target` is the child's main function; it gets the results of `arguments`, which is called for
    every start, and its end of the pipe. `on_ready` gets the names in the child's `Started`.
    `start_s` is the longest time until the child must be ready.
    """

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
        # A child is in one of three states.
        # - Spawning: a thread starts it; `_spawning` is set and there is no process yet.
        # - Running: `_process` and our end of its pipe, `_control`, are set, and `_ready_at` as
        #   soon as its first message has come.
        # - Waiting: neither is set until `_retry_at`. The earlier process may still be dying, and
        #   two processes must not hold the same device. So the next one is started only when the
        #   earlier one is gone, or after DYING_S.
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
        """Process id; None while there is no process."""
        return self._process.pid if self._process else None

    @property
    def ready_at(self) -> float | None:
        """Time at which the child became ready, s on the monotonic clock; None before that."""
        return self._ready_at

    @property
    def control(self) -> Connection:
        """Our end of the pipe. Raises ChildError while there is no process."""
        if self._control is None:
            raise ChildError(f"the {self._name} is not running")
        return self._control

    def start(self) -> None:
        """Start the child, unless `begin` has, and wait until it is ready. Raises ChildError."""
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
        """Begin to start the child; a later `supervise` takes it over or returns why it failed."""
        self._spawning = _Spawning(self._spawn)

    def supervise(self, now: float, *, is_well: bool) -> str | None:
        """Restart a child that died or hung; return what happened, or None.

        `is_well` is false for a child that hangs, by the caller's judgement. `now` is s on the
        monotonic clock. Never blocks; call it several times a second.
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
        """Close the pipe, wait up to `patience_s` for the child to end by itself, then kill it."""
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
        """Kill the child and schedule the next start; return what happened, with the pause."""
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
        """Whether a read would not block: a message has come, or the pipe has ended."""
        try:
            return self.control.poll()
        except OSError:  # Windows raises this for a broken pipe
            return True

    def _receive_started(self) -> str | None:
        """Receive the child's first message; return why it failed, or None."""
        try:
            data = self.control.recv_bytes(MAX_STARTED_BYTES)
            started = msgspec.msgpack.decode(data, type=Started)
        except (EOFError, OSError, msgspec.MsgspecError):
            return f"the {self._name} died while it started; if memory is short, {MORE_MEMORY}"
        if started.error is not None:
            return started.error
        self._ready_at = time.monotonic()
        self._on_ready(started.names)
        return None

    def _adopt(self) -> str | None:
        """Take over the process from the thread that started it; return an error, or None."""
        spawning = self._spawning
        self._spawning = None
        assert spawning is not None
        if spawning.result is None:
            error = spawning.error or OSError("not done in time")
            return f"the {self._name} could not be started: {error.strerror or error}"
        self._process, self._control = spawning.result
        self._spawned_at = time.monotonic()
        self._ready_at = None
        return None

    def _spawn(self) -> tuple[BaseProcess, Connection]:
        """Start the process. Raises OSError if no descriptors or memory are left."""
        context = multiprocessing.get_context("spawn")
        ours, theirs = context.Pipe()
        with theirs:
            process = context.Process(
                target=_Entry(self._name, self._target, self._arguments()),
                args=(theirs,),
                name=f"hapticvlm {self._name}",
                daemon=True,
            )
            try:
                with _ctrl_c_blocked():
                    process.start()
            except OSError:
                ours.close()
                raise
        return process, ours

    def _kill(self) -> None:
        """Kill the process without waiting for its end: one with many gigabytes dies slowly."""
        # SIGKILL, because a process that hangs does not react to a request, and a child holds
        # nothing that it would have to clean up. The system closes the audio engine's output.
        if self._process is not None:
            self._process.kill()
            self._dying = self._process
        self._process = None
        self._control = None
        self._ready_at = None

    def _is_reaped(self, now: float) -> bool:
        """Whether the killed process is gone, or has been waited for long enough."""
        if self._dying is not None and self._dying.is_alive():
            return now - self._retry_at > DYING_S
        self._dying = None
        return True


class _Spawning:
    """A start in progress, in a thread; `result` or `error` is set when the thread has ended."""

    def __init__(self, spawn: Callable[[], tuple[BaseProcess, Connection]]) -> None:
        self.result: tuple[BaseProcess, Connection] | None = None
        self.error: OSError | None = None
        self._spawn = spawn
        self.thread = threading.Thread(target=self._run, name="start a child", daemon=True)
        self.thread.start()

    def _run(self) -> None:
        try:
            self.result = self._spawn()
        except OSError as error:
            self.error = error


@contextmanager
def _ctrl_c_blocked() -> Iterator[None]:
    """Block SIGINT in this thread, and so in a process that it starts, from its first moment on.

    A terminal sends Ctrl-C to the children, too, and they leave it to their parent, which ends
    them. They ignore it once their main function runs. The imports before that take seconds, in
    which a child would print a traceback and die, and its parent would report that as a failure.
    """
    if not hasattr(signal, "pthread_sigmask"):  # Windows
        yield
        return
    resource_tracker.ensure_running()  # the first start would run it, which unblocks the signal
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
