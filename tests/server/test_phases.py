"""The phases of a connection: to which one bytes belong, and the whole budget of each."""

import asyncio
import contextlib
import os
import random
import socket
import struct
from collections import Counter
from contextlib import asynccontextmanager
from dataclasses import replace
from types import SimpleNamespace
from typing import Any, cast

import pytest
from asked import asked
from certificates import Authority
from edge_service import Service, listening, open_websocket, until
from gateways import Peer, join, new_gateway
from pace import PACE
from raw_frames import BINARY, KEY, PING, PONG, TEXT, closing, frame
from websockets.asyncio.server import serve
from websockets.datastructures import Headers
from websockets.exceptions import ConnectionClosed
from websockets.http11 import Response
from websockets.protocol import State

from hapticvlm.server.counters import Count
from hapticvlm.server.edge import limits
from hapticvlm.server.edge.limiter import SocketLimiter
from hapticvlm.server.edge.limits import PHASES, Phase
from hapticvlm.server.edge.listener import Listener
from hapticvlm.server.edge.socket import ClientSocket, FileResponse
from hapticvlm.server.web import certificate
from hapticvlm.server.web.http import response
from hapticvlm.server.websocket import StopOnlySlots

HELLO_FRAMES = 4
MAX_HELLO_BYTES = 16 * 1024
MAX_TEXT_BYTES = 1024 * 1024
READ_BYTES = 2048


class Waiting(Service):
    """Takes the first message and admits nobody, until it is let."""

    def __init__(self):
        super().__init__(lambda data: data)
        self.first: list[bytes | str] = []
        self.may_admit = asyncio.Event()

    async def serve(self, edge):
        self.sockets.append(edge)
        self.first.append(await edge.recv())
        await self.may_admit.wait()
        await super().serve(edge)


@asynccontextmanager
async def raw(port):
    reader, writer = await asyncio.open_connection("127.0.0.1", port)
    try:
        yield reader, writer
    finally:
        writer.close()


async def opened(reader):
    async with asyncio.timeout(5.0 * PACE):
        head = await reader.readuntil(b"\r\n\r\n")
    assert b" 101 " in head


async def rest_of(reader):
    """What comes until the end."""
    data = b""
    with contextlib.suppress(ConnectionResetError):
        async with asyncio.timeout(10.0 * PACE):
            while piece := await reader.read(65_536):
                data += piece
    return data


def frames_of(data):
    """The frames of an answer: opcode and payload."""
    found = []
    while data:
        size, at = data[1], 2
        if size >= 126:
            at += 2 if size == 126 else 8
            size = int.from_bytes(data[2:at], "big")
        found.append((data[0] & 15, data[at : at + size]))
        data = data[at + size :]
    return found


def close_code(data):
    """The code of the close frame at the end; None: there is none."""
    opcode, payload = frames_of(data)[-1] if data else (0, b"")
    return int.from_bytes(payload[:2] or b"\x03\xed", "big") if opcode == 8 else None


async def test_frames_that_the_end_of_the_request_cuts_leave_every_later_read_short(monkeypatch):
    # The first byte of a ping comes with the request. A follower of frames that begins behind it
    # takes the rest for a frame of 2^63 bytes, and all that comes then is read at once.
    service = Service()
    reads: list[int] = []
    get_buffer = ClientSocket.get_buffer

    def note(self, hint):
        buffer = get_buffer(self, hint)
        if self.phase is not Phase.CLOSING:
            reads.append(len(buffer))
        return buffer

    monkeypatch.setattr(ClientSocket, "get_buffer", note)
    async with listening(service) as port, raw(port) as (reader, writer):
        writer.write(KEY + b"\x89")
        await opened(reader)
        writer.write(b"\x85" + b"\xff\x7f\xff\xff" + b"\xff" * 5)
        writer.write(frame(BINARY, b"touch") * 5_000)
        await until(lambda: len(service.said) > 1_000)
    assert set(service.said) == {b"touch"}
    assert max(reads) == READ_BYTES


async def test_bytes_behind_the_request_are_the_next_phases_and_count_there():
    service = Service(lambda data: data)
    async with listening(service) as port, raw(port) as (reader, writer):
        writer.write(KEY + frame(TEXT, b"hello") + frame(TEXT, b"touch"))
        await opened(reader)
        await until(lambda: service.said == ["hello", "touch"])
    async with listening(service) as port, raw(port) as (reader, writer):
        writer.write(KEY + frame(PING) * (HELLO_FRAMES + 1))
        await opened(reader)
        assert close_code(await rest_of(reader)) == 1008


async def test_nothing_is_read_while_the_request_is_answered():
    may_answer = asyncio.Event()
    counts: Counter[Count] = Counter()
    limiter: SocketLimiter[ClientSocket] = SocketLimiter(counts)

    async def answer(*_):
        await may_answer.wait()

    service = Service()
    async with listening(service, limiter, answer) as port, raw(port) as (reader, writer):
        writer.write(KEY + frame(BINARY, bytes(16)) * 300_000)  # 6 MB
        await until(lambda: limiter.sockets and limiter.sockets[0].request is not None)
        await asyncio.sleep(0.1)
        assert limiter.sockets[0]._held <= READ_BYTES
        may_answer.set()
        await opened(reader)
        await until(lambda: len(service.said) > 100)


async def test_what_follows_a_hello_waits_until_the_client_is_admitted():
    # A client may send its scene with its hello. Before it is admitted that would be too long.
    service = Waiting()
    scene = frame(BINARY, bytes(100_000))
    async with listening(service) as port, raw(port) as (_, writer):
        writer.write(KEY + frame(BINARY, b"hello") + scene + frame(BINARY, b"touch") * 10)
        await until(lambda: service.first == [b"hello"])
        await asyncio.sleep(0.05)
        assert service.said == []
        service.may_admit.set()
        await until(lambda: len(service.said) == 11)
    assert service.said == [bytes(100_000), *[b"touch"] * 10]


def message_of(size):
    return frame(BINARY, bytes(size))


BEFORE_HELLO_EXCESS = {
    "frames": (frame(PING) * (HELLO_FRAMES + 1), 1008),
    "bytes of one frame": (message_of(MAX_HELLO_BYTES + 1_000), 1009),
    "bytes of fragments": (
        frame(BINARY, bytes(6000), fin=False) + frame(0, bytes(6000), fin=False) * 2,
        1009,
    ),
    "a claimed length": (b"\x82\xff" + struct.pack(">Q", 2**62) + bytes(20_000), 1009),
}


@pytest.mark.parametrize("excess", BEFORE_HELLO_EXCESS)
async def test_before_hello_each_budget_ends_the_connection(excess):
    data, code = BEFORE_HELLO_EXCESS[excess]
    async with listening(Waiting()) as port, raw(port) as (reader, writer):
        writer.write(KEY)
        await opened(reader)
        writer.write(data)
        assert close_code(await rest_of(reader)) == code


async def test_a_hello_as_long_as_is_allowed_comes_through():
    service = Waiting()
    async with listening(service) as port, raw(port) as (reader, writer):
        writer.write(KEY)
        await opened(reader)
        writer.write(frame(PING, b"p" * 125) * (HELLO_FRAMES - 1) + message_of(MAX_HELLO_BYTES))
        await until(lambda: service.first == [bytes(MAX_HELLO_BYTES)])


@pytest.mark.parametrize("phase", [Phase.ASKING, Phase.CLOSING])
async def test_a_socket_that_says_nothing_is_cut_off(phase, monkeypatch):
    monkeypatch.setitem(PHASES, phase, replace(PHASES[phase], seconds=0.1))
    service = Service()
    async with listening(service) as port, raw(port) as (reader, writer):
        if phase is Phase.CLOSING:
            writer.write(KEY)
            await opened(reader)
            service.sockets[0].close()
            await until(lambda: service.sockets[0].phase is Phase.CLOSED)
        else:
            assert await rest_of(reader) == b""


async def test_who_was_cut_off_before_its_answer_came_is_not_served(monkeypatch):
    monkeypatch.setitem(PHASES, Phase.ASKING, replace(PHASES[Phase.ASKING], seconds=0.1))
    may_answer = asyncio.Event()
    service = Service()

    async def answer(*_):
        await may_answer.wait()

    async with listening(service, answer=answer) as port, raw(port) as (reader, writer):
        writer.write(KEY)
        assert await rest_of(reader) == b""
        may_answer.set()
        await until(lambda: not answering())
    assert service.sockets == []


async def test_a_request_that_is_too_long_is_refused_before_it_ends():
    async with listening(Service()) as port, raw(port) as (reader, writer):
        writer.write(KEY[:-2] + b"a: " + b"b" * (32 * 1024))
        assert b" 431 " in await rest_of(reader)


async def test_while_a_connection_closes_nothing_more_is_carried_out():
    service = Service()
    async with listening(service) as port, raw(port) as (reader, writer):
        writer.write(KEY + frame(BINARY, b"one"))
        await opened(reader)
        await until(lambda: service.said == [b"one"])
        service.sockets[0].close(4001, "ended")
        writer.write(frame(BINARY, b"two") * 3_000 + b"\xff" * 10_000)
        assert close_code(await rest_of(reader)) == 4001
        await until(lambda: service.log == ["left"])
    assert service.said == [b"one"]
    assert service.sockets[0]._held == 0


async def test_a_client_that_goes_on_sending_while_it_is_closed_gets_few_turns(monkeypatch):
    service = Service()
    reads = Counter[Phase]()
    updated = ClientSocket.buffer_updated

    def note(self, count):
        reads[self.phase] += 1
        updated(self, count)

    monkeypatch.setattr(ClientSocket, "buffer_updated", note)
    async with listening(service) as port, raw(port) as (reader, writer):
        writer.write(KEY + frame(BINARY, b"one"))
        await opened(reader)
        await until(lambda: service.said == [b"one"])
        service.sockets[0].close(4001, "ended")
        with contextlib.suppress(OSError):
            while service.sockets[0].phase is not Phase.CLOSED:
                writer.write(b"\xff" * READ_BYTES)
                await writer.drain()
                await asyncio.sleep(0)
    assert reads[Phase.CLOSING] <= 1.0 / 0.01 + 2


async def test_messages_that_wait_when_a_client_is_refused_are_not_carried_out():
    service = Service()
    async with listening(service) as port, raw(port) as (reader, writer):
        writer.write(KEY + frame(BINARY, b"first"))
        await opened(reader)
        await until(lambda: service.said == [b"first"])
        # One read: a ping too many, with messages before it that have had no turn yet.
        service.sockets[0].budget._control = limits.TokenBucket(limits.Rate(0.0, 0.0), 0.0)
        writer.write(frame(BINARY, b"touch") * 20 + frame(PING) + frame(BINARY, b"behind"))
        assert close_code(await rest_of(reader)) == 1008
        await until(lambda: service.log == ["left"])
    assert service.said == [b"first"]


async def test_text_above_its_limit_is_handed_over_at_the_fragment_that_passes_it():
    service = Service(lambda data: b"refused" if isinstance(data, str) else data)
    piece = "\N{GRINNING FACE}".encode() * 50_000  # four bytes each
    async with listening(service) as port, raw(port) as (_, writer):
        writer.write(KEY + frame(BINARY, b"hello"))
        await until(lambda: service.said)
        writer.write(frame(TEXT, piece, fin=False))
        for _ in range(5):
            writer.write(frame(0, piece, fin=False))
        await until(lambda: len(service.said) == 2)
        too_long = service.said[1]
        assert isinstance(too_long, str)
        assert MAX_TEXT_BYTES < len(too_long.encode()) <= MAX_TEXT_BYTES + 4
        await until(lambda: service.sockets[0]._held == 0)
        writer.write(frame(0, piece, fin=False) + frame(0, b"end") + frame(BINARY, b"next"))
        await until(lambda: len(service.said) == 3)
    assert service.said[2] == b"next"


async def test_all_sockets_together_hold_so_much_and_the_largest_goes(monkeypatch):
    monkeypatch.setattr("hapticvlm.server.edge.limiter.HELD_BYTES", 1_000_000)
    counts: Counter[Count] = Counter()
    service = Service()
    limiter: SocketLimiter[ClientSocket] = SocketLimiter(counts)
    async with contextlib.AsyncExitStack() as stack:
        port = await stack.enter_async_context(listening(service, limiter))
        peers = []
        for size in (300_000, 500_000, 250_000):
            reader, writer = await stack.enter_async_context(raw(port))
            writer.write(KEY + frame(BINARY, b"hello"))
            await opened(reader)
            writer.write(frame(BINARY, bytes(2_000_000))[:size])
            peers.append(reader)
            number = len(peers)
            await until(lambda number=number: len(service.said) == number)
            await until(lambda: counts or len(limiter._held) == len(service.said))
        assert close_code(await rest_of(peers[1])) == 1008
        assert counts == {Count.CLOSED_HELD_BYTES: 1}
        assert limiter._held_bytes < 1_000_000
    await until(lambda: not limiter._held)


async def test_a_connection_that_is_reset_in_a_message_holds_nothing_any_more():
    service = Service()
    limiter: SocketLimiter[ClientSocket] = SocketLimiter(Counter())
    async with listening(service, limiter) as port, raw(port) as (reader, writer):
        writer.write(KEY + frame(BINARY, b"hello"))
        await opened(reader)
        writer.write(message_of(500_000)[:300_000])
        await until(lambda: limiter._held_bytes > 200_000)
        reset = struct.pack("ii", 1, 0)
        writer.get_extra_info("socket").setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, reset)
        writer.transport.abort()
        await until(lambda: not limiter.sockets)
    assert limiter._held_bytes == 0


def random_stream(draw):
    """Frames of every kind, right and wrong, and then a close."""
    stream = b""
    for _ in range(draw.randint(1, 8)):
        opcode = draw.choice((0, 1, 1, 2, 2, 8, 9, 10, 3, 11))
        size = draw.choice(
            (0, 1, 5, 125, 126, 127, 2000, *((70_000, 300_000) if opcode < 8 else ()))
        )
        payload = draw.choice((b"a" * size, ("\N{EURO SIGN}" * size).encode()[:size]))
        if opcode == 8:
            payload = draw.choice((b"", b"\x03", b"\x03\xe8", b"\x03\xe8bye", b"\x13\x88"))
        stream += frame(opcode, payload, fin=draw.random() < 0.8, reserved=draw.random() < 0.05)
    return stream + closing(1000)


def frames_among(answer, *opcodes):
    return [frame for frame in frames_of(answer) if frame[0] in opcodes]


async def say(port, request, stream, cuts):
    """Send a request and frames cut there; return the answering frames."""
    async with raw(port) as (reader, writer):
        data = request + stream
        begin = 0
        with contextlib.suppress(ConnectionResetError):
            for at in [*cuts, len(data)]:
                writer.write(data[begin:at])
                await writer.drain()
                await asyncio.sleep(0)
                begin = at
        answer = await rest_of(reader)
    return answer.partition(b"\r\n\r\n")[2]


async def echo(connection):
    with contextlib.suppress(ConnectionClosed):
        async for message in connection:
            await connection.send(message)


async def test_streams_mean_the_same_as_to_websockets_own_server_wherever_they_are_cut():
    offenders = []
    async with serve(
        echo, "127.0.0.1", 0, compression=None, max_size=2**22, ping_interval=None
    ) as theirs:
        their_port = next(iter(theirs.sockets)).getsockname()[1]
        for seed in range(700):
            # Also cut into the request: its last bytes then come with the first frames.
            draw = random.Random(seed)
            stream = random_stream(draw)
            near = range(len(KEY) - 3, len(KEY) + 4)
            cuts = sorted({draw.choice(near), *draw.sample(range(len(KEY + stream)), 3)})
            ours = Service(lambda data: data)
            async with listening(ours) as port:
                answers = [await say(each, KEY, stream, cuts) for each in (port, their_port)]
            if not is_alike(ours.said, *answers):
                offenders.append((seed, cuts, ours.said, *answers))
    assert offenders == []


def is_alike(said, answer, their_answer):
    """Whether one stream had the same meaning to both servers."""
    code, their_code = close_code(answer), close_code(their_answer)
    # Which of two faults in one read is named may differ: bad UTF-8 or a bad frame behind it. Their
    # end of a connection with bytes unread is a reset, which can overtake their close frame.
    if code is None:
        return False
    if their_code not in (code, None) and not {code, their_code} <= {1000, 1002, 1005, 1007}:
        return False
    # Messages that came before a fault may be carried out or not, and none is different.
    ours = [each.encode() if isinstance(each, str) else each for each in said]
    theirs = frames_among(their_answer, TEXT, BINARY)
    echoes = zip(frames_among(answer, TEXT, BINARY), theirs, strict=False)
    both = min(len(ours), len(theirs))
    is_answered = all(one == other for one, other in echoes)
    if code == their_code in (1000, 1005):
        # Of several pings in one read theirs may answer the last alone.
        pongs = frames_among(answer, PONG)
        is_answered &= all(pong in pongs for pong in frames_among(their_answer, PONG))
        both = len(theirs)
    return ours[:both] == [payload for _, payload in theirs[:both]] and is_answered


LONG = 8 * 1024 * 1024


def a_file(path, size):
    """An answer that sends a sparse file of this size."""
    with path.open("wb") as file:
        file.truncate(size)
    head = Headers([("Content-Length", str(size))])
    return FileResponse(200, "OK", head, path=path, size=size)


def always(page):
    async def answer(*_):
        return page

    return answer


@pytest.mark.parametrize(("method", "body"), [(b"GET", b"here"), (b"HEAD", b"")])
async def test_the_first_request_is_answered_once_and_head_is_the_head_of_its_answer(method, body):
    asks = method + b" / HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n"
    answer = always(response(200, "here"))
    async with listening(Service(), answer=answer) as port, raw(port) as (reader, writer):
        writer.write(asks * 2)
        head, _, rest = (await rest_of(reader)).partition(b"\r\n\r\n")
    assert rest == body
    assert {b"HTTP/1.1 200 OK", b"Content-Length: 4", b"Connection: close"} <= {*head.splitlines()}


@pytest.mark.parametrize("kind", ["page", "file"])
async def test_a_reader_that_reads_nothing_of_a_long_answer_is_cut_off(kind, monkeypatch, tmp_path):
    monkeypatch.setitem(PHASES, Phase.ASKING, replace(PHASES[Phase.ASKING], seconds=0.2))
    page = a_file(tmp_path / "program.wasm", LONG)
    if kind == "page":
        page = Response(200, "OK", page.headers, bytes(LONG))
    limiter: SocketLimiter[ClientSocket] = SocketLimiter(Counter())
    async with listening(Service(), limiter, always(page)) as port:
        silent = socket.create_connection(("127.0.0.1", port))
        silent.sendall(KEY)
        await until(lambda: limiter.sockets)
        await until(lambda: not limiter.sockets)
        silent.close()


def answering():
    """The tasks that answer a request or serve its socket."""
    return [task for task in asyncio.all_tasks() if "_open" in repr(task.get_coro())]


async def test_a_file_is_read_no_further_when_its_reader_has_gone(tmp_path):
    answer = always(a_file(tmp_path / "build.data", 64 * 1024**3))  # to read it takes a minute
    async with listening(Service(), answer=answer) as port, raw(port) as (reader, writer):
        writer.write(KEY)
        await reader.readexactly(1_000_000)
        writer.transport.abort()
        await until(lambda: not answering())


@pytest.mark.parametrize("change", ["cut", "deleted"])
async def test_a_file_that_changes_while_it_is_sent_ends_the_connection(change, tmp_path, caplog):
    file = tmp_path / "program.wasm"
    answer = always(a_file(file, LONG))
    async with listening(Service(), answer=answer) as port, raw(port) as (reader, writer):
        writer.write(KEY)
        await reader.readexactly(1_000)
        if change == "cut":
            os.truncate(file, 1_000)
        else:
            file.unlink()
        assert len(await rest_of(reader)) < LONG
        await until(lambda: not answering())
    assert "has changed while it was sent" in caplog.text
    assert "Traceback" not in caplog.text


async def test_messages_behind_a_close_are_not_carried_out():
    service = Service()
    async with listening(service) as port, raw(port) as (reader, writer):
        writer.write(KEY + frame(BINARY, b"hello"))
        await opened(reader)
        await until(lambda: service.said)
        writer.write(frame(BINARY, b"touch") + closing(1000) + frame(BINARY, b"behind"))
        assert close_code(await rest_of(reader)) == 1000
        await until(lambda: service.log == ["left"])
    assert service.said == [b"hello", b"touch"]


class Stranger:
    """A socket that only has an address, and notes that it was cut off."""

    def __init__(self, address, name, aborted):
        self.remote_address = (address, 1)
        self.state = State.CONNECTING
        self.transport = SimpleNamespace(abort=lambda: aborted.append(name))


@pytest.mark.parametrize(("address", "is_spared"), [("127.0.0.1", True), ("192.0.2.1", False)])
async def test_only_a_socket_of_this_machine_that_has_asked_is_spared(address, is_spared):
    limiter: SocketLimiter[Any] = SocketLimiter(Counter(), most=1)
    never = asyncio.Event()

    async def answer(*_):
        await never.wait()

    listener = Listener(limiter, answer, Service().serve, 1000)
    aborted: list[str] = []
    first, second = (Stranger(address, name, aborted) for name in ("first", "second"))
    now = asyncio.get_running_loop().time()
    limiter.add(first, now)
    listener.on_request(cast("ClientSocket", first), asked())
    limiter.add(second, now)
    assert aborted == (["second"] if is_spared else ["first"])
    await listener._close()


@pytest.mark.needs_toolchain("openssl")
async def test_of_many_that_agree_on_no_keys_the_oldest_makes_room(tmp_path, monkeypatch):
    monkeypatch.setattr("hapticvlm.server.edge.listener.MAX_WAITING_SOCKETS", 3)
    monkeypatch.setattr("hapticvlm.server.edge.listener.REQUEST_S", 3600.0)  # none ends by itself
    pair = Authority(tmp_path).sign()
    tls = certificate.load(pair.cert, pair.key).context
    listener = Listener(SocketLimiter(Counter()), open_websocket, Service().serve, 1000)
    async with listener.listen("127.0.0.1", 0, tls) as port, contextlib.AsyncExitStack() as stack:
        silent = [await stack.enter_async_context(raw(port)) for _ in range(5)]
        for reader, _ in silent[:2]:
            assert await rest_of(reader) == b""
        assert len(listener._connecting) == 3


async def test_who_has_no_slot_may_not_stay(monkeypatch):
    monkeypatch.setattr("hapticvlm.server.websocket.STOP_S", 0.05)
    peer, gateway = Peer(), new_gateway()
    connection = join(gateway, observer=True, peer=peer)
    socket_ = cast("ClientSocket", peer)
    StopOnlySlots().make(socket_, connection, gateway, lambda: 0.0)
    await until(lambda: peer.closed == (4003, "no place"))
