"""Runs a model in a process of its own and hands it one request at a time through shared memory.

The gateway's end numbers the requests. If a request takes too long, the process is restarted and an
answer with an old number is dropped. Answers are MessagePack and never pickles: a process that
decodes other people's pictures must not be able to run code in the gateway.

Who owns what: the event loop hands over requests and owns the worker's state; a thread per child
reads the answers and passes them on; the child's only thread runs the model. The slot of shared
memory has one owner at a time (see `ModelWorker.__init__`). This module knows no model.
"""

from __future__ import annotations

import ctypes
import logging
import multiprocessing
import signal
import threading
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from multiprocessing.connection import Connection
from typing import Any, Generic, TypeVar

import msgspec
import numpy as np
from numpy.typing import NDArray

from hapticvlm.messages import MAX_MESSAGE_BYTES
from hapticvlm.processes.supervised import START_S, Child, Started

SLOT_BYTES = MAX_MESSAGE_BYTES + 4096
MAX_ANSWER_BYTES = 8 * 1024 * 1024

A = TypeVar("A")
Slot = ctypes.Array[ctypes.c_ubyte]
Serve = Callable[[bytes, tuple[Any, ...]], object]

logger = logging.getLogger(__name__)


@dataclass(frozen=True)
class WorkerReply(Generic[A]):
    """One answer, with the number of the request that it belongs to."""

    number: int
    value: A


@dataclass(frozen=True, slots=True)
class WorkerPlan:
    """The process to run: its name, entry point and settings.

    `answer` is the type of its answers. `limit_s` is the longest time that a request may take, and
    `start_s` the longest time until the model is loaded.
    """

    name: str
    entry: Callable[..., None]
    settings: object
    answer: type
    limit_s: float
    start_s: float = START_S


class _Packet(msgspec.Struct, array_like=True):
    number: int
    body: msgspec.Raw


class ModelWorker(Generic[A]):
    """The gateway's end: hands over one request, and passes its answer to a callback.

    Call all methods from the event loop's thread. Only `start` and `close` block.
    """

    def __init__(self, plan: WorkerPlan) -> None:
        self._plan = plan
        # One slot of shared memory holds the request's picture. Four megabytes through a pipe would
        # be copied twice and would block the event loop when the pipe is full. Only the gateway
        # writes the slot, and only while no request is in progress; the child reads it only after
        # the pipe has announced a request. So each byte has one owner at any time, without a lock.
        # A child that was given up may still read while the next request is written; its answer has
        # an old number and is dropped.
        self._slot = multiprocessing.get_context("spawn").RawArray("B", SLOT_BYTES)
        self._bytes = np.frombuffer(memoryview(self._slot), np.uint8)
        self._child = Child(plan.name, plan.entry, self._arguments, self._begin, plan.start_s)
        self._deliver: Callable[[WorkerReply[A]], None] | None = None
        self._requested_at: float | None = None
        self._number = 0
        self.names: tuple[str, ...] = ()
        self.busy_s = 0.0

    @property
    def pid(self) -> int | None:
        """Process id of the worker."""
        return self._child.pid

    @property
    def restarts(self) -> int:
        """Number of restarts of the process."""
        return self._child.restarts

    @property
    def is_ready(self) -> bool:
        """Whether the model is loaded."""
        return self._child.ready_at is not None

    @property
    def is_busy(self) -> bool:
        """Whether it cannot take a request: one is in progress, or the model is not loaded."""
        return self._requested_at is not None or not self.is_ready

    def start(self, deliver: Callable[[WorkerReply[A]], None]) -> None:
        """Start the process and wait until its model is loaded. Raises ChildError.

        `deliver` is called for each answer, from a thread of this class. It must not block and must
        only pass the answer on to the event loop.
        """
        self._deliver = deliver
        self._child.start()

    def begin(self, deliver: Callable[[WorkerReply[A]], None]) -> None:
        """Start the process without waiting; the worker is busy until its model is loaded."""
        self._deliver = deliver
        self._child.begin()

    def begin_early(self) -> None:
        """Begin to start the process; `start` must follow, which waits and sets the callback."""
        self._child.begin()

    def request(self, data: bytes, details: tuple[Any, ...], now: float) -> None:
        """Hand over one request with its picture as `data`; only while not `is_busy`."""
        self._bytes[: len(data)] = np.frombuffer(data, np.uint8)
        self._requested_at = now
        self._number += 1
        with suppress(OSError):
            self._child.control.send((self._number, len(data), details))

    def accept(self, reply: WorkerReply[A], now: float) -> bool:
        """Record that an answer came; false if it belongs to a request that was given up."""
        if reply.number != self._number or self._requested_at is None:
            return False
        self.busy_s += now - self._requested_at
        self._requested_at = None
        return True

    def supervise(self, now: float) -> str | None:
        """Restart a dead or late process; return what happened, or None."""
        is_late = self._requested_at is not None and now - self._requested_at > self._plan.limit_s
        trouble = self._child.supervise(now, is_well=not is_late)
        if trouble is not None:
            self._requested_at = None
            self._number += 1
        return trouble

    def close(self) -> None:
        """Stop the process."""
        self._child.close(0.0)

    def _arguments(self) -> tuple[Any, ...]:
        return self._slot, self._plan.settings

    def _begin(self, names: tuple[str, ...]) -> None:
        self.names = names
        arguments = self._child.control, self._deliver, self._plan
        reader = threading.Thread(
            target=_read, args=arguments, name=f"{self._plan.name} answers", daemon=True
        )
        reader.start()


def serve_requests(
    slot: Slot, control: Connection, load: Callable[[], tuple[Started, Serve]]
) -> None:
    """Load a model and answer requests until the gateway is gone; the child's main function.

    `load` returns the report for the gateway and the function that answers one request. Whatever
    it raises is reported as the reason why the worker cannot start. When the gateway dies, its end
    of the pipe closes, and this function returns.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        started, serve = load()
    except Exception as error:  # noqa: BLE001 - the gateway must learn why, whatever a model threw
        Started(error=str(error)).send(control)
        return
    started.send(control)
    data = np.frombuffer(memoryview(slot), np.uint8).data
    with suppress(EOFError, OSError):
        while True:
            number, length, details = control.recv()
            body = _encode(serve(bytes(data[:length]), details))
            control.send_bytes(msgspec.msgpack.encode(_Packet(number, msgspec.Raw(body))))


def _read(
    control: Connection, deliver: Callable[[WorkerReply[Any]], None], plan: WorkerPlan
) -> None:
    """Pass on answers until the pipe ends.

    An answer that cannot be decoded ends the thread too. The request then runs into its time limit,
    and the process is restarted.
    """
    packets = msgspec.msgpack.Decoder(_Packet)
    bodies: msgspec.msgpack.Decoder[Any] = msgspec.msgpack.Decoder(plan.answer, dec_hook=_array)
    # This thread lives as long as its pipe. When the child dies, the read raises EOFError and the
    # thread ends; the next child has a pipe and a thread of its own. The thread never touches the
    # worker's state: `deliver` passes the answer on to the event loop, which compares its number
    # with that of the current request.
    with suppress(EOFError, OSError):
        while True:
            data = control.recv_bytes(MAX_ANSWER_BYTES)
            try:
                packet = packets.decode(data)
                value = bodies.decode(packet.body)
            except msgspec.MsgspecError as error:
                logger.error("the %s sent an answer that cannot be decoded: %s", plan.name, error)
                return
            deliver(WorkerReply(packet.number, value))


def _encode(answer: object) -> bytes:
    return msgspec.msgpack.encode(answer, enc_hook=_bytes)


def _bytes(value: object) -> bytes:
    if not isinstance(value, np.ndarray):
        raise TypeError(f"an answer must not contain a {type(value).__name__}")
    return value.astype(np.float32).tobytes()


def _array(kind: type, value: object) -> NDArray[np.float32]:
    """Decode a vector of float32, (N,): the only type that MessagePack does not know itself."""
    if not isinstance(value, bytes) or len(value) % 4:
        raise ValueError(f"not a {kind}")
    return np.frombuffer(value, np.float32)
