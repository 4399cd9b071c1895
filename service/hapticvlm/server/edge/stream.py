"""Bytes in, whole messages out, one at a time and in their order: the way of a touch.

What RFC 6455 says is decided by websockets' protocol without I/O; this is its shell over an asyncio
transport, encrypted or not. A short message that finds nothing before it is carried out inside the
read that brought it. All others wait for a turn of the event loop each, so that no client gets two
while another has none. Knows no message; how a socket begins and ends stands in `socket.py`.
"""

from __future__ import annotations

import asyncio
import time
from collections import deque
from collections.abc import Callable, Iterable
from contextlib import suppress

from websockets.frames import CloseCode, Frame, Opcode
from websockets.http11 import Request
from websockets.protocol import State
from websockets.server import ServerProtocol

from hapticvlm.server.budgets import READ_BYTES, TURN_BYTES, PeerBudget
from hapticvlm.server.edge.assembly import Assembly
from hapticvlm.server.edge.frame_lengths import FrameLengths
from hapticvlm.server.turns import put_off

MOST_QUEUED = 4  # messages; then nothing more is read
CONTROL = (Opcode.PING, Opcode.PONG)


class Stream(asyncio.BufferedProtocol):
    """The bytes and messages of one connection."""

    transport: asyncio.Transport

    def __init__(self, most_bytes: int) -> None:
        self.protocol = ServerProtocol(max_size=most_bytes)
        self.budget = PeerBudget(time.monotonic())
        self.is_writable = True  # the client reads what it is sent
        self._loop = asyncio.get_running_loop()
        self._lengths = FrameLengths()
        self._assembly = Assembly()
        self._short = bytearray(READ_BYTES)
        self._buffer = self._short
        self._inbox: deque[bytes | str] = deque()
        self._receive: Callable[[bytes | str], None] | None = None
        self._left: Callable[[], None] | None = None
        self._bug: Exception | None = None
        self._is_turn_due = self._is_put_off = self._is_full = False
        self._has_ended = False  # no message will come any more

    def write(self, data: bytes | str) -> None:
        """Send a message now, whether the client reads or not; nothing if the socket closes."""
        if self.protocol.state is not State.OPEN:
            return
        if isinstance(data, str):
            self.protocol.send_text(data.encode())
        else:
            self.protocol.send_binary(data)
        self.flush()

    def flush(self) -> None:
        """Send what the protocol has ready."""
        self.emit(self.protocol.data_to_send())

    def emit(self, pieces: Iterable[bytes]) -> None:
        """Send these; an empty one ends the stream."""
        for data in pieces:
            if self.transport.is_closing():
                return
            if data:
                self.transport.write(data)
            elif self.transport.can_write_eof():
                with suppress(OSError):
                    self.transport.write_eof()
            else:
                self.transport.close()

    def get_buffer(self, _: int) -> bytearray:
        """Return where to read to: a little, or what the frame under way lacks."""
        # All frames of one read are parsed before anybody else has a turn, so a read is short. One
        # that completes a frame brings one frame, however long it is.
        missing = self._lengths.missing
        self._buffer = self._short if missing <= READ_BYTES else bytearray(min(missing, TURN_BYTES))
        return self._buffer

    def buffer_updated(self, count: int) -> None:
        """Take what was read: count it, parse it, carry out at most one message."""
        # Bytes are counted before anybody looks at them: a frame that is never completed, or is
        # compressed, or is no frame at all costs its sender just the same.
        now = time.monotonic()
        data = bytes(memoryview(self._buffer)[:count])
        if not self.budget.spend_bytes(count, now):
            self.refuse("too many bytes")
        self._parse(data, now)
        # To parse a picture's message and to carry it out are a turn each: a touch that has come
        # meanwhile to another socket goes between. One of this socket goes behind it, and then
        # there is nothing to wait for.
        if self._is_put_off and len(self._inbox) > 1:
            self._take_turn()
        elif self._inbox and len(self._inbox[0]) > READ_BYTES and not self._is_turn_due:
            self._is_turn_due = self._is_put_off = True
            put_off(self._take_put_off)
        elif not self._is_turn_due:
            self._take_turn()
        # What the client asked for by a control frame leaves last. When it closes, its outputs rest
        # before it is told that the connection is closed.
        self.flush()
        if self.protocol.state is not State.OPEN:
            self.expect_end()

    def _parse(self, data: bytes, now: float) -> None:
        was_open = self.protocol.state is State.OPEN
        self.protocol.receive_data(data)
        for event in self.protocol.events_received():
            if isinstance(event, Frame):
                self._take(event, now)
            elif isinstance(event, Request):
                self.requested(event)
        if self.protocol.state is State.OPEN:
            self._lengths.follow(data)
        elif was_open:
            self._has_ended = True

    def _take(self, frame: Frame, now: float) -> None:
        """Spend the budget of a frame and keep the message that it completes."""
        if self._has_ended:
            return
        if frame.opcode is Opcode.CLOSE:
            self._has_ended = True
            return
        excess = self.budget.excess(now, is_control=frame.opcode in CONTROL)
        if excess is not None:
            self.refuse(excess)
        elif frame.opcode not in CONTROL:
            self._join(frame)

    def _join(self, frame: Frame) -> None:
        try:
            if frame.opcode is Opcode.CONT or not frame.fin:
                message = self._assembly.add(frame)
            else:
                whole = bytes(frame.data)
                message = whole.decode() if frame.opcode is Opcode.TEXT else whole
        except UnicodeDecodeError as error:
            self.protocol.fail(CloseCode.INVALID_DATA, f"{error.reason} at {error.start}")
            self.give_up()
        else:
            if message is not None:
                self._put(message)

    def _put(self, message: bytes | str) -> None:
        self._inbox.append(message)
        if len(self._inbox) > MOST_QUEUED and not self._is_full:
            self._is_full = True
            self.transport.pause_reading()

    def _next(self) -> bytes | str:
        message = self._inbox.popleft()
        if self._is_full and len(self._inbox) <= 1:
            self._is_full = False
            self.transport.resume_reading()
        return message

    def _schedule(self) -> None:
        """Have a turn soon, whatever is to be done then."""
        if not self._is_turn_due:
            self._is_turn_due = True
            self._loop.call_soon(self._take_turn)

    def _take_put_off(self) -> None:
        if self._is_put_off:
            self._take_turn()

    def _take_turn(self) -> None:
        """Carry out the next message; one whose client does not read its answers waits."""
        self._is_turn_due = self._is_put_off = False
        if self._receive is None:
            self.tell()
            return
        is_heard = self.is_writable or self._has_ended
        if self._inbox and is_heard:
            try:
                self._receive(self._next())
            except Exception as bug:  # noqa: BLE001 - raised to whoever serves the connection
                self._bug = bug
                self.close(CloseCode.INTERNAL_ERROR)
        if self._inbox and is_heard:
            self._schedule()
        elif not self._inbox and self._has_ended and self._left is not None:
            left = self._left
            self._left = self._receive = None  # they hold this socket
            left()
            self.tell()

    # What a socket adds.

    def requested(self, request: Request) -> None:
        """Answer the request that begins a connection."""
        raise NotImplementedError

    def refuse(self, what: str) -> None:
        """Close with 1008, naming what was too much."""
        raise NotImplementedError

    def close(self, code: int, reason: str = "") -> None:
        """Begin to close."""
        raise NotImplementedError

    def give_up(self) -> None:
        """Throw away what still comes: we have begun to close."""
        raise NotImplementedError

    def expect_end(self) -> None:
        """Cut the connection off soon if it is being closed."""
        raise NotImplementedError

    def tell(self) -> None:
        """Wake those who wait for a message, for room to write, or for the end."""
        raise NotImplementedError
