"""The edge over real sockets, without a gateway: order, turns, long frames, slow readers, ends."""

import asyncio
import socket
import time
import weakref
from collections import Counter

import pytest
from collecting import no_collection
from edge_service import Service, listening, until
from hypothesis import given
from hypothesis import strategies as st
from websockets.asyncio.client import connect
from websockets.exceptions import ConnectionClosed
from websockets.frames import Frame, Opcode
from websockets.protocol import State

from hapticvlm.server.edge.limiter import SocketLimiter
from hapticvlm.server.edge.socket import ClientSocket, FrameBoundaries

READ_BYTES = 2048
WRITE_BYTES = 32_768

SIZES = st.lists(st.sampled_from([0, 1, 125, 126, 127, 3000, 65_535, 65_536, 70_000]), max_size=6)


def frames(*messages):
    return b"".join(Frame(Opcode.BINARY, each).serialize(mask=True) for each in messages)


@given(SIZES, st.lists(st.integers(1, 50_000), max_size=8))
def test_what_a_frame_lacks_is_known_wherever_the_stream_is_cut(sizes, cuts):
    stream = frames(*(bytes(size) for size in sizes))
    ends = [0]
    for size in sizes:
        ends.append(ends[-1] + len(frames(bytes(size))))
    lengths, at = FrameBoundaries(), 0
    for cut in [*cuts, len(stream)]:
        lengths.follow(stream[at : at + cut])
        at = min(at + cut, len(stream))
        end = next(each for each in ends if each >= at)
        assert lengths.missing in (0, end - at)
        begun = max(each for each in ends if each <= at)
        if at - begun >= 14:  # the longest header
            assert lengths.missing == end - at


async def test_messages_of_one_read_are_taken_in_order_and_one_a_turn():
    service = Service()
    async with listening(service) as port, connect(f"ws://127.0.0.1:{port}") as client:
        wanted = [bytes([number]) for number in range(20)]
        client.transport.write(frames(*wanted))
        await until(lambda: len(service.said) == 20)
    assert service.said == wanted
    assert len(set(service.turns)) == 20


@pytest.fixture
def reads(monkeypatch):
    """Keep in which turn of the loop each read was."""

    def note(service):
        found: list[int] = []
        take = ClientSocket.buffer_updated

        def take_and_note(self, count):
            found.append(service.turn)
            take(self, count)

        monkeypatch.setattr(ClientSocket, "buffer_updated", take_and_note)
        return found

    return note


async def test_a_touch_is_carried_out_in_the_read_that_brought_it_and_a_picture_in_a_later_turn(
    reads,
):
    # A picture's message is long to parse and long to carry out: a touch of another socket that has
    # come meanwhile goes between.
    service, turns_later = Service(), []
    async with listening(service) as port, connect(f"ws://127.0.0.1:{port}") as client:
        read_in = reads(service)
        for number, message in enumerate((b"touch", bytes(20_000)), start=1):
            await client.send(message)
            await until(lambda number=number: len(service.said) == number)
            turns_later.append(service.turns[-1] - read_in[-1])
    assert turns_later == [0, 2]


async def test_a_touch_behind_a_picture_of_its_own_socket_waits_one_turn(reads):
    service = Service()
    async with listening(service) as port, connect(f"ws://127.0.0.1:{port}") as client:
        read_in = reads(service)
        for number in range(1, 11):
            client.transport.write(frames(bytes(20_000), b"touch"))
            await until(lambda number=number: len(service.said) == 2 * number)
            assert service.said[-2:] == [bytes(20_000), b"touch"]
            assert service.turns[-1] - read_in[-1] <= 1


@pytest.mark.realtime
async def test_no_answer_waits_until_the_one_before_it_was_acknowledged():
    # A client acknowledges an answer 40 ms late where it has nothing to send with it. An edge that
    # gathers small answers until then delays every second of these by so much.
    service = Service(answer=lambda data: data)
    async with listening(service) as port, connect(f"ws://127.0.0.1:{port}") as client:
        began = time.monotonic()
        for _ in range(50):
            client.transport.write(frames(b"one", b"two"))
            assert [await client.recv(), await client.recv()] == [b"one", b"two"]
        took_s = time.monotonic() - began
    assert took_s < 50 * 0.02


async def test_a_flood_in_one_read_takes_no_second_turn_before_another_client_had_its_first():
    service = Service()
    async with (
        listening(service) as port,
        connect(f"ws://127.0.0.1:{port}") as hostile,
        connect(f"ws://127.0.0.1:{port}") as honest,
    ):
        hostile.transport.write(frames(*[b"flood"] * 300))
        honest.transport.write(frames(b"touch"))
        await until(lambda: len(service.said) == 301)
    assert service.said.index(b"touch") < 10


async def test_a_long_frame_is_read_at_once_and_short_ones_in_small_pieces(monkeypatch):
    service = Service()
    async with listening(service) as port, connect(f"ws://127.0.0.1:{port}") as client:
        await until(lambda: service.sockets)
        (edge,) = service.sockets
        reads: list[int] = []
        buffer = edge.get_buffer

        def get_buffer(hint):
            given = buffer(hint)
            reads.append(len(given))
            return given

        monkeypatch.setattr(edge, "get_buffer", get_buffer)
        await client.send(bytes(40_000))
        await until(lambda: service.said)
        assert reads[0] == READ_BYTES
        assert reads[1] == 40_008 - READ_BYTES
        reads.clear()
        await client.send(bytes(2_000_000))
        await until(lambda: len(service.said) == 2)
        assert max(reads) == 256 * 1024
        reads.clear()
        client.transport.write(frames(*[b"short"] * 2000))
        await until(lambda: len(service.said) == 2002)
        assert set(reads) == {READ_BYTES}


async def test_a_client_that_reads_nothing_stops_its_own_messages_and_loses_none():
    service = Service(lambda _: bytes(WRITE_BYTES))
    async with listening(service) as port, connect(f"ws://127.0.0.1:{port}", max_queue=1) as client:
        for number in range(200):
            await client.send(str(number).encode())
        (edge,) = service.sockets
        await until(lambda: not edge.is_writable)
        assert len(service.said) < 200
        assert edge.transport.get_write_buffer_size() <= 3 * WRITE_BYTES
        for _ in range(200):
            assert len(await client.recv()) == WRITE_BYTES
        assert len(service.said) == 200
        assert len(edge._inbox) <= 4 + READ_BYTES // 6


async def test_what_is_left_is_forgotten_before_its_close_is_answered():
    service = Service()
    async with listening(service) as port, connect(f"ws://127.0.0.1:{port}") as client:
        client.transport.write(frames(b"one", b"two", b"three"))
        await client.close()
        assert service.said == [b"one", b"two", b"three"]
        assert service.log == ["left"]


class Ending(Service):
    """Says when a socket is served no longer."""

    async def serve(self, edge):
        await super().serve(edge)
        self.log.append("ended")


async def test_a_client_that_vanishes_has_what_it_sent_carried_out_and_leaves_once():
    # It does not read, so that its messages still wait when it goes.
    service = Ending(lambda _: bytes(100 * WRITE_BYTES))
    sent = [b"stop", *[b"and more"] * 5]
    async with listening(service) as port, connect(f"ws://127.0.0.1:{port}") as client:
        client.transport.pause_reading()
        client.transport.write(frames(*sent))
        await until(lambda: service.said and not service.sockets[0].is_writable)
        assert len(service.said) < len(sent) - 1
        client.transport.abort()
        await until(lambda: len(service.log) == 2)
    assert service.said == sent
    assert service.log == ["left", "ended"]


async def test_a_bug_closes_the_connection_with_1011_and_no_other(caplog):
    def stumble(data):
        return {b"bug": None}[data] or 1 / 0

    service = Service(stumble)
    async with (
        listening(service) as port,
        connect(f"ws://127.0.0.1:{port}") as client,
        connect(f"ws://127.0.0.1:{port}") as other,
    ):
        await client.send(b"bug")
        with pytest.raises(ConnectionClosed):
            await client.recv()
        assert client.close_code == 1011
        await other.ping()
        assert service.log == ["left"]
    assert "ZeroDivisionError" in caplog.text


async def test_a_close_of_ours_tells_the_server_and_a_silent_client_is_cut_off():
    service = Service()
    async with listening(service) as port, connect(f"ws://127.0.0.1:{port}") as client:
        await until(lambda: service.sockets)
        client.transport.pause_reading()
        service.sockets[0].close(4001, "ended")
        await until(lambda: service.log)
        await until(lambda: service.sockets[0].state is State.CLOSED)
        client.transport.abort()


class Counting(SocketLimiter[ClientSocket]):
    """Counts the sockets that open in each turn of the loop."""

    def __init__(self, service):
        super().__init__(Counter())
        self.opened_in: Counter[int] = Counter()
        self._service = service

    def add(self, socket, now):
        self.opened_in[self._service.turn] += 1
        super().add(socket, now)


async def test_of_many_that_connect_at_once_one_is_taken_a_turn():
    service = Service()
    limiter = Counting(service)
    async with listening(service, limiter) as port:
        made = [socket.create_connection(("127.0.0.1", port)) for _ in range(60)]
        await until(lambda: limiter.opened_in.total() == 60)
        for each in made:
            each.close()
    assert max(limiter.opened_in.values()) <= 2


class Forgetful(Service):
    """Keeps nothing, not even the socket."""

    async def serve(self, edge):
        edge.mark_admitted()
        await edge.run(lambda data: edge.write(data), lambda: None)


class Watched(SocketLimiter[ClientSocket]):
    """Knows the sockets that came in, and what holds their messages, without keeping them."""

    def __init__(self):
        super().__init__(Counter())
        self.came = []

    def add(self, socket, now):
        self.came += [weakref.ref(socket), weakref.ref(socket.protocol)]
        super().add(socket, now)


async def closes(port):
    async with connect(f"ws://127.0.0.1:{port}/", compression=None, proxy=None) as client:
        await client.send(b"hello")


async def is_cut_off_in_a_message(port):
    async with connect(f"ws://127.0.0.1:{port}/", compression=None, proxy=None) as client:
        client.transport.write(frames(bytes(1_000_000))[:500_000])
        await asyncio.sleep(0.1)
        client.transport.abort()
        await client.wait_closed()


async def breaks_the_protocol(port):
    async with connect(f"ws://127.0.0.1:{port}/", compression=None, proxy=None) as client:
        client.transport.write(b"\xff" * 100)
        await client.wait_closed()


async def says_nothing(port):
    _, writer = await asyncio.open_connection("127.0.0.1", port)
    writer.close()
    await writer.wait_closed()


async def sends_no_request(port):
    reader, writer = await asyncio.open_connection("127.0.0.1", port)
    writer.write(b"no request\r\n\r\n")
    await reader.read()
    writer.close()
    await writer.wait_closed()


@pytest.mark.parametrize(
    "comes_and_goes",
    [closes, is_cut_off_in_a_message, breaks_the_protocol, says_nothing, sends_no_request],
)
async def test_a_socket_that_has_ended_is_gone_without_a_collection_of_cycles(comes_and_goes):
    limiter = Watched()
    with no_collection():
        async with listening(Forgetful(), limiter) as port:
            await comes_and_goes(port)
            await until(lambda: limiter.came and not any(each() for each in limiter.came))
