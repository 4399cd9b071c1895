"""Token buckets, places and sockets: each at its limit and one beyond."""

from collections import Counter

import pytest

from hapticvlm.server.access import Address
from hapticvlm.server.budgets import Rate, TokenBucket
from hapticvlm.server.entrance import Entrance


class Transport:
    def __init__(self):
        self.is_aborted = False

    def abort(self):
        self.is_aborted = True


class Socket:
    def __init__(self):
        self.transport = Transport()


def socket():
    """A socket of which only the transport is needed."""
    return Socket()


def test_a_bucket_gives_its_burst_and_then_its_rate():
    bucket = TokenBucket(Rate(per_s=10.0, burst=3.0), 0.0)
    assert [bucket.spend(1, 0.0) for _ in range(4)] == [True, True, True, False]
    assert not bucket.spend(1, 0.09)
    assert bucket.spend(1, 0.11)


def test_a_bucket_never_holds_more_than_its_burst_and_a_clock_that_jumps_back_gives_nothing():
    bucket = TokenBucket(Rate(per_s=10.0, burst=3.0), 0.0)
    assert [bucket.spend(1, 100.0) for _ in range(4)] == [True, True, True, False]
    assert not bucket.spend(1, 50.0)


def test_the_socket_that_waits_longest_for_hello_makes_room_and_is_counted():
    counts: Counter[str] = Counter()
    entrance: Entrance[Socket] = Entrance(counts, most=3)
    sockets = [socket() for _ in range(4)]
    for each in sockets[:3]:
        entrance.opened(each)
    entrance.greeted(sockets[0])
    assert not any(each.transport.is_aborted for each in sockets)
    entrance.opened(sockets[3])
    assert [each.transport.is_aborted for each in sockets] == [False, True, False, False]
    assert counts == {"closed: too many sockets before hello": 1}
    assert sockets[1] not in entrance.sockets


def test_a_newcomer_goes_when_all_others_have_said_hello():
    entrance: Entrance[Socket] = Entrance(Counter(), most=1)
    first, second = socket(), socket()
    entrance.opened(first)
    entrance.greeted(first)
    entrance.opened(second)
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
