"""A host name with several addresses is listened on at all of them that exist, at one port."""

import asyncio
import errno
import socket
import sys

import pytest

from hapticvlm.server.edge.listener import bind

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="only Linux has 127.0.0.2 at once")

TWO = [(socket.AF_INET, ("127.0.0.1", 0)), (socket.AF_INET, ("127.0.0.2", 0))]
FOREIGN = (socket.AF_INET, ("203.0.113.1", 0))  # for documents; no machine has it
NO_FAMILY = (12, ("127.0.0.1", 0))  # DECnet, which no system has


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
    resolve([NO_FAMILY, FOREIGN])
    with pytest.raises(OSError, match="assign") as refusal:
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
