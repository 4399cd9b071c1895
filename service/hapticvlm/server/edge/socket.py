"""One WebSocket of a client: bytes in, whole messages out, one at a time and in their order.

RFC 6455 is implemented by websockets' Sans-I/O protocol; `ClientSocket` is its shell over an
asyncio transport, encrypted or not. A touch takes this way: a short message that finds no other
before it is carried out inside the read that brought it. Every other message waits for a turn of
the event loop of its own, so that no client gets two turns while another has none.

A socket that sends more than its budget is closed with 1008 before its excess costs the others a
turn. A socket that is being closed is cut off after a second, so no client is waited for.
"""

from __future__ import annotations

import asyncio
import codecs
import logging
import time
from collections import deque
from collections.abc import Callable, Iterable
from contextlib import suppress
from dataclasses import dataclass
from http import HTTPStatus
from pathlib import Path
from typing import Protocol, cast

from websockets.exceptions import ConnectionClosedError
from websockets.frames import CloseCode, Frame, Opcode
from websockets.http11 import Response
from websockets.protocol import State
from websockets.server import ServerProtocol

from hapticvlm.server.counters import Count
from hapticvlm.server.edge import request
from hapticvlm.server.edge.limiter import SocketLimiter
from hapticvlm.server.edge.limits import (
    MAX_REQUEST_BYTES,
    MAX_TEXT_BYTES,
    PHASES,
    READ_BYTES,
    PeerBudget,
    Phase,
)
from hapticvlm.server.edge.request import HttpRequest, RequestError, RequestReader
from hapticvlm.server.edge.scheduling import call_after_io

WRITE_BYTES = 32_768  # that wait to be sent before the client counts as a slow reader
PIECE = 64 * 1024  # of a long page or file
CLOSING_PAUSE_S = 0.01  # between two reads of a socket that is being closed: our choice
MAX_QUEUED = 4  # messages; then nothing more is read
CONTROL = (Opcode.PING, Opcode.PONG)

_MASK_BYTES = 4
# The first length byte of a frame is its length, up to 125; 126 and 127 announce a longer field.
_TWO_BYTES = 126
_UTF8_BYTES = 4  # the longest character
_DISCARDED = bytearray(256 * 1024)  # that closing sockets still get; unread, so all share it
_STATES = {
    Phase.ASKING: State.CONNECTING,
    Phase.CLOSING: State.CLOSING,
    Phase.CLOSED: State.CLOSED,
}

logger = logging.getLogger(__name__)


class ListenerHooks(Protocol):
    """The parts of a listener that its sockets use."""

    limiter: SocketLimiter[ClientSocket]
    max_bytes: int

    def on_request(self, socket: ClientSocket, request: HttpRequest) -> None:
        """Answer the request that begins a connection."""


@dataclass
class FileResponse(Response):
    """An answer whose body is a file, read from the disk piece by piece."""

    path: Path = Path()
    size: int = 0  # in bytes, as announced; a file that is cut meanwhile ends the connection


class ClientSocket(asyncio.BufferedProtocol):
    """The service's end of one connection.

    asyncio calls `get_buffer`, `buffer_updated`, `eof_received`, `connection_made`,
    `connection_lost`, `pause_writing` and `resume_writing`. The listener answers the request with
    `respond`. A server then takes messages one by one with `recv`, or all of them with `run`.

    The phase of a connection decides what bytes mean, and how many may come. Bytes belong to one
    phase: those behind a request are kept until it is answered, and those behind a hello until the
    client is admitted. Nothing is read meanwhile.
    """

    transport: asyncio.Transport

    def __init__(self, listener: ListenerHooks) -> None:
        # The protocol is told that it is open, so it parses frames from its first byte on. It never
        # sees the request, and `phase` says what the connection is.
        self.protocol = ServerProtocol(state=State.OPEN, max_size=listener.max_bytes)
        self._enter(Phase.ASKING)
        self.budget = PeerBudget(time.monotonic())
        self.request: HttpRequest | None = None
        self.is_writable = True  # the client reads what it is sent
        self._listener = listener
        self._loop = asyncio.get_running_loop()
        # Input: bytes are read into a buffer, parsed into frames, and joined to messages.
        self._reader = RequestReader(MAX_REQUEST_BYTES)
        self._boundaries = FrameBoundaries()
        self._assembler = FragmentAssembler()
        self._short = bytearray(READ_BYTES)
        self._buffer = self._short
        self._next_phase_bytes = b""  # came with the end of this phase
        self._hello_bytes = 0  # that came before hello
        self._inbox: deque[bytes | str] = deque()
        self._inbox_bytes = 0
        self._held = 0  # bytes, as the limiter knows them
        self._is_full = False  # the inbox, so reading is paused
        self._is_held_up = False  # the next phase has not begun, so reading is paused
        self._has_ended = False  # no message will come any more
        # Messages are handed over in turns of the event loop.
        self._on_message: Callable[[bytes | str], None] | None = None
        self._on_closed: Callable[[], None] | None = None
        self._error: Exception | None = None  # of `_on_message`
        self._is_turn_due = False
        self._is_deferred = False  # the turn that is due lets readable sockets go first
        # Output, and the end of the connection.
        self._next_posted: Callable[[], bytes | str | None] = _nothing
        self._is_post_due = False
        self._deadline: asyncio.TimerHandle | None = None
        self._wakeup = asyncio.Event()

    @property
    def state(self) -> State:
        """Whether the socket is being opened, is open, is being closed or is closed."""
        return self.protocol.state if self._is_websocket else _STATES[self.phase]

    @property
    def close_code(self) -> int:
        """The code of the client's close frame, else of ours, else 1006."""
        close = self.protocol.close_rcvd or self.protocol.close_sent
        return CloseCode.ABNORMAL_CLOSURE if close is None else close.code

    @property
    def remote_address(self) -> tuple[str, int]:
        """Address and port of the client."""
        return cast("tuple[str, int]", self.transport.get_extra_info("peername") or ("", 0))

    @property
    def local_address(self) -> tuple[str, int]:
        """Address and port at which the client reached this machine."""
        return cast("tuple[str, int]", self.transport.get_extra_info("sockname") or ("", 0))

    def mark_admitted(self) -> None:
        """Give the socket the budgets of an admitted client."""
        if self.phase is Phase.BEFORE_HELLO:
            self._enter(Phase.OPEN)
            self._listener.limiter.mark_admitted(self)
            self._go_on()

    # A server takes messages, and sends.

    async def recv(self) -> bytes | str:
        """Return the next message. Raises ConnectionClosed."""
        while not self._inbox:
            if self._has_ended:
                raise ConnectionClosedError(None, None)
            await self._wait()
        return self._next()

    async def run(
        self, on_message: Callable[[bytes | str], None], on_closed: Callable[[], None]
    ) -> None:
        """Hand each message to `on_message`; when the client has left, call `on_closed`, once.

        Neither may take long. An error of `on_message` closes the socket and is raised here.
        """
        self._on_message = on_message
        self._on_closed = on_closed
        self._schedule()
        while self._on_closed is not None:
            await self._wait()
        if self._error is not None:
            raise self._error

    async def send(self, data: bytes | str) -> None:
        """Send a message, waiting if the client reads slowly. Raises ConnectionClosed."""
        if self.state is not State.OPEN:
            raise ConnectionClosedError(None, None)
        self.write(data)
        await self.drain()

    async def drain(self) -> None:
        """Wait until the client has read enough of what was sent, or has gone."""
        while not (self.is_writable or self.phase is Phase.CLOSED):
            await self._wait()

    def write(self, data: bytes | str) -> None:
        """Send a message now, also to a slow reader; send nothing if the socket is closing."""
        if self.state is not State.OPEN:
            return
        if isinstance(data, str):
            self.protocol.send_text(data.encode())
        else:
            self.protocol.send_binary(data)
        self.flush()

    def flush(self) -> None:
        """Send the bytes that the protocol has ready."""
        self.emit(self.protocol.data_to_send())

    def emit(self, pieces: Iterable[bytes]) -> None:
        """Send these bytes; an empty piece ends the stream."""
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

    def post_from(self, next_posted: Callable[[], bytes | str | None]) -> None:
        """Set the source of messages that wait for a slow reader; it gives None at its end."""
        self._next_posted = next_posted

    def posted(self) -> None:
        """Note that a message was posted: it leaves after the answer that is under way."""
        if self.is_writable and not self._is_post_due:
            self._is_post_due = True
            self._loop.call_soon(self._write_posted)

    def accept(self, request: HttpRequest) -> Response:
        """Return the answer that opens a WebSocket, or that says why it does not."""
        return self.protocol.accept(request.handshake)

    async def respond(self, response: Response) -> None:
        """Answer the request; a long page goes in pieces, each when the one before has left."""
        if self.phase is not Phase.ASKING:
            return  # the client has gone
        if response.status_code == HTTPStatus.SWITCHING_PROTOCOLS:
            self.emit([response.serialize()])
            self._enter(Phase.BEFORE_HELLO)
            self._expire(None)  # the server ends this phase in time, and says so in words
            self._go_on()
            return
        is_head = self.request is not None and self.request.method == "HEAD"
        self.emit([_head(response)])
        if not is_head:
            await (
                self._send_file(response)
                if isinstance(response, FileResponse)
                else self._send_body(response.body)
            )
        self.emit([b""])
        self._end_input()

    async def _send_body(self, body: bytes | bytearray) -> None:
        view = memoryview(body)
        for start in range(0, len(view), PIECE):
            if self.transport.is_closing():
                return
            await self._send_piece(view[start : start + PIECE])

    async def _send_file(self, response: FileResponse) -> None:
        for start in range(0, response.size, PIECE):
            count = min(PIECE, response.size - start)
            # The file is opened for each piece, so a crowd of readers holds no descriptors.
            try:
                piece = await asyncio.to_thread(_read_piece, response.path, start, count)
            except OSError:
                piece = b""
            if len(piece) != count:
                logger.warning("%s has changed while it was sent", response.path)
                self.transport.abort()
            if self.transport.is_closing():
                return
            await self._send_piece(piece)

    async def _send_piece(self, piece: bytes | memoryview) -> None:
        # The time is that of one piece: a slow network takes long for all of them.
        self._expire(self._limits.seconds)
        self.transport.write(piece)
        await self.drain()

    def close(self, code: int = CloseCode.NORMAL_CLOSURE, reason: str = "") -> None:
        """Close; a client that does not end the connection then is cut off."""
        if self.state is State.OPEN:
            # The stream ends with the close frame: the client answers it, and nothing that it
            # sends from here on is parsed.
            self.protocol.fail(code, reason)
            self._discard_input()

    def refuse(self, excess: Count) -> None:
        """Close with 1008, naming the budget exceeded; counted, and logged once a connection."""
        if self.state is State.OPEN:
            self._listener.limiter.counts[excess] += 1
            logger.warning("%s %s", self.remote_address[0] or "a client", excess)
            self.close(CloseCode.POLICY_VIOLATION, excess.reason)

    # asyncio brings the transport, bytes and the end.

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Take the transport."""
        self.transport = cast("asyncio.Transport", transport)
        self.transport.set_write_buffer_limits(WRITE_BYTES)
        self._expire(self._limits.seconds)
        self._listener.limiter.add(self, self._loop.time())

    def get_buffer(self, _: int) -> bytearray:
        """Return the buffer to read into: a short one, or one for the rest of a long frame."""
        # All frames of one read are parsed before any other socket has a turn, so a read is short.
        # A read that completes a frame brings one frame, however long it is.
        size = min(self._boundaries.missing, self._limits.read_bytes)
        self._buffer = self._short if size <= READ_BYTES else bytearray(size)
        return self._buffer

    def buffer_updated(self, count: int) -> None:
        """Take the bytes that were read: count them, parse them, carry out at most one message."""
        # Bytes are counted before they are parsed: a frame that is never completed, or is
        # compressed, or is not a frame at all costs its sender just the same.
        now = time.monotonic()
        if not self.budget.spend_bytes(count, now):
            if self.state is not State.OPEN:
                self.transport.abort()
                return
            self.refuse(Count.CLOSED_BYTES)
        if self.phase is Phase.CLOSING:
            # Read for its end alone, so seldom and much at once: a client that goes on sending to
            # its closing socket would else have as many turns as all others together.
            self.transport.pause_reading()
            self._loop.call_later(CLOSING_PAUSE_S, self._update_reading)
            return
        self._receive(bytes(memoryview(self._buffer)[:count]), now)

    def _receive(self, data: bytes, now: float) -> None:
        """Take bytes of the present phase."""
        if self._is_websocket:
            most = self._limits.input_bytes
            if most is None:
                self._parse(data, now)
            else:
                self._parse_hello(data, most, now)
            self._process()
            # Answers to control frames leave last. When the client closes, its outputs rest before
            # it is told that the connection is closed.
            self.flush()
            if self.protocol.state is not State.OPEN:
                self._end_input()
        elif self.phase is Phase.ASKING:
            self._read_request(data)
        self._report_held()

    def _process(self) -> None:
        """Carry out a short message now and a long one in a turn of its own."""
        # Parsing a picture's message and carrying it out are a turn each: a touch that has come
        # meanwhile to another socket goes between. A touch of this socket queues behind the
        # picture, and then there is nothing to wait for.
        if self._is_turn_due:
            if self._is_deferred and len(self._inbox) > 1:
                self._take_turn()
        elif self._inbox and len(self._inbox[0]) > READ_BYTES:
            self._is_turn_due = True
            self._is_deferred = True
            call_after_io(self._take_deferred_turn)
        else:
            self._take_turn()

    def pause_writing(self) -> None:
        """Note that the client reads slowly."""
        self.is_writable = False

    def resume_writing(self) -> None:
        """Go on with what waited for the client to read."""
        self.is_writable = True
        self.posted()
        self._schedule()
        self._wake()

    def eof_received(self) -> None:
        """Take the end of the client's bytes; asyncio closes the transport then."""
        if self.state is State.OPEN:
            self.protocol.receive_eof()
            self.flush()
            self._end_input()

    def connection_lost(self, _: Exception | None) -> None:
        """Forget the connection, once the messages it had sent are carried out."""
        self._enter(Phase.CLOSED)
        self._expire(None)
        self._listener.limiter.remove(self)
        self._has_ended = True
        self._break_cycles()
        self._schedule()
        self._wake()

    # From bytes to a request, or to messages.

    def _read_request(self, data: bytes) -> None:
        try:
            complete = self._reader.feed(data)
        except RequestError as error:
            self.emit([request.refusal(error).serialize(), b""])
            self._end_input()
            return
        if complete is not None:
            self.request, self._next_phase_bytes = complete
            self._hold_up()
            self._listener.on_request(self, self.request)

    def _enter(self, phase: Phase) -> None:
        """Begin a phase. What a touch needs of it is looked up now."""
        self.phase = phase
        self._limits = PHASES[phase]
        self._is_websocket = phase in (Phase.BEFORE_HELLO, Phase.OPEN)

    def _hold_up(self) -> None:
        """Read nothing more until the next phase begins."""
        self._is_held_up = True
        self._update_reading()

    def _go_on(self) -> None:
        """Begin the next phase with the bytes of it that are here already."""
        self._is_held_up = False
        data, self._next_phase_bytes = self._next_phase_bytes, b""
        if data:
            self._receive(data, time.monotonic())
        self._update_reading()

    def _update_reading(self) -> None:
        if self._is_held_up or self._is_full:
            self.transport.pause_reading()
        elif not self.transport.is_closing():
            self.transport.resume_reading()

    def _parse_hello(self, data: bytes, most: int, now: float) -> None:
        """Take frames until one of them completes a message; keep what follows for later.

        Before that at most `most` bytes may come.
        """
        while data and self.state is State.OPEN and not (self._inbox or self._has_ended):
            frame, data = self._boundaries.split(data)
            self._hello_bytes += len(frame)
            if self._hello_bytes > most:
                self.close(CloseCode.MESSAGE_TOO_BIG, f"more than {most} bytes before hello")
                return
            self._parse(frame, now)
        if self._inbox and not self._has_ended:
            self._next_phase_bytes = data
            self._hold_up()

    def _parse(self, data: bytes, now: float) -> None:
        self.protocol.receive_data(data)
        for event in self.protocol.events_received():
            self._take(cast("Frame", event), now)
        if self.protocol.state is State.OPEN:
            self._boundaries.follow(data)
        else:
            self._has_ended = True

    def _take(self, frame: Frame, now: float) -> None:
        """Spend the budget of a frame and keep the message that it completes."""
        if frame.opcode is Opcode.CLOSE:
            return
        excess = self.budget.excess(self._limits.frames, now, is_control=frame.opcode in CONTROL)
        if excess is not None:
            self.refuse(excess)
        elif frame.opcode not in CONTROL:
            self._join(frame)

    def _join(self, frame: Frame) -> None:
        try:
            message = self._assembler.add(frame)
        except UnicodeDecodeError as error:
            self.close(CloseCode.INVALID_DATA, f"{error.reason} at {error.start}")
        else:
            if message is not None:
                self._put(message)

    def _put(self, message: bytes | str) -> None:
        self._inbox.append(message)
        self._inbox_bytes += len(message)
        if len(self._inbox) > MAX_QUEUED and not self._is_full:
            self._is_full = True
            self._update_reading()

    def _next(self) -> bytes | str:
        message = self._inbox.popleft()
        self._inbox_bytes -= len(message)
        if self._is_full and len(self._inbox) <= 1:
            self._is_full = False
            self._update_reading()
        if self._held:
            self._report_held()
        return message

    def _report_held(self) -> None:
        """Tell the limiter how many bytes of unfinished or waiting input are kept here."""
        held = (
            self._inbox_bytes
            + self._boundaries.held
            + self._assembler.held
            + self._reader.held
            + len(self._next_phase_bytes)
        )
        if held != self._held and self.phase is not Phase.CLOSED:
            self._held = held
            self._listener.limiter.hold(self, held)

    # One message a turn.

    def _schedule(self) -> None:
        """Schedule `_take_turn` on the event loop."""
        if not self._is_turn_due:
            self._is_turn_due = True
            self._loop.call_soon(self._take_turn)

    def _take_deferred_turn(self) -> None:
        if self._is_deferred:
            self._take_turn()

    def _take_turn(self) -> None:
        """Carry out the next message, unless its client does not read its answers."""
        self._is_turn_due = False
        self._is_deferred = False
        if self._on_message is None:
            self._wake()
            return
        may_process = self.is_writable or self._has_ended
        if self._inbox and may_process:
            try:
                self._on_message(self._next())
            except Exception as error:  # noqa: BLE001 - raised by `run`, to the server
                self._error = error
                self.close(CloseCode.INTERNAL_ERROR)
        if self._inbox and may_process:
            self._schedule()
        elif not self._inbox and self._has_ended and self._on_closed is not None:
            on_closed = self._on_closed
            self._on_closed = None  # both hold this socket
            self._on_message = None
            on_closed()
            self._wake()

    def _write_posted(self) -> None:
        self._is_post_due = False
        while self.is_writable and (data := self._next_posted()) is not None:
            self.write(data)

    # The end.

    def _discard_input(self) -> None:
        """Forget all input, since closing has begun; `run` is notified in the next turn."""
        self._inbox.clear()
        self._inbox_bytes = 0
        self.flush()
        self._end_input()
        self._schedule()

    def _end_input(self) -> None:
        """Begin to close: keep messages that are complete, and throw away whatever else comes."""
        if self.phase in (Phase.CLOSING, Phase.CLOSED):
            return
        self._enter(Phase.CLOSING)
        self._has_ended = True
        self._next_phase_bytes = b""
        self._reader = RequestReader(0)
        self._short = _DISCARDED
        self._boundaries = FrameBoundaries()
        self._assembler = FragmentAssembler()
        self._report_held()
        # Reading goes on, to notice the client's end: an end of ours with bytes unread would be a
        # reset, which can overtake the close frame.
        self._is_held_up = self._is_full = False
        self._update_reading()
        self._expire(self._limits.seconds)

    def _expire(self, seconds: float | None) -> None:
        """Cut the connection off after so many seconds; None: never."""
        if self._deadline is not None:
            self._deadline.cancel()
        self._deadline = None
        if seconds is not None:
            self._deadline = self._loop.call_later(seconds, self.transport.abort)

    def _break_cycles(self) -> None:
        """Break the reference cycles through this socket, so that it is freed at once.

        Python collects cycles seldom here (`commands/run_service.py`), and a socket that was cut
        off in the middle of a message holds up to all of it.
        """
        self._next_posted = _nothing
        protocol = self.protocol
        protocol.parser.close()  # a generator of the protocol, which holds it
        # An exception holds the stack frames it came through, and these hold the protocol.
        protocol.parser_exc = None
        protocol.handshake_exc = None

    def _wake(self) -> None:
        """Wake those who wait for a message, for room to write, or for the end."""
        self._wakeup.set()

    async def _wait(self) -> None:
        self._wakeup.clear()
        await self._wakeup.wait()


class FragmentAssembler:
    """Joins the frames of a message, and reads text as it comes.

    The order of frames and the size of messages were checked before, by websockets' protocol. Text
    that is not UTF-8 is refused with the frame that shows it, not only at the message's end. Text
    above MAX_TEXT_BYTES is handed over, cut, with the frame that passes the limit, for the server
    to refuse it in words; what follows of it is dropped.
    """

    def __init__(self) -> None:
        self.held = 0  # bytes of an unfinished message that are kept
        self._parts = bytearray()
        self._decoder: codecs.IncrementalDecoder | None = None  # of text; None: bytes
        self._is_dropped = False  # the rest of a text that is too long

    def add(self, frame: Frame) -> bytes | str | None:
        """Return the message that this frame completes, or None. Raises UnicodeDecodeError."""
        if frame.opcode is Opcode.TEXT:
            self._decoder = codecs.getincrementaldecoder("utf-8")()
        if self._is_dropped:
            self._is_dropped = not frame.fin
            return None
        if self._decoder is None:
            return self._add_bytes(frame)
        self._keep(frame)
        if self.held > MAX_TEXT_BYTES:
            self._is_dropped = not frame.fin
            # A character that the cut splits is left out.
            return self._taken()[: MAX_TEXT_BYTES + _UTF8_BYTES].decode(errors="ignore")
        # Bytes are kept, and the decoder only looks at them: decoded text can be four times as
        # long, and a message may wait for its last fragment.
        self._decoder.decode(bytes(frame.data), frame.fin)
        return self._taken().decode() if frame.fin else None

    def _add_bytes(self, frame: Frame) -> bytes | None:
        if frame.fin and not self.held:
            return bytes(frame.data)
        self._keep(frame)
        return self._taken() if frame.fin else None

    def _keep(self, frame: Frame) -> None:
        self._parts += frame.data
        self.held = len(self._parts)

    def _taken(self) -> bytes:
        message = bytes(self._parts)
        self._parts = bytearray()
        self.held = 0
        self._decoder = None
        return message


class FrameBoundaries:
    """Follows the frames of one stream by their headers (RFC 6455, section 5.2).

    A picture of 40 KB arrives in many pieces. With the length of its frame known, its rest can be
    read at once, while a flood of short frames is still read in small pieces.
    """

    def __init__(self) -> None:
        self.missing = 0  # bytes of the frame under way, once its header is complete
        self.held = 0  # bytes of that frame that have come
        self._size = 0  # of that frame, header included
        self._header = b""  # a header that was cut off

    def follow(self, data: bytes) -> None:
        """Take the next bytes of the stream."""
        if self._header:
            data = self._header + data
            self._header = b""
        size = len(data)
        at = self.missing
        while at < size:
            length = _frame_bytes(data, at)
            if length is None:
                self._header = data[at:]
                at = size
                break
            self._size = length
            at += length
        self.missing = at - size
        self.held = self._size - self.missing if self.missing else len(self._header)

    def split(self, data: bytes) -> tuple[bytes, bytes]:
        """Return the next bytes up to the end of their first frame, and those behind it."""
        end: int | None = self.missing
        if not end:
            end = _frame_bytes(self._header + data, 0)
            end = None if end is None else end - len(self._header)
        return (data, b"") if end is None else (data[:end], data[end:])


def _frame_bytes(data: bytes, at: int) -> int | None:
    """Return the length of the frame that begins there, header included; None: header cut off."""
    if len(data) < at + 2:
        return None
    masks = _MASK_BYTES if data[at + 1] & 0x80 else 0
    short = data[at + 1] & 0x7F
    if short < _TWO_BYTES:
        return 2 + masks + short
    width = 2 if short == _TWO_BYTES else 8
    if len(data) < at + 2 + width:
        return None
    return 2 + width + masks + int.from_bytes(data[at + 2 : at + 2 + width], "big")


def _head(response: Response) -> bytes:
    """Return status line and headers of an answer."""
    return Response(response.status_code, response.reason_phrase, response.headers).serialize()


def _read_piece(path: Path, start: int, count: int) -> bytes:
    with path.open("rb") as file:
        file.seek(start)
        return file.read(count)


def _nothing() -> None:
    """Return None: no source of posted messages has been set."""
