"""Token buckets, places and sockets: each at its limit and one beyond."""

from collections import Counter

import pytest

from hapticvlm.server.access import Address
from hapticvlm.server.counters import Count
from hapticvlm.server.edge import limits
from hapticvlm.server.edge.limiter import SocketLimiter
from hapticvlm.server.edge.limits import CONNECTS, PHASES, Rate, TokenBucket
from hapticvlm.server.edge.listener import ConnectRates

ASKED_S = 0.5


class Transport:
    def __init__(self):
        self.is_aborted = False

    def abort(self):
        self.is_aborted = True


class Socket:
    def __init__(self):
        self.transport = Transport()

    def refuse(self, excess):
        raise AssertionError(excess)


def socket():
    """A socket of which only the transport is needed."""
    return Socket()


def test_a_bucket_never_holds_more_than_its_burst_and_a_clock_that_jumps_back_gives_nothing():
    bucket = TokenBucket(Rate(per_s=10.0, burst=3.0), 0.0)
    assert [bucket.spend(1, 100.0) for _ in range(4)] == [True, True, True, False]
    assert not bucket.spend(1, 50.0)


@pytest.mark.parametrize(
    ("rate", "burst", "per_s"),
    [
        (CONNECTS, 250, 250),
        (limits.MESSAGES, 4000, 2000),
        (limits.REFUSED, 2000, 200),
        (limits.CONTROL_FRAMES, 100, 20),
        (limits.RECOGNITION_RATE, 10, 20),
        (limits.LOG_REPEATS, 20, 5),
    ],
)
def test_each_rate_gives_so_many_at_once_and_then_so_many_a_second(rate, burst, per_s):
    assert not TokenBucket(rate, 0.0).spend(burst + 1, 0.0)
    bucket = TokenBucket(rate, 0.0)
    assert bucket.spend(burst, 0.0)
    assert not bucket.spend(per_s, 0.99)
    assert bucket.spend(min(per_s, burst), 1.0)


def test_the_socket_that_waits_longest_for_hello_makes_room_and_is_counted():
    counts: Counter[Count] = Counter()
    limiter: SocketLimiter[Socket] = SocketLimiter(counts, most=3)
    sockets = [socket() for _ in range(4)]
    for each in sockets[:3]:
        limiter.add(each, 0.0)
    limiter.mark_admitted(sockets[0])
    assert not any(each.transport.is_aborted for each in sockets)
    limiter.add(sockets[3], 0.0)
    assert [each.transport.is_aborted for each in sockets] == [False, True, False, False]
    assert counts == {Count.CLOSED_WAITING_SOCKETS: 1}
    assert sockets[1] not in limiter.sockets


def test_a_socket_that_has_sent_its_request_is_spared_for_a_moment_and_then_makes_room():
    limiter: SocketLimiter[Socket] = SocketLimiter(Counter(), most=2)
    honest, silent, third, fourth = (socket() for _ in range(4))
    for each in (honest, silent):
        limiter.add(each, 0.0)
    limiter.mark_requested(honest, 0.0)
    assert limiter.has_room(0.1)
    limiter.add(third, 0.1)
    assert silent.transport.is_aborted
    limiter.mark_requested(third, 0.1)
    assert not limiter.has_room(0.2)
    assert limiter.has_room(ASKED_S)
    limiter.add(fourth, ASKED_S)
    assert honest.transport.is_aborted
    assert not third.transport.is_aborted


def test_each_phase_lasts_so_long():
    seconds = {phase.name: each.seconds for phase, each in PHASES.items() if each.seconds}
    assert seconds == {"ASKING": 5.0, "BEFORE_HELLO": 10.0, "CLOSING": 1.0}


def test_newcomers_find_a_place_until_the_last_is_taken_by_sockets_that_are_spared():
    limiter: SocketLimiter[Socket] = SocketLimiter(Counter(), most=5)
    for _ in range(5):
        assert limiter.has_room(0.0)
        each = socket()
        limiter.add(each, 0.0)
        limiter.mark_requested(each, 0.0)
    assert not limiter.has_room(0.0)


def test_connects_have_a_budget_for_each_address_and_one_for_this_machine():
    budgets = ConnectRates()
    burst = int(CONNECTS.burst)
    assert all(budgets.spend("192.0.2.1", 0.0) for _ in range(burst))
    assert not budgets.spend("192.0.2.1", 0.0)
    assert budgets.spend("192.0.2.1", 1.5 / CONNECTS.per_s)
    assert all(budgets.spend(f"127.0.0.{number % 9}", 0.0) for number in range(burst))
    assert not budgets.spend("::1", 0.0)
    assert all(budgets.spend(f"198.51.100.{number}", 0.0) for number in range(256))
    assert all(budgets.spend("192.0.2.1", 0.0) for _ in range(burst)), "255 others are remembered"


def test_a_newcomer_goes_when_all_others_have_said_hello():
    limiter: SocketLimiter[Socket] = SocketLimiter(Counter(), most=1)
    first, second = socket(), socket()
    limiter.add(first, 0.0)
    limiter.mark_admitted(first)
    limiter.add(second, 0.0)
    assert second.transport.is_aborted
    assert not first.transport.is_aborted


@pytest.mark.parametrize(
    ("host", "token"),
    [
        ("0.0.0.0", ""),
        ("0.0.0.0", None),
        ("0.0.0.0", "eleven-char"),
        ("192.168.1.5", "a"),
        ("127.0.0.1", ""),
    ],
)
def test_a_token_that_is_missing_empty_or_short_off_loopback_is_refused(host, token):
    with pytest.raises(ValueError, match="--token"):
        Address(host, token=token)


@pytest.mark.parametrize(
    ("host", "token"),
    [("0.0.0.0", "twelve-chars"), ("127.0.0.1", None), ("127.0.0.1", "short"), ("::1", None)],
)
def test_a_token_of_twelve_characters_and_any_on_loopback_are_taken(host, token):
    assert Address(host, token=token).token == token
