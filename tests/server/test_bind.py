"""A host name with several addresses is listened on at all of them that exist, at one port."""

import asyncio
import contextlib
import errno
import socket
import sys
from collections import Counter

import pytest
from lan_address import own_address

from hapticvlm.server.counters import Count
from hapticvlm.server.edge.limiter import SocketLimiter
from hapticvlm.server.edge.limits import Rate
from hapticvlm.server.edge.listener import Listener, bind
from hapticvlm.server.web.http import response

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="only Linux has 127.0.0.2 at once")

TWO = [(socket.AF_INET, ("127.0.0.1", 0)), (socket.AF_INET, ("127.0.0.2", 0))]
FOREIGN = (socket.AF_INET, ("203.0.113.1", 0))  # for documents; no machine has it
NO_FAMILY = (12, ("127.0.0.1", 0))  # DECnet, which no system has


def has_ipv6():
    try:
        socket.create_server(("::1", 0), family=socket.AF_INET6).close()
    except OSError:
        return False
    return True


needs_ipv6 = pytest.mark.skipif(not has_ipv6(), reason="IPv6 is switched off")


@pytest.fixture
def resolve(monkeypatch):
    """Let every name resolve to these addresses; of several lists each is used once."""

    def resolve_to(*answers):
        left = list(answers)

        async def getaddrinfo(*_, **__):
            rows = left.pop(0) if len(left) > 1 else left[0]
            return [(family, socket.SOCK_STREAM, 6, "", address) for family, address in rows]

        monkeypatch.setattr(asyncio.get_running_loop(), "getaddrinfo", getaddrinfo)

    return resolve_to


async def addresses():
    sockets = await bind("name", 0)
    bound = [each.getsockname() for each in sockets]
    for each in sockets:
        each.close()
    return bound


async def test_every_address_of_a_name_has_the_port_that_the_system_chose_for_the_first(resolve):
    resolve(TWO)
    (first, port), (second, other) = await addresses()
    assert (first, second) == ("127.0.0.1", "127.0.0.2")
    assert port == other != 0


@pytest.mark.parametrize("absent", [FOREIGN, NO_FAMILY])
async def test_an_address_that_this_machine_does_not_have_is_left_out(resolve, absent):
    for rows in ([absent, TWO[0]], [TWO[0], absent]):
        resolve(rows)
        assert [address for address, _ in await addresses()] == ["127.0.0.1"]


async def test_a_name_without_any_address_of_this_machine_is_refused(resolve):
    for rows, reason in (([NO_FAMILY, FOREIGN], "assign"), ([], "the host has no address")):
        resolve(rows)
        with pytest.raises(OSError, match=reason) as refusal:
            await bind("name", 0)
        assert refusal.value.errno == errno.EADDRNOTAVAIL


async def test_another_port_is_tried_when_one_address_has_it_in_use(resolve):
    every = (socket.AF_INET, ("0.0.0.0", 0))  # in use at any port of 127.0.0.1
    resolve([TWO[0], every], TWO)
    assert len(await addresses()) == 2


async def test_a_port_in_use_at_one_address_is_refused_and_nothing_stays_bound(resolve):
    with socket.create_server(("127.0.0.2", 0)) as other:
        port = other.getsockname()[1]
        resolve([(family, (host, port)) for family, (host, _) in TWO])
        with pytest.raises(OSError, match="in use"):
            await bind("name", port)
        socket.create_server(("127.0.0.1", port)).close()


async def page(*_):
    return response(200, "here", "text/plain")


async def get(host, port):
    reader, writer = await asyncio.open_connection(host, port)
    try:
        writer.write(b"GET / HTTP/1.1\r\nHost: localhost\r\n\r\n")
        return await reader.read()
    finally:
        writer.close()


@needs_ipv6
async def test_the_usual_address_is_listened_on_in_both_families():
    async with Listener(SocketLimiter(Counter()), page, page, 1000).listen("127.0.0.1", 0) as port:
        assert (await get("127.0.0.1", port)).endswith(b"here")
        assert (await get("::1", port)).endswith(b"here")


@needs_ipv6
async def test_another_program_at_the_same_port_of_ipv6_is_left_alone():
    with socket.create_server(("::1", 0), family=socket.AF_INET6) as other:
        port = other.getsockname()[1]
        (only,) = await bind("127.0.0.1", port)
        assert only.getsockname() == ("127.0.0.1", port)
        only.close()


async def test_a_request_that_is_still_being_answered_at_the_end_gets_no_answer():
    came, found = asyncio.Event(), asyncio.Event()

    async def late(*_):
        came.set()
        await found.wait()
        return await page()

    async with Listener(SocketLimiter(Counter()), late, page, 1000).listen("127.0.0.1", 0) as port:
        asked = asyncio.create_task(get("127.0.0.1", port))
        await came.wait()
        asyncio.get_running_loop().call_soon(found.set)
    assert await asked == b""


async def test_a_page_that_fails_is_an_internal_error_and_logged(caplog):
    async def broken(*_):
        raise RuntimeError

    async with Listener(SocketLimiter(Counter()), broken, page, 9).listen("127.0.0.1", 0) as port:
        answer = await get("127.0.0.1", port)
    assert answer.startswith(b"HTTP/1.1 500 ")
    assert answer.endswith(b"\r\n\r\ninternal error\n")
    assert "no answer for /" in caplog.text


async def test_this_machine_has_one_rate_of_connects_at_all_its_addresses(resolve, monkeypatch):
    monkeypatch.setattr("hapticvlm.server.edge.listener.CONNECTS", Rate(per_s=0.001, burst=4))
    resolve(TWO)
    hosts = [address for _, (address, _) in TWO]
    async with Listener(SocketLimiter(Counter()), page, page, 1000).listen("name", 0) as port:
        for host in hosts * 2:
            assert (await get(host, port)).endswith(b"here")
        for host in hosts:
            with pytest.raises(TimeoutError):
                await asyncio.wait_for(get(host, port), 0.3)


async def test_connects_above_the_rate_of_another_machine_are_closed_at_once_and_counted(
    monkeypatch,
):
    monkeypatch.setattr("hapticvlm.server.edge.listener.CONNECTS", Rate(per_s=0.001, burst=4))
    counts: Counter[Count] = Counter()
    async with Listener(SocketLimiter(counts), page, page, 1000).listen("0.0.0.0", 0) as port:
        for _ in range(4):
            assert (await get(own_address(), port)).endswith(b"here")
        for _ in range(3):
            with contextlib.suppress(ConnectionResetError):
                assert await get(own_address(), port) == b""
    assert counts == {Count.REFUSED_CONNECTS: 3}
